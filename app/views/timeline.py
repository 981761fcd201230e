"""A take as a strip: its length, the part that counts, what was noted and found. Pure."""

from __future__ import annotations

import html
from collections.abc import Iterator

from app.shown.review import Review
from app.views import lane
from app.views.written import grasp_words
from app.words import _, language
from handstudio.analysis.stretches import Stretch, StretchKind

_WIDTH = 1000.0  # of the drawing; the page stretches it

# lanes from above: notes, the take itself, what is missing or doubted, what can hardly be, grasps
# and pen strokes
_NOTED, _TAKE, _DATA, _HARDLY = (4, 7), (14, 8), (25, 5), (32, 5)
_GRASPS = (39, 5)
_HEIGHT = 47

_LENS, _PART = "rgba(128,128,128,.22)", "rgba(59,130,246,.6)"

_COLOURS: dict[StretchKind, str] = {
    "gap": "#e5484d",
    "silent": "#e5484d",
    "unplaced": "#8a909a",
    "saturated": "#f5a524",
    "impossible": "#c061cb",
    "drift": "#6e56cf",
}


def as_html(review: Review) -> str:
    """The strip, the names of what was found, which colour is what; all but what lies over it."""
    return strip(review) + below(review)


def strip(review: Review) -> str:
    """The whole take; as long as that is, so it is made only where `drawn_from` differs."""
    parts = "".join(_parts(review))
    return (
        f'<div style="padding:.1em .75em 0"><svg viewBox="0 0 {_WIDTH:.0f} {_HEIGHT}" '
        f'height="{_HEIGHT}" width="100%" preserveAspectRatio="none" '
        f'style="display:block">{parts}</svg></div>'
    )


def drawn_from(review: Review) -> tuple[object, ...]:
    """What `strip` depends on: the same as before, the same strip."""
    noted = review.notes, review.stretches, review.found
    return review.take.path, id(review.motion), *noted, language()


def below(review: Review) -> str:
    """The names of what is in the plots, and which colour is what."""
    return f'<div style="padding:0 .75em .1em">{lane.as_html(review)}{_legend(review)}</div>'


def overlay(review: Review) -> str:
    """The playhead, the part that counts and what is in the plots.

    It belongs just before the strip on the page: it lies over it.
    """
    end = max(review.duration_s, 1e-6)
    width = review.to_s - review.from_s
    near = 0.0 < width < review.duration_s - 1e-6
    marks = []
    if near:
        marks.append(_across(review.from_s / end, review.to_s / end, (0, _HEIGHT), _LENS))
    if review.in_s > 0.0 or review.out_s is not None:
        marks.append(_across(review.in_s / end, review.end_s / end, _TAKE, _PART))
    marks.append(_line(review.at_s / end, 0, _HEIGHT))
    if review.found is not None and (review.found.grasps or review.found.writings):
        there = (review.at_s - review.from_s) / width if near else review.at_s / end
        marks.append(_line(there, _HEIGHT + 2, 15))
    return (
        '<div style="position:relative;height:0;z-index:1;pointer-events:none"><div '
        f'style="position:absolute;top:.1em;left:.75em;right:.75em">{"".join(marks)}</div></div>'
    )


def words_of(stretch: Stretch) -> str:
    """What is the matter with a stretch."""
    who = ", ".join(stretch.names[:3]) + (" …" if len(stretch.names) > 3 else "")
    how = _figures()[stretch.kind].format(worst=stretch.worst)
    told = " ".join(filter(None, [_kinds()[stretch.kind], who, how]))
    return f"{told} · {stretch.start_s:.2f}-{stretch.end_s:.2f} s"


def rest_words(review: Review) -> str:
    """What is missing of a take that is not all there."""
    if review.rest == "coming":
        return _("the first seconds; the rest is being computed")
    return _("only the first seconds; the rest is not computed") if review.partial else ""


