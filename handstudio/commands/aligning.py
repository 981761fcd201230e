"""Headings by a take's own quick start, for the commands that make motion."""

from __future__ import annotations

import math

import numpy as np

from handstudio.commands.readings import show_verdicts
from handstudio.process import aligned_setup
from handstudio.recording.take import Take
from handstudio.setup import Setup
from handstudio.shell import err


def aligned(take: Take, setup: Setup) -> Setup:
    """The setup with these headings; how well they are known is said beside the result.

    Raises:
        CalibrationError: there is no quick start in the take, or none that can be used.
    """
    setup, found = aligned_setup(take, setup)
    known = [sd for sd in found.sd if math.isfinite(sd)]
    words = "{take}: headings aligned, standard deviation {middle:.2f} deg (worst {worst:.2f})."
    figures = np.rad2deg([float(np.median(known)), max(known)])
    err.print(words.format(take=take.path.name, middle=figures[0], worst=figures[1]))
    if not found.verdict.ok:
        show_verdicts((found.verdict,))
    return setup
