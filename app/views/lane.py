"""What was grasped and written, by name, over the time that is in the plots. Pure."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass

from app.shown.review import Review
from app.views.written import grasp_words
from app.words import _
from handstudio.analysis.writing import Writing

GRASP, INK = "#12b5cb", "#3b6fe0"

_READABLE = 0.045  # of the lane's width: room for a few letters
_LINE = "height:1.35em;line-height:1.35em;font-size:.68rem;white-space:nowrap;overflow:hidden"


@dataclass(frozen=True, slots=True)
class Named:
    """Something that was found, from begin to end of its core [s], and what it is called."""

    begin_s: float
    end_s: float
    words: str
    colour: str

    @property
    def title(self) -> str:
        """All of it in words."""
        return f"{self.words} {self.begin_s:.2f}-{self.end_s:.2f} s"


def named(review: Review) -> list[Named]:
    """Holds of grasps and writings, in the order of their begins."""
    if review.found is None:
        return []
    grasps = [
        Named(one.segment.hold_s, one.segment.release_s, grasp_words(one), GRASP)
        for one in review.found.grasps
    ]
    writings = [
        Named(float(one.time_s[0]), float(one.time_s[-1]), _("writing"), INK)
        for one in review.found.writings
    ]
    return sorted([*grasps, *writings], key=lambda one: one.begin_s)


def strokes_s(writing: Writing) -> Iterator[tuple[float, float]]:
    """When the pen was down."""
    for stroke in writing.strokes:
        yield float(writing.time_s[stroke.start]), float(writing.time_s[stroke.stop - 1])


def as_html(review: Review) -> str:
    """The lane; nothing where nothing was found in the whole take.

    A name goes on as far as there is room before the next one; where there is hardly any, the
    pointer on the bar tells it.
    """
    found = named(review)
    if not found:
        return ""
    width = max(review.to_s - review.from_s, 1e-6)

    def share(seconds: float) -> float:
        return min(max((seconds - review.from_s) / width, 0.0), 1.0)

    seen = [one for one in found if one.end_s >= review.from_s and one.begin_s <= review.to_s]
    begins = [*(share(one.begin_s) for one in seen), 1.0]
    parts = "".join(
        _piece(one, begin, share(one.end_s), room)
        for one, begin, room in zip(seen, begins[:-1], begins[1:], strict=True)
    )
    return f'<div style="position:relative;margin-top:.15em;{_LINE}">{parts}</div>'


def _piece(one: Named, begin: float, end: float, room: float) -> str:
    """A bar as long as it lasts, and its name on it and beyond."""
    title = html.escape(one.title, quote=True)
    bar = (
        f'<span title="{title}" style="position:absolute;top:0;bottom:0;left:{100 * begin:.2f}%;'
        f"width:{100 * max(end - begin, 0.003):.2f}%;background:{one.colour};opacity:.4;"
        f'border-radius:2px"></span>'
    )
    if max(room, end) - begin < _READABLE:
        return bar
    return (
        f'{bar}<span title="{title}" style="position:absolute;left:{100 * begin:.2f}%;'
        f"width:{100 * (max(room, end) - begin):.2f}%;overflow:hidden;text-overflow:ellipsis;"
        f'padding-left:3px;box-sizing:border-box">{html.escape(one.words)}</span>'
    )
