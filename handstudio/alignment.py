"""Headings that agree: from a quick start, or from a hand that lies flat now."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.heading import HeadingAlignment, tolerances_of
from handstudio.calibration.quick_start import Labelled, quick_start
from handstudio.calibration.recorded import even
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.hand_fit import fit_of
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples
from handstudio.setup import Setup


def aligned(
    setup: Setup, runs: Sequence[ImuSamples], labels: Sequence[Labelled] = ()
) -> tuple[Setup, HeadingAlignment]:
    """The setup whose headings agree by a recording's own quick start, and how well they do.

    Args:
        setup: Of the recording.
        runs: Its samples, as they were read.
        labels: What its labels say [s since the first sample]; without a turn among them the quick
            start is looked for.

    Raises:
        CalibrationError: there is no quick start in it, or none that can be used.
    """
    names = setup.layout.names
    samples = even(runs, setup.rate_hz, setup.sensors, names).samples
    found, _ = quick_start(
        samples,
        names,
        labels=labels,
        compass=bool(samples.fresh.any()),  # without any the turn alone tells headings
        tolerances=tolerances_of(setup.sensors is not None),
    )
    return msgspec.structs.replace(setup, heading_rad=found.psi_cor), found


def reset(
    setup: Setup,
    q_world_sensor: Float[Array, "s 4"],
    sensor: str | None = None,
    placed: Bool[Array, " s"] | None = None,
) -> Setup:
    """The setup by which a hand that lies flat now lies flat, as far as headings go.

    Only turns about the vertical are changed: what else differs is the mounting's. Where the hand
    points is as its own sensor says.

    Args:
        setup: The one in use.
        q_world_sensor: The hand as it is shown with it now.
        sensor: Turn this one alone; None: all.
        placed: Which sensors know their attitude; None: all. The others stay.

    Raises:
        LayoutError: the layout is not a hand's.
        CalibrationError: there is no such sensor, or none that others could be held against.
    """
    fit, layout = fit_of(setup), setup.layout
    sure = np.ones(len(layout.sensors), dtype=bool) if placed is None else placed
    turned = _turned_ones(layout, sensor) & sure
    segment = [SEGMENTS.index(place.segment) for place in layout.sensors]
    q_root_segment = _at_flat_hand(fit.skeleton)[segment]
    q_world_segment = so3.multiply(q_world_sensor, fit.q_sensor_segment)
    held = _held_against(layout, sensor, sure)
    q_world_root = so3.multiply(q_world_segment[held], so3.conjugate(q_root_segment[held]))
    expected = so3.multiply(q_world_root, q_root_segment)
    off = so3.heading(so3.multiply(expected, so3.conjugate(q_world_segment)))
    before = np.array(setup.heading_rad or np.zeros(len(off)))
    after = np.where(turned, np.angle(np.exp(1j * (before + off))), before)
    return msgspec.structs.replace(setup, heading_rad=tuple(after.tolist()))


def between(before: Setup, after: Setup) -> Setup:
    """A setup whose headings take what is turned as ``before`` says to what ``after`` says."""
    none = (0.0,) * len(before.layout.sensors)
    pairs = zip(before.heading_rad or none, after.heading_rad or none, strict=True)
    return msgspec.structs.replace(after, heading_rad=tuple(b - a for a, b in pairs))


def _turned_ones(layout: Layout, sensor: str | None) -> Bool[Array, " s"]:
    if sensor is not None and sensor not in layout.names:
        raise CalibrationError(
            "There is no sensor {sensor}.",
            "Choose one of: {known}.",
            sensor=sensor,
            known=", ".join(layout.names),
        )
    return np.array([sensor in (None, name) for name in layout.names])


def _held_against(layout: Layout, sensor: str | None, placed: Bool[Array, " s"]) -> int:
    """The sensor by which the present attitude of the hand is told: the hand's, if it can be."""
    drivers = layout.drivers
    for segment in ("hand", "forearm", *SEGMENTS):
        at = drivers.get(segment)
        if at is not None and placed[at] and layout.names[at] != sensor:
            return at
    raise CalibrationError(
        "No sensor knows how it lies yet.", "Lay the hand down and hold it still, then try again."
    )


def _at_flat_hand(skeleton: Skeleton) -> Float[Array, "k 4"]:
    """Attitudes of all segments in the root's, the hand lying flat."""
    out = list[Array]()
    for index, parent in enumerate(PARENTS):
        rest = skeleton.q_parent_rest[index]
        out.append(so3.IDENTITY if parent < 0 else so3.multiply(out[parent], rest))
    return np.stack(out)
