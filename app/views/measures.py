"""Measures as the page shows them: in brief beside the hand, in full on a sheet. Pure."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from pathlib import Path

from app.report.names import about_name, grade_word, row_name, why_words
from app.report.tables import Table, is_short, tables_of
from app.shown.review import Review
from app.state import State
from app.views.pieces import AMBER, GREEN
from app.words import _
from handstudio.analysis.change import Change
from handstudio.analysis.measure import Kind, Measure
from handstudio.analysis.posture_time import Band
from handstudio.analysis.sides import SideRatio
from handstudio.analysis.tables import Row, grouped, judged
from handstudio.kinematics import measured_angles
from handstudio.layout import Layout
from handstudio.measure import Measured
from handstudio.recording.header import Header


def none_words() -> str:
    """What is chosen where nothing is compared."""
    return _("none")


def earlier_takes(state: State) -> dict[str, Path]:
    """Takes of the hand of the open one that were recorded before it, newest first, by words."""
    return _takes(
        state,
        lambda this, one: (
            one.setup.layout.side == this.setup.layout.side and one.start_utc_ns < this.start_utc_ns
        ),
    )


def other_hand(state: State) -> dict[str, Path]:
    """Takes of the other hand of the person of the open one, newest first, by words."""
    return _takes(
        state,
        lambda this, one: {one.setup.layout.side, this.setup.layout.side} == {"left", "right"},
    )


def _takes(state: State, wanted: Callable[[Header, Header], bool]) -> dict[str, Path]:
    if state.review is None:
        return {}
    this = state.review.take.header
    found = [
        (entry.take.header.start_utc_ns, f"{entry.visit} · {entry.name}", entry.path)
        for entry in state.shelf.takes
        if entry.take is not None
        and entry.take.header.subject == this.subject
        and wanted(this, entry.take.header)
    ]
    return {words: path for _at, words, path in sorted(found, reverse=True)}


def angle_choices(layout: Layout) -> dict[str, str]:
    """Measured angles by what people call them."""
    return {about_name(angle.name): angle.name for angle in measured_angles(layout)}


def own_postures(bands: Sequence[Band]) -> dict[str, str]:
    """Names of postures of one's own by words that tell all of each."""
    words: dict[str, str] = {}
    for band in bands:
        ends = "" if band.above_deg is None else f"{band.above_deg:g}"
        others = "" if band.below_deg is None else f"{band.below_deg:g}"
        told = named_by_ends(about_name(band.angle), ends, others)
        words[told if band.name == told else f"{band.name}: {told}"] = band.name
    return words


def named_by_ends(angle: str, above: str, below: str) -> str:
    """What a posture is called that nobody gave a name."""
    above, below = above.strip(), below.strip()
    if not below:
        return _("{angle} above {degrees}°").format(angle=angle, degrees=above)
    if not above:
        return _("{angle} below {degrees}°").format(angle=angle, degrees=below)
    return _("{angle} {above} to {below}°").format(angle=angle, above=above, below=below)


def short_html(review: Review) -> str:
    """Ranges and scores, one line each, and whether they are of the part that counts now."""
    measured = review.measured
    if measured is None:
        return ""
    visit = measured.visit
    known = {(change.kind, change.about): change for change in measured.changes}
    part = _("part {begin:.1f} to {end:.1f} s").format(begin=visit.start_s, end=visit.end_s)
    told = [f'<div style="opacity:.75;padding:.2em 0">{html.escape(part)}</div>']
    if abs(visit.start_s - review.in_s) > _APART_S or abs(visit.end_s - review.end_s) > _APART_S:
        other = _("Another part counts now: measure again.")
        told.append(f'<div style="color:{AMBER}">{html.escape(other)}</div>')
    sides = {(ratio.kind, ratio.about): ratio for ratio in measured.sides}
    shown = [
        row
        for group in grouped(measured.measures)
        if group.name in ("range", "scores", "opposition")
        for row in group.rows
    ]
    if any(map(is_short, shown)):
        short = _("short of usual, or not asked for")
        told.append(f'<div style="color:{AMBER}">■ {html.escape(short)}</div>')
    rows = [_line(row, known, sides) for row in shown]
    told.append(f'<table style="{_TABLE}">{"".join(rows)}</table>')
    return f'<div style="padding:0 .75em;font-size:.8rem;line-height:1.35">{"".join(told)}</div>'


