"""What was written and grasped in the open take, as the page shows it. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from app.shown.review import Review
from app.state import State
from app.views.room import stand_of_writing
from app.words import _
from handstudio.analysis.take_grasps import TakenGrasp
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.way import Stand

_MARGIN_M, _DESK_M = 0.008, 0.12
_HEIGHT_PX = 90
_INK_MM = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class TraceView:
    """A trace on its plane, from the elbow [m].

    Attributes:
        writing: Whose.
        desk: Corners of the plane that was written on, as far as a desk goes.
        page: Corners of the page.
        lines: What is written by now, piece by piece.
        count: How many pieces that is: tells whether anything is new.
        stand: Where the elbow rested.
    """

    writing: Writing
    desk: Float[Array, "4 3"]
    page: Float[Array, "4 3"]
    lines: Float[Array, "l 2 3"]
    count: int
    stand: Stand


def trace_view(state: State) -> TraceView | None:
    """The writing that is going on, or was last, or is to come; None: there is none."""
    review = state.review
    if review is None or review.found is None or not review.found.writings:
        return None
    writing = review.found.writing_at(review.at_s) or review.found.writings[0]
    both = writing.down[1:] & writing.down[:-1] & (writing.time_s[1:] <= review.at_s)
    points = writing.on_plane
    lines = np.stack([points[:-1][both], points[1:][both]], axis=1)
    desk, page = (_corners(writing, margin_m) for margin_m in (_DESK_M, _MARGIN_M))
    stand = stand_of_writing(state, writing)
    return TraceView(writing, desk, page, lines, len(lines), stand)


def trace_picture(review: Review) -> str:
    """The page seen from above: what is written by now is dark, what is to come is pale."""
    writing = None if review.found is None else review.found.writing_at(review.at_s)
    if writing is None:
        return ""
    low, high = _box(writing)
    width, height = 1e3 * (high - low)
    paths = []
    for stroke in writing.strokes:
        done = stroke.start + int(np.searchsorted(writing.time_s[stroke], review.at_s, "right"))
        paths += [_path(writing.flat[stroke], low, high, 0.25)]
        paths += [_path(writing.flat[stroke.start : done], low, high, 1.0)]
    return (
        f'<div style="padding:.1em .75em"><svg viewBox="0 0 {width:.1f} {height:.1f}" '
        f'height="{_HEIGHT_PX}" width="100%"><g fill="none" stroke="currentColor" '
        f'stroke-width="{_INK_MM}" stroke-linecap="round" stroke-linejoin="round">'
        f"{''.join(paths)}</g></svg></div>"
    )


def grasp_words(grasp: TakenGrasp) -> str:
    """Which, how sure, how large."""
    found = grasp.segment.found
    words = f"{grasp_names()[found.name]} {100.0 * found.confidence:.0f} %"
    if grasp.size is not None:
        words += f", {1e3 * grasp.size.diameter_m:.0f} mm"
    return words


def grasp_names() -> dict[str, str]:
    """Classes of grasps in words, after Feix."""
    return {
        "heavy_wrap_large": _("Large diameter"),
        "heavy_wrap_small": _("Small diameter"),
        "medium_wrap": _("Medium wrap"),
        "adducted_thumb": _("Adducted thumb"),
        "light_tool": _("Light tool"),
        "thumb_4_finger": _("Prismatic, four fingers"),
        "thumb_3_finger": _("Prismatic, three fingers"),
        "thumb_2_finger": _("Prismatic, two fingers"),
        "thumb_index_finger": _("Palmar pinch"),
        "power_disk": _("Power disk"),
        "power_sphere": _("Power sphere"),
        "precision_disk": _("Precision disk"),
        "precision_sphere": _("Precision sphere"),
        "tripod": _("Tripod"),
        "lateral_pinch": _("Lateral"),
    }


def _corners(writing: Writing, margin_m: float) -> Array:
    """Of the box around what is written, on its plane."""
    low, high = _box(writing, margin_m)
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    on_plane: Array = writing.origin + corners @ writing.axes
    return on_plane


def _box(writing: Writing, margin_m: float = _MARGIN_M) -> tuple[Array, Array]:
    """Of what is written, with a margin."""
    written = writing.flat[writing.down]
    return written.min(axis=0) - margin_m, written.max(axis=0) + margin_m


def _path(flat: Array, low: Array, high: Array, opacity: float) -> str:
    if len(flat) < 2:
        return ""
    x, y = 1e3 * (flat[:, 0] - low[0]), 1e3 * (high[1] - flat[:, 1])
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" stroke-opacity="{opacity}"/>'
