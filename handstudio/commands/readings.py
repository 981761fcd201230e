"""What a step of a calibration was seen to be, in English words for the shell."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import msgspec

from handstudio.calibration.verdict import Reading, Unit, Verdict, What
from handstudio.shell import print_table


class Words(NamedTuple):
    """How a figure is said.

    Attributes:
        told: What was measured; ``{value}`` is the figure with its unit, ``{about}`` what of.
        about: What of, where the reading does not say.
        remedy: What to do where it falls short of a least.
        too_much: What to do where it goes beyond a most; as the remedy unless given.
    """

    told: str
    about: str
    remedy: str
    too_much: str = ""


_Key: TypeAlias = tuple[What, Unit | None]

_SOUND = "check its plug, then repeat"
_QUIET = "keep still until the step is over"

TABLE: dict[_Key, Words] = {
    ("answering", None): Words("{about} answered {value} of the time", "every sensor", _SOUND),
    ("answering", ""): Words("{about}s with a result: {value}", "sensor", _SOUND),
    ("upright", None): Words(
        "{about} lay off by {value}", "no sensor", "check that it sits on its place, then repeat"
    ),
    ("stillness", None): Words("{about} still moved at {value}", "the hand", _QUIET),
    ("range", None): Words("swung by {value}", "", "swing further"),
    ("second_axis", None): Words("second axis covered {value}", "", "repeat the sideways swing"),
    ("pace", None): Words("swung at {value}", "", "swing faster", "swing more slowly"),
    ("others", None): Words(
        "{about} moved along by {value}", "another joint", "move only the joint that is asked for"
    ),
    ("time", None): Words("lasted {value}", "", "go on for longer"),
    ("turn", None): Words("lifted by {value}", "", "lift the arm further"),
    ("together", None): Words("{about} gave by {value}", "a joint", "keep hand and fingers stiff"),
    ("directions", None): Words(
        "{about} lay still in {value} directions", "it", "lay it down in other directions too"
    ),
    ("residual", None): Words("{about} does not fit by {value}", "it", "repeat this step"),
    ("against", None): Words("{about} has moved by {value}", "it", "calibrate again"),
}
"""Words of every figure, by what it is and its unit; None: any unit."""

RESTED = Words("rested before for {value}", "", "keep still before the swing begins")
"""A time that is that of the rest before."""


def sentence(reading: Reading) -> str:
    """A figure, its limit, and what to do where the limit is not kept."""
    words = _words(reading)
    value, limit = _numbers(reading)
    unit = f" {reading.unit}" if reading.unit and not math.isnan(reading.value) else ""
    told = words.told.format(value=value + unit, about=reading.about or words.about)
    held = f"at least {limit} wanted" if reading.at_least else f"at most {limit} allowed"
    if reading.ok:
        return f"{told}, {held}"
    remedy = words.remedy if reading.at_least else words.too_much or words.remedy
    return f"{told}, {held}: {remedy}"


def sentences(verdict: Verdict) -> list[str]:
    """What is not as it should be; where all is well, the most telling figure."""
    shown = verdict.failing or verdict.readings[:1]
    return [sentence(reading) for reading in shown]


def told(verdicts: Sequence[Verdict]) -> list[dict[str, object]]:
    """Verdicts for a program, with the words."""
    return [
        {
            "step": verdict.step,
            "ok": verdict.ok,
            "readings": [
                msgspec.to_builtins(reading) | {"ok": reading.ok, "words": sentence(reading)}
                for reading in verdict.readings
            ],
        }
        for verdict in verdicts
    ]


def show_verdicts(verdicts: Sequence[Verdict]) -> None:
    """A table of steps, and what was seen of each."""
    rows = []
    for verdict in verdicts:
        first, *others = sentences(verdict) or ["nothing was measured"]
        rows.append([verdict.step, "good" if verdict.ok else "repeat", first])
        rows += [["", "", other] for other in others]
    print_table("Steps", ["step", "", "what was seen"], rows)


def _words(reading: Reading) -> Words:
    if reading.what == "time" and reading.about == "static":
        return RESTED
    return TABLE.get((reading.what, reading.unit)) or TABLE[reading.what, None]


def _numbers(reading: Reading) -> tuple[str, str]:
    """Figure and limit, with as many digits as it takes to tell them apart where one is missed."""
    whole = reading.unit == "" or reading.limit >= 10.0
    for digits in range(0 if whole else 1, 4):
        value, limit = (f"{each:.{digits}f}" for each in (reading.value, reading.limit))
        if reading.ok or value != limit:
            break
    return ("unknown" if math.isnan(reading.value) else value), limit.removesuffix(".0")
