"""Measures as tables of words: the same on the page and in a report."""

from __future__ import annotations

from dataclasses import dataclass

from app.report.names import (
    figure,
    grade_word,
    group_note,
    group_title,
    kind_name,
    row_name,
    unit_sign,
    verdict_words,
)
from app.words import _
from handstudio.analysis.change import Change
from handstudio.analysis.measure import Kind, Measure
from handstudio.analysis.sides import SideRatio, percent
from handstudio.analysis.tables import Group, Row, grouped, judged, signed
from handstudio.measure import Measured


@dataclass(frozen=True, slots=True)
class Table:
    """A table: its title, what one has to know, columns, and rows with what stands out in each.

    Attributes:
        marks: Of each row, empty, ``short`` of what is usual or ``changed``.
    """

    title: str
    note: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    marks: tuple[str, ...]


def tables_of(measured: Measured) -> list[Table]:
    """Every measure, and what changed where there is an earlier visit."""
    known = {(change.kind, change.about): change for change in measured.changes}
    sides = {(ratio.kind, ratio.about): ratio for ratio in measured.sides}
    return [_table(group, known, sides) for group in grouped(measured.measures)]


def _table(
    group: Group,
    known: dict[tuple[Kind, str], Change],
    sides: dict[tuple[Kind, str], SideRatio],
) -> Table:
    kinds = _filled(group)
    compared = any(judged(row, known) for row in group.rows)
    normal = any(m.norm is not None for row in group.rows for m in row.cells.values())
    columns = [_("Joint or posture"), *(kind_name(kind) for kind in kinds)]
    columns += [_("Normal")] if normal else []
    columns += [_("Changed by")] if compared else []
    ratios = [_ratios(row, sides) for row in group.rows]
    columns += [_("Of the other hand")] if any(ratios) else []
    rows, marks = [], []
    for row, ratio in zip(group.rows, ratios, strict=True):
        changed = _changed(row, known)
        cells = [row_name(row.about) or "–", *_cells(row, kinds)]
        cells += [_normal(row)] if normal else []
        cells += [changed.words] if compared else []
        cells += [ratio] if any(ratios) else []
        rows.append(tuple(cells))
        marks.append("changed" if changed.beyond else "short" if is_short(row) else "")
    title, note = group_title(group.name), group_note(group.name)
    return Table(title, note, tuple(columns), tuple(rows), tuple(marks))


def _ratios(row: Row, sides: dict[tuple[Kind, str], SideRatio]) -> str:
    """Shares of the other hand's; total active motion with its grade by that."""
    found = [sides[kind, row.about] for kind in row.cells if (kind, row.about) in sides]
    said = [f"{percent(ratio)} {grade_word(ratio.grade)}".strip() for ratio in found]
    return ", ".join(said)


def _filled(group: Group) -> list[Kind]:
    """Columns in which something stands, at least the first."""
    there = [k for k in group.kinds if any(k in row.cells for row in group.rows)]
    return there or list(group.kinds[:1])


def _cells(row: Row, kinds: list[Kind]) -> list[str]:
    return [figure(row.cells.get(kind)) for kind in kinds]


def _normal(row: Row) -> str:
    ends = [row.cells.get("least"), row.cells.get("most")]
    if all(end is not None and end.norm is not None for end in ends):
        return _("{least} to {most}").format(
            least=_signed(_norm(ends[0])), most=_signed(_norm(ends[1]))
        )
    norms = [_norm(measure) for measure in row.cells.values() if measure.norm is not None]
    return ", ".join(_signed(norm) for norm in norms)


def _norm(measure: Measure | None) -> float:
    return 0.0 if measure is None or measure.norm is None else measure.norm


def _signed(value: float) -> str:
    return f"{value:.0f}".replace("-", "−")


SHORT_DEG = 20.0
"""So far from normal a healthy person may be."""


def is_short(row: Row) -> bool:
    """Whether a range is shorter than usual by more than healthy people differ and it may err."""
    span = row.cells.get("range")
    if span is None or span.deviation is None:
        return False
    return span.deviation < -(SHORT_DEG + 2.0 * (span.sd or 0.0))


@dataclass(frozen=True, slots=True)
class _Changed:
    words: str
    beyond: bool


def _changed(row: Row, known: dict[tuple[Kind, str], Change]) -> _Changed:
    found = judged(row, known)
    beyond = [change for change in found if change.verdict in ("more", "less")]
    if beyond:
        said = [f"{kind_name(c.kind).partition(' [')[0]} {signed(c)}{unit_sign(c)}" for c in beyond]
        return _Changed(", ".join(said), beyond=True)
    return _Changed(verdict_words("no detectable change") if found else "", beyond=False)
