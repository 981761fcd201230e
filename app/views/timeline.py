"""A take as a strip: its length, the part that counts, marks, named stretches, doubts. Pure."""

from __future__ import annotations

import html

import numpy as np

from app.review import Review
from app.views.written import grasp_words
from app.words import _
from handstudio.pipeline import Motion

_WIDTH = 1000.0  # of the drawing; the page stretches it
_DOUBTS = 200  # stretches that are told apart at most


def as_svg(review: Review) -> str:
    """The strip with the playhead, as the page shows it."""
    end = max(review.duration_s, 1e-6)

    def at(seconds: float) -> float:
        return round(_WIDTH * min(max(seconds / end, 0.0), 1.0), 1)

    parts = [_bar((0.0, _WIDTH), (12, 8), "currentColor", 0.15)]
    if review.in_s > 0.0 or review.out_s is not None:
        parts.append(_bar((at(review.in_s), at(review.end_s)), (12, 8), "#3b82f6", 0.6))
    for begin, stop in doubts_of(review.motion):
        parts.append(_bar((at(begin), max(at(stop), at(begin) + 2.0)), (20, 4), "#f5a524", 0.9))
    for label in review.notes.labels:
        title = f"{label.label} {label.start_s:.2f}-{label.end_s:.2f} s"
        parts.append(_bar((at(label.start_s), at(label.end_s)), (5, 5), "#12b886", 0.8, title))
    unnamed = _("mark")
    for mark in review.notes.marks:
        title = f"{mark.text or unnamed} {mark.at_s:.2f} s"
        parts.append(_bar(_around(at(mark.at_s), 1.5), (4, 20), "#fcd34d", 1.0, title))
    for grasp in review.found.grasps:
        segment = grasp.segment
        moving = (at(segment.start_s), at(segment.end_s))
        holding = (at(segment.hold_s), at(segment.release_s))
        title = f"{grasp_words(grasp)} {segment.hold_s:.2f}-{segment.release_s:.2f} s"
        parts.append(_bar(moving, (26, 5), "#8b5cf6", 0.35, title))
        parts.append(_bar(holding, (26, 5), "#8b5cf6", 0.9, title))
    parts.append(_bar(_around(at(review.at_s), 1.0), (2, 24), "currentColor", 1.0))
    return (
        f'<div style="padding:.1em .75em"><svg viewBox="0 0 {_WIDTH:.0f} 32" height="32" '
        f'width="100%" preserveAspectRatio="none">{"".join(parts)}</svg></div>'
    )


def doubts_of(motion: Motion) -> tuple[tuple[float, float], ...]:
    """Stretches in which any sensor is in doubt [s], at most so many; the rest are joined."""
    if len(motion) == 0:
        return ()
    time_s = (motion.time_us - motion.time_us[0]) * 1e-6
    doubtful = np.concatenate([[False], (motion.doubt != 0).any(axis=1), [False]])
    begins = np.flatnonzero(~doubtful[:-1] & doubtful[1:])
    ends = np.flatnonzero(doubtful[:-1] & ~doubtful[1:]) - 1
    if len(begins) > _DOUBTS:
        chosen = np.linspace(0, len(begins) - 1, _DOUBTS).astype(int)
        begins, ends = begins[chosen], ends[np.append(chosen[1:] - 1, len(ends) - 1)]
    return tuple((float(time_s[b]), float(time_s[e])) for b, e in zip(begins, ends, strict=True))


def _around(middle: float, half: float) -> tuple[float, float]:
    return middle - half, middle + half


def _bar(
    across: tuple[float, float], down: tuple[int, int], colour: str, opacity: float, title: str = ""
) -> str:
    """A rectangle from left to right, from so far down so high."""
    (left, right), (top, height) = across, down
    inner = f"<title>{html.escape(title)}</title>" if title else ""
    return (
        f'<rect x="{left:.1f}" y="{top}" width="{max(right - left, 0.0):.1f}" height="{height}" '
        f'rx="1.5" fill="{colour}" fill-opacity="{opacity}">{inner}</rect>'
    )
