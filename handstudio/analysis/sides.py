"""A measure against the same of the other hand: how much of what is usual for this person."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import msgspec
import numpy as np

from handstudio.analysis.finger_scores import tam_grade
from handstudio.analysis.measure import Kind, Measure

_COMPARED: tuple[Kind, ...] = ("range", "tam", "strickland")
_LEAST_DEG = 10.0  # of the other hand's, or percent: a share of less than this says nothing


class SideRatio(msgspec.Struct, frozen=True):
    """A measure as a share of the other hand's.

    Attributes:
        kind, about: Of which measure.
        percent: 100: both alike.
        sd: Its standard uncertainty, both hands erring by themselves; None: it cannot be told.
        grade: Of total active motion by this share (American Society for Surgery of the Hand).
    """

    kind: Kind
    about: str
    percent: float
    sd: float | None
    grade: Literal["", "excellent", "good", "fair", "poor"] = ""


def against_other_side(now: Sequence[Measure], other: Sequence[Measure]) -> list[SideRatio]:
    """Ranges and scores that both hands have."""
    known = {(m.kind, m.about): m for m in other if m.value is not None and m.value > _LEAST_DEG}
    return [
        _ratio(m, known[m.kind, m.about])
        for m in now
        if m.kind in _COMPARED and m.value is not None and (m.kind, m.about) in known
    ]


def percent(ratio: SideRatio) -> str:
    """The share as it is written, with its uncertainty where there is one."""
    sd = "" if ratio.sd is None else f" ± {ratio.sd:.0f}"
    return f"{ratio.percent:.0f}{sd} %"


def _ratio(now: Measure, other: Measure) -> SideRatio:
    assert now.value is not None
    assert other.value is not None
    share, sd = now.value / other.value, None
    if now.sd is not None and other.sd is not None:
        sd = 100.0 * float(np.hypot(now.sd, share * other.sd)) / other.value
    # rounded first: a hand that errs by a tenth of a percent is not less than excellent
    grade = tam_grade(round(share, 2)) if now.kind == "tam" else ""
    return SideRatio(now.kind, now.about, 100.0 * share, sd, grade)