def full_html(measured: Measured) -> str:
    """Every table."""
    tables = [_table(table) for table in tables_of(measured)]
    return f'<div style="padding:.2em 1em 1em;font-size:.85rem">{"".join(tables)}</div>'


_APART_S = 0.05
_TABLE = "border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums"
_CELL = "padding:.1em .5em .1em 0;vertical-align:top"


def _line(
    row: Row, known: dict[tuple[Kind, str], Change], sides: dict[tuple[Kind, str], SideRatio]
) -> str:
    said, colour = _brief(row), AMBER if is_short(row) else ""
    beyond = [c for c in judged(row, known) if c.verdict in ("more", "less")]
    sign = ""
    if beyond:
        sign = "▲" if any(c.verdict == "more" for c in beyond) else "▼"
    style = f"color:{colour}" if colour else ""
    return (
        f'<tr style="{style}"><td style="{_CELL}">{html.escape(row_name(row.about))}</td>'
        f'<td style="{_CELL};white-space:nowrap">{html.escape(said)}</td>'
        f'<td style="color:{GREEN}">{sign}</td>{_of_other(row, sides)}</tr>'
    )


def _of_other(row: Row, sides: dict[tuple[Kind, str], SideRatio]) -> str:
    """The share of the other hand's, in brief: of a finger that of its total active motion."""
    found = [sides[kind, row.about] for kind in row.cells if (kind, row.about) in sides]
    title = html.escape(_("of the other hand"))
    if not found:
        return ""
    return f'<td title="{title}" style="opacity:.75">{found[0].percent:.0f} %</td>'


def _brief(row: Row) -> str:
    """The figures of a row without their uncertainties."""
    least, most = row.cells.get("least"), row.cells.get("most")
    if least is not None and most is not None:
        if least.value is None:
            return f"– {why_words(least.why)}"
        return _("{least} to {most}").format(least=_figure(least), most=_figure(most)) + "°"
    out = []
    for kind, measure in row.cells.items():
        if measure.value is None:
            out.append(f"– {why_words(measure.why)}")
        elif kind == "kapandji":
            out.append(f"Kapandji {_figure(measure)}")
        else:
            name = {"tam": "TAM ", "strickland": "Strickland "}.get(kind, "")
            unit = {"deg": "°", "%": " %"}.get(measure.unit, "")
            out.append(" ".join(filter(None, [f"{name}{_figure(measure)}{unit}"])))
            if kind in ("tam", "strickland"):
                out[-1] += f" {grade_word(measure.grade)}"
    return ", ".join(dict.fromkeys(out))  # one reason for all is said once


def _figure(measure: Measure) -> str:
    return f"{round(measure.value or 0.0)}".replace("-", "−")


def _table(table: Table) -> str:
    head = "".join(f'<th style="{_HEAD}">{html.escape(each)}</th>' for each in table.columns)
    body = "".join(
        f'<tr style="{_MARKED.get(mark, "")}">'
        + "".join(f'<td style="{_WIDE}">{html.escape(cell)}</td>' for cell in row)
        + "</tr>"
        for row, mark in zip(table.rows, table.marks, strict=True)
    )
    return (
        f'<h3 style="margin:1em 0 .1em;font-size:1rem">{html.escape(table.title)}</h3>'
        f'<div style="opacity:.75">{html.escape(table.note)}</div>'
        f'<div style="overflow-x:auto"><table style="{_TABLE}"><tr>{head}</tr>{body}</table></div>'
    )


_HEAD = "text-align:left;padding:.3em 1em .3em 0;border-bottom:1px solid currentColor"
_WIDE = "padding:.15em 1em .15em 0;white-space:nowrap"
_MARKED = {"short": f"color:{AMBER}", "changed": f"color:{GREEN}"}
