"""What changed between two visits, and whether that is more than measuring twice would give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import msgspec
import numpy as np

from handstudio.analysis.measure import Kind, Measure, Unit

Verdict: TypeAlias = Literal["more", "less", "no detectable change", "not judged"]


class Change(msgspec.Struct, frozen=True):
    """A measure now and at an earlier visit, in its unit.

    Attributes:
        kind, about: Of which measure.
        before, now: Both values.
        detectable: The smallest change that is none by mere error; None: it is not known.
        verdict: ``not judged`` where that is not known.
    """

    kind: Kind
    about: str
    unit: Unit
    before: float
    now: float
    detectable: float | None
    verdict: Verdict

    @property
    def difference(self) -> float:
        """By how much it is more now."""
        return self.now - self.before


def changes(before: Sequence[Measure], now: Sequence[Measure]) -> list[Change]:
    """Changes of all measures that both visits have."""
    known = {(m.kind, m.about): m for m in before if m.value is not None}
    return [
        _change(known[m.kind, m.about], m)
        for m in now
        if m.value is not None and (m.kind, m.about) in known
    ]


def _change(before: Measure, now: Measure) -> Change:
    assert before.value is not None
    assert now.value is not None
    limit = _detectable(before, now)
    difference = now.value - before.value
    verdict: Verdict = "not judged"
    if limit is not None:
        beyond: Verdict = "more" if difference > 0.0 else "less"
        verdict = beyond if abs(difference) > limit else "no detectable change"
    return Change(now.kind, now.about, now.unit, before.value, now.value, limit, verdict)


def _detectable(before: Measure, now: Measure) -> float | None:
    """Of two measurements of different quality: root of the mean of squares of both limits."""
    if before.kind == "kapandji":
        return 1.0  # stages: one is within what a touch is uncertain by
    if before.detectable is not None and now.detectable is not None:
        return float(np.sqrt(0.5 * (before.detectable**2 + now.detectable**2)))
    return None
