"""SVG: joint angles over time, plots one above the other; text stays text."""

from __future__ import annotations

from typing import BinaryIO

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.colours import INDEX, LITTLE, MIDDLE, RING, THUMB, of_part
from handstudio.errors import TakeError
from handstudio.export.part import Part
from handstudio.hand.angles import Angle
from handstudio.kinematics import angles_of

_COLUMNS = 1500
"""Instants of a curve at most, twice: of more only the least and the greatest are drawn."""

_PLOT_IN, _EDGES_IN = 1.9, 1.2
"""Height of a plot, and above and below all of them [inches]."""

_JUMP = 1.5  # usual steps: over a longer one no line is drawn
_CYCLE = (INDEX, THUMB, MIDDLE, LITTLE, RING)
"""Colours of curves that are not one a finger."""


def write(part: Part, file: BinaryIO) -> None:
    """Draw the angles, joints of a kind in one plot.

    Raises:
        TakeError: the library that draws is not installed.
    """
    try:
        import matplotlib as mpl  # noqa: PLC0415 - only where it is wanted
        from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415
        from matplotlib.figure import Figure  # noqa: PLC0415
    except ImportError as error:
        raise TakeError(
            "A picture needs matplotlib, which is not installed ({reason}).",
            "Install it, or choose another format.",
            reason=error,
        ) from error
    angles = part.angles
    time_s, degrees = _curves(part, angles)
    groups = _groups(angles)
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "handstudio"}):
        high = _EDGES_IN + _PLOT_IN * len(groups)
        figure = Figure(figsize=(10.0, high))
        FigureCanvasSVG(figure)
        plots = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        edge = 0.5 * _EDGES_IN / high
        figure.subplots_adjust(left=0.07, right=0.8, top=1.0 - edge, bottom=edge, hspace=0.3)
        for plot, (title, columns) in zip(plots, groups.items(), strict=True):
            colours = _colours([angles[column].name for column in columns])
            for column, colour in zip(columns, colours, strict=True):
                label = angles[column].name.replace("_", " ")
                plot.plot(time_s, degrees[:, column], color=colour, lw=1.1, label=label)
            plot.set_title(title, loc="left", fontsize=10)
            plot.set_ylabel("angle [deg]")
            plot.grid(alpha=0.3)
            plot.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7, frameon=False)
        plots[-1].set_xlabel("time [s]")
        about = part.about
        figure.suptitle(
            f"{about['take']} · {about['subject']} · {about['hand_side']} hand · "
            f"{about['start_utc']} · zero: {about['zero']}",
            fontsize=9,
            y=1.0 - 0.3 * edge,
        )
        told = {
            "Title": str(about["take"]),
            "Creator": str(about["software"]),
            "Date": str(about["start_utc"]),
            "Description": msgspec.json.encode(about).decode(),
        }
        figure.savefig(file, format="svg", metadata=told)


def _groups(angles: tuple[Angle, ...]) -> dict[str, list[int]]:
    """Plots by their titles, and which angles are in them: a finger's joint each, then the rest."""
    groups: dict[str, list[int]] = {}
    for index, angle in enumerate(angles):
        groups.setdefault(_title(angle), []).append(index)
    return groups


def _colours(names: list[str]) -> list[list[float]]:
    """Each finger's own, where there is one curve a finger."""
    apart = len({name.split("_")[0] for name in names}) == len(names)
    chosen = [of_part(n) if apart else _CYCLE[k % len(_CYCLE)] for k, n in enumerate(names)]
    return [[channel / 255.0 for channel in colour] for colour in chosen]


def _title(angle: Angle) -> str:
    part, _, joint = angle.joint.rpartition("_")
    if part == "thumb":
        return "Thumb"
    turn = angle.name.removeprefix(f"{angle.joint}_").split("_")[0]
    if part in ("index", "middle", "ring", "little"):
        return f"{joint.upper()} {turn}"
    return "Forearm, wrist and palm"


def _curves(part: Part, angles: tuple[Angle, ...]) -> tuple[Array, Array]:
    """Times and angles as they are drawn: NaN in gaps, few enough instants."""
    blocks = [(m.time_us, np.rad2deg(angles_of(part.setup, m, angles))) for m in part.blocks()]
    time_us = np.concatenate([time for time, _ in blocks])
    degrees = np.concatenate([values for _, values in blocks])
    time_s = part.seconds(part.motion)
    if len(time_us) > 1:
        steps = np.diff(time_us)
        after = np.flatnonzero(steps > _JUMP * np.median(steps)) + 1
        time_s = np.insert(time_s, after, time_s[after - 1])
        degrees = np.insert(degrees, after, np.nan, axis=0)
    return _thinned(time_s, degrees)


def _thinned(time_s: Array, degrees: Array) -> tuple[Array, Array]:
    """What is seen of long curves: the least and the greatest value of every stretch."""
    if len(time_s) <= 2 * _COLUMNS:
        return time_s, degrees
    edges = np.unique(np.linspace(0, len(time_s), _COLUMNS + 1).astype(int))[:-1]
    # fmin and fmax pass over what is not known; a stretch of nothing else stays unknown
    least, most = np.fmin.reduceat(degrees, edges), np.fmax.reduceat(degrees, edges)
    drawn = np.stack([least, most], axis=1).reshape(-1, degrees.shape[1])
    return np.repeat(time_s[edges], 2), drawn
