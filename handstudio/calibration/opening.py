"""A recorded course that begins with a quick start: headings from that, then all the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handstudio.calibration.heading import tolerances_of
from handstudio.calibration.quick_start import Labelled, quick_start
from handstudio.calibration.recorded import Recorded
from handstudio.calibration.swings import Swings, prepared
from handstudio.layout import Layout


def opened(
    layout: Layout,
    rate_hz: float,
    recorded: Recorded,
    labels: Sequence[Labelled],
    *,
    calibrated: bool,
) -> Swings:
    """Prepare a course, in the world that its own turn of the rig defines; no compass counts.

    Args:
        layout: Of the glove.
        rate_hz: Of the samples.
        recorded: The samples, freed of the sensors' errors as far as they are known.
        labels: What its labels say, in order.
        calibrated: Whether the sensors' errors are known.

    Raises:
        CalibrationError: there is no quick start in it, or none that can be used.
    """
    samples = recorded.samples
    alignment, _ = quick_start(
        samples,
        layout.names,
        labels=labels,
        compass=False,
        tolerances=tolerances_of(calibrated),
    )
    return prepared(
        layout,
        rate_hz,
        samples.gyr,
        samples.acc,
        labels=labels,
        heading=np.array(alignment.psi_wg),
        alive=recorded.alive,
    )
