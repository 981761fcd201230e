"""Whether a calibration that is done sloppily is noticed, and one done well is let pass.

    python -m benchmarks.sloppy --json FILE

Virtual people do every step of a course well, sloppily, and in each manner by itself. What
`observe` says of the signals alone is held against how it was done. The truth is looked at
afterwards: which reasons would be right, and whether what was missed hardly differs.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from benchmarks.trials import RATE_HZ
from handstudio.arrays import Array
from handstudio.calibration.course import FLAT, REST, SWINGS, TURN, Step
from handstudio.calibration.verdict import Reading, Verdict, What
from handstudio.calibration.watching import observe
from handstudio.hand.skeleton import JOINTS
from handstudio.layout import glove
from handstudio.samples import ImuSamples
from handstudio.shell import out, progress
from handstudio.simulation.imperfections.strengths import PRESETS
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import DEVELOPMENT, REPORTING, Subject, subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.worn import Worn, begin, sense, wear

STEPS = (REST, TURN, FLAT, *SWINGS)
MANNERS = ("slow", "small", "wrong_joint", "restless")

_REASON: dict[What, str] = {
    "pace": "slow",
    "range": "small",
    "second_axis": "small",
    "turn": "small",
    "others": "wrong_joint",
    "together": "wrong_joint",
    "stillness": "restless",
}
"""Which manner a reading that fails tells of."""

_HARDLY = {"slow": 0.2, "small": 0.25, "wrong_joint": 0.15, "restless": 0.5}
"""What is no more than a good performance may differ by: share longer, share less far, share of a
movement that another joint makes along, and deg/s at rest."""


class Judged(msgspec.Struct, frozen=True):
    """A performance, how it was and what was said of it.

    Attributes:
        person: Who.
        step: What was asked.
        manner: How it was done: "good", "sloppy" or one of `MANNERS`.
        failing: What was not as it should be, the most telling first.
        faults: What was wrong in truth, as `_HARDLY` counts.
        joint: Which joint moved along.
    """

    person: int
    step: str
    manner: str
    failing: tuple[Reading, ...]
    faults: dict[str, float]
    joint: str

    @property
    def hardly(self) -> bool:
        """Whether in truth it hardly differs from a good performance."""
        return all(size <= _HARDLY[fault] for fault, size in self.faults.items())

    @property
    def right(self) -> bool:
        """Whether the first reason given is one of those it was done badly for."""
        if not self.failing:
            return False
        first = self.failing[0]
        fault = _REASON.get(first.what, "")
        there = self.faults.get(fault, 0.0) > 0.2 * _HARDLY.get(fault, 0.0)
        return there and (fault != "wrong_joint" or first.about == self.joint)


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 8,
    development: bool = False,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        development: People and seeds that limits may be chosen on, not those reported.
    """
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    found = measured(people, development)
    _show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def measured(people: Sequence[int], development: bool) -> dict[str, Any]:
    """Figures of these people: with typical imperfections, and with plain ones under "plain".

    Single manners are tried with typical imperfections, on every third person.
    """
    typical, plain = list[Judged](), list[Judged]()
    with progress("sloppy and good") as share:
        for number, person in enumerate(people):
            manners = MANNERS if number % 3 == 0 else ()
            typical += judged(person, "typical", development, ("good", "sloppy", *manners))
            plain += judged(person, "plain", development, ("good", "sloppy"))
            share((number + 1) / len(people))
    about = {"subjects": list(people), "development": development}
    return about | _figures(typical) | {"plain": _figures(plain)}


def judged(
    person: int, imperfections: str, development: bool, manners: Sequence[str]
) -> Iterator[Judged]:
    """Every step in these manners by one person; a manner that changes nothing is left out."""
    seed = person if development else 10_000 + person  # as in benchmarks.accuracy
    someone = subject(person)
    worn = wear(someone, glove("right"), PRESETS[imperfections], seed)
    for step in STEPS:
        good = _performed(someone, step.perform, seed)
        for manner in manners:
            text = step.perform if manner == "good" else f"{step.perform}~{manner}"
            done = _performed(someone, text, seed)
            faults, joint = _truth(good, done)
            if manner in MANNERS and not _does_otherwise(good, done):
                continue
            failing = _verdict(step, worn, done).failing
            yield Judged(person, step.name, manner, failing, faults, joint)


