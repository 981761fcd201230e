"""Measures laid out as tables: which kinds stand side by side, and figures as they are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from handstudio.analysis.change import Change
from handstudio.analysis.measure import Kind, Measure

GroupName: TypeAlias = Literal[
    "range", "scores", "opposition", "repetitions", "speed", "tremor", "independence", "posture"
]

GROUPS: dict[GroupName, tuple[Kind, ...]] = {
    "range": ("least", "most", "range"),
    "scores": ("tam", "strickland"),
    "opposition": ("kapandji", "pronation"),
    "repetitions": (
        "cycles",
        "cycle_amplitude",
        "cycle_amplitude_cv",
        "cycle_period",
        "cycle_period_cv",
    ),
    "speed": ("peak_speed", "mean_speed", "sparc", "ldlj"),
    "tremor": ("tremor_amplitude", "tremor_frequency"),
    "independence": ("individuation", "stationarity"),
    "posture": ("time_in_posture",),
}
"""Kinds that share a table, in the order in which they are told."""

_DIGITS = {"deg": 1, "deg/s": 0, "%": 0, "s": 2, "Hz": 1, "": 2}
_WHOLE = ("cycles", "kapandji")
_FINE = {"tremor_amplitude": 3}


@dataclass(frozen=True, slots=True)
class Row:
    """What is known of one angle, finger or posture."""

    about: str
    cells: dict[Kind, Measure]


@dataclass(frozen=True, slots=True)
class Group:
    """A table."""

    name: GroupName
    kinds: tuple[Kind, ...]
    rows: tuple[Row, ...]


def grouped(measures: Sequence[Measure]) -> tuple[Group, ...]:
    """Measures as tables; those without any are left out."""
    out = []
    for name, kinds in GROUPS.items():
        rows: dict[str, dict[Kind, Measure]] = {}
        for measure in measures:
            if measure.kind in kinds:
                rows.setdefault(measure.about, {})[measure.kind] = measure
        if rows:
            out.append(
                Group(name, kinds, tuple(Row(about, cells) for about, cells in rows.items()))
            )
    return tuple(out)


def written(measure: Measure) -> str:
    """Value and uncertainty, without the unit; a dash where there is none."""
    if measure.value is None:
        return "–"
    digits = digits_of(measure)
    value = f"{round(measure.value, digits) + 0.0:.{digits}f}".replace("-", "−")  # no minus zero
    if measure.sd is not None:
        return f"{value} ± {measure.sd:.{digits}f}"
    if measure.low is not None and measure.high is not None:
        return f"{value} ({measure.low:.{digits}f}–{measure.high:.{digits}f})"
    return value


def digits_of(measure: Measure) -> int:
    """How many decimals of a measure mean something."""
    if measure.kind in _WHOLE:
        return 0
    return _FINE.get(measure.kind, _DIGITS[measure.unit])


def signed(change: Change) -> str:
    """A difference with its sign."""
    fine = _FINE.get(change.kind, _DIGITS[change.unit])
    return f"{change.difference:+.{0 if change.kind in _WHOLE else fine}f}".replace("-", "−")


def judged(row: Row, changes: dict[tuple[Kind, str], Change]) -> list[Change]:
    """The changes of a row that can be judged."""
    found = [changes.get((kind, row.about)) for kind in row.cells]
    return [change for change in found if change is not None and change.verdict != "not judged"]