def _parts(review: Review) -> Iterator[str]:
    end = max(review.duration_s, 1e-6)

    def at(seconds: float) -> float:
        return round(_WIDTH * min(max(seconds / end, 0.0), 1.0), 1)

    def wide(begin_s: float, end_s: float) -> tuple[float, float]:
        """Wide enough to be seen and met by a pointer."""
        return at(begin_s), max(at(end_s), at(begin_s) + 2.5)

    yield _bar((0.0, _WIDTH), _TAKE, "currentColor", 0.15)
    for stretch in review.stretches or ():
        row = _HARDLY if stretch.kind in ("impossible", "drift") else _DATA
        span = wide(stretch.start_s, stretch.end_s)
        yield _bar(span, row, _COLOURS[stretch.kind], 0.9, words_of(stretch))
    for label in review.notes.labels:
        title = f"{label.label} {label.start_s:.2f}-{label.end_s:.2f} s"
        yield _bar(wide(label.start_s, label.end_s), _NOTED, "#12b886", 0.8, title)
    unnamed = _("mark")
    for mark in review.notes.marks:
        title = f"{mark.text or unnamed} {mark.at_s:.2f} s"
        yield _bar(_around(at(mark.at_s), 1.5), (2, 22), "#fcd34d", 1.0, title)
    for grasp in review.found.grasps if review.found else ():
        segment = grasp.segment
        title = f"{grasp_words(grasp)} {segment.hold_s:.2f}-{segment.release_s:.2f} s"
        yield _bar((at(segment.start_s), at(segment.end_s)), _GRASPS, lane.GRASP, 0.35, title)
        yield _bar((at(segment.hold_s), at(segment.release_s)), _GRASPS, lane.GRASP, 0.9, title)
    for writing in review.found.writings if review.found else ():
        begin_s, end_s = float(writing.time_s[0]), float(writing.time_s[-1])
        title = f"{_('writing')} {begin_s:.2f}-{end_s:.2f} s"
        yield _bar((at(begin_s), at(end_s)), _GRASPS, lane.INK, 0.35, title)
        for down_s, up_s in lane.strokes_s(writing):
            yield _bar((at(down_s), at(up_s)), _GRASPS, lane.INK, 0.9, title)


def _legend(review: Review) -> str:
    """The kinds that occur; else that there are none."""
    style = "font-size:.72rem;line-height:1.3;opacity:.8"
    if review.stretches is None:
        looked = "stretches" in review.ordered
        words = _("looking through the take ...") if looked else _("not looked through")
        return f'<div style="{style}">{html.escape(rest_words(review) or words)}</div>'
    found: dict[StretchKind, int] = {}
    for stretch in review.stretches:
        found[stretch.kind] = found.get(stretch.kind, 0) + 1
    kinds = _kinds()
    told = " ".join(
        f'<span style="white-space:nowrap"><span style="color:{_COLOURS[kind]}">&#9632;</span> '
        f"{html.escape(kinds[kind])} {count}</span>"
        for kind, count in sorted(found.items(), key=lambda one: list(_COLOURS).index(one[0]))
    )
    return f'<div style="{style}">{told or html.escape(_("nothing to look at twice"))}</div>'


def _kinds() -> dict[StretchKind, str]:
    return {
        "gap": _("gap"),
        "silent": _("silent sensor"),
        "unplaced": _("not yet at rest"),
        "saturated": _("saturated"),
        "impossible": _("hardly possible"),
        "drift": _("turns at rest"),
    }


def _figures() -> dict[StretchKind, str]:
    return {
        "gap": _("{worst:.0f} instants missing"),
        "silent": "",
        "unplaced": "",
        "saturated": "",
        "impossible": _("{worst:.0f}° beyond"),
        "drift": _("{worst:.0f}° a minute"),
    }


def _across(begin: float, end: float, down: tuple[int, int], colour: str) -> str:
    return (
        f'<div style="position:absolute;left:{100 * begin:.2f}%;width:{100 * (end - begin):.2f}%;'
        f'top:{down[0]}px;height:{down[1]}px;background:{colour}"></div>'
    )


def _line(share: float, top: int, height: int) -> str:
    if not 0.0 <= share <= 1.0:
        return ""
    return (
        f'<div style="position:absolute;left:calc({100 * share:.2f}% - 1px);top:{top}px;'
        f'width:2px;height:{height}px;background:currentColor"></div>'
    )


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