def signals(worn: Worn, done: Trajectory, rate_hz: int = RATE_HZ) -> dict[str, ImuSamples]:
    """What the sensors read, by the labels of the performance."""
    count = round(done.duration_s * rate_hz)
    time_us = np.arange(count) * (1_000_000 // rate_hz)
    samples = sense(worn, begin(worn), done, time_us, rate_hz)[0].samples
    return {
        span.name: samples[round(span.start_s * rate_hz) : round(span.end_s * rate_hz)]
        for span in done.spans
    }


def _performed(someone: Subject, text: str, seed: int) -> Trajectory:
    return perform(text, Actor(someone, seed))


def _verdict(step: Step, worn: Worn, done: Trajectory) -> Verdict:
    parts = signals(worn, done)
    rest = parts["static"] if step.rest_s else None
    return observe(step, rest, parts[step.name], worn.layout)


def _does_otherwise(good: Trajectory, done: Trajectory) -> bool:
    at = np.linspace(0.0, 1.0, 400)
    one, other = (part.posture(at * part.duration_s) for part in (good, done))
    moves = float(np.ptp(one, axis=0).max()) > 0.0
    return moves or not np.allclose(one, other, atol=1e-6)


def _truth(good: Trajectory, done: Trajectory) -> tuple[dict[str, float], str]:
    """How far a performance is from the good one of the same seed, and which joint moved along."""
    went, goes = _ways(good), _ways(done)
    main = int(np.argmax(went))
    faults = {
        "slow": max(0.0, done.duration_s / good.duration_s - 1.0),
        "restless": max(0.0, _unrest_deg_s(done) - _unrest_deg_s(good)),
    }
    if went[main] < 1e-6:
        return faults, ""
    along = goes / goes[main] - went / went[main]
    wrong = int(np.argmax(along))
    faults["small"] = max(0.0, 1.0 - float(goes[main] / went[main]))
    faults["wrong_joint"] = max(0.0, float(along[wrong]))
    return faults, JOINTS[wrong // 3].name


def _ways(part: Trajectory) -> Array:
    """How far every turn goes [rad]."""
    turns = part.posture(np.arange(0.0, part.duration_s, 0.02))[:, :-3]
    low, high = np.percentile(turns, (2.0, 98.0), axis=0)
    return np.asarray(high - low)


def _unrest_deg_s(part: Trajectory) -> float:
    """How fast joints tremble where they should rest; where all move, those that should not."""
    still = [span for span in part.spans if span.name in ("static", "flat_hand")]
    start, end = (still[0].start_s, still[0].end_s) if still else (0.0, part.duration_s)
    rates = part.derivatives(np.arange(start, end, 0.01))[1][:, :-3:3]
    return float(np.rad2deg(np.median(np.sqrt(np.mean(rates**2, axis=0)))))


def _figures(all_: Sequence[Judged]) -> dict[str, Any]:
    good = [one for one in all_ if one.manner == "good"]
    alarms = [one for one in good if one.failing]
    by_manner = {
        manner: _of([one for one in all_ if one.manner == manner])
        for manner in ("sloppy", *MANNERS)
        if any(one.manner == manner for one in all_)
    }
    sloppy = by_manner["sloppy"]
    return {
        "caught_pct": sloppy["caught_pct"],
        "false_alarm_pct": 100.0 * len(alarms) / len(good),
        "right_reason_pct": sloppy["right_reason_pct"],
        "good": len(good),
        "false_alarms": [_told(one) for one in alarms],
        "by_manner": by_manner,
    }


def _of(done: Sequence[Judged]) -> dict[str, Any]:
    caught = [one for one in done if one.failing]
    missed = [one for one in done if not one.failing]
    right = [one for one in caught if one.right]
    return {
        "done": len(done),
        "caught_pct": 100.0 * len(caught) / len(done),
        "right_reason_pct": 100.0 * len(right) / max(1, len(caught)),
        "missed": [_told(one) for one in missed],
        "missed_that_hardly_differ": sum(one.hardly for one in missed),
        "wrong_reason": [_told(one) for one in caught if not one.right],
    }


def _told(one: Judged) -> str:
    said = ", ".join(
        f"{r.what} {r.about} {r.value:.3g} ({r.limit:.3g} {r.unit})" for r in one.failing
    )
    truth = ", ".join(f"{fault} {size:.2f}" for fault, size in one.faults.items() if size > 0.01)
    return f"{one.person} {one.step}: {said or 'nothing'}; in truth {truth or 'good'} {one.joint}"


def _show(found: dict[str, Any]) -> None:
    for name, figures in (("typical", found), ("plain", found["plain"])):
        out.print(
            f"{name}: caught {figures['caught_pct']:.1f} %, "
            f"false alarms {figures['false_alarm_pct']:.1f} % of {figures['good']}"
        )
        for manner, of in figures["by_manner"].items():
            out.print(
                f"  {manner:12} {of['done']:4} done, {of['caught_pct']:5.1f} % caught, "
                f"{of['right_reason_pct']:5.1f} % for the right reason, "
                f"{len(of['missed'])} missed, {of['missed_that_hardly_differ']} hardly differ"
            )
        for line in figures["false_alarms"]:
            out.print(f"  false alarm: {line}")
        for of in figures["by_manner"].values():
            for line in of["missed"]:
                out.print(f"  missed: {line}")


if __name__ == "__main__":
    tyro.cli(main)
