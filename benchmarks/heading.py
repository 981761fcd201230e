"""How well headings agree over sensors, on virtual people: compasses, the thesis's way, ours.

    python -m benchmarks.heading --json FILE

People nothing was chosen on lift the arm, the hand stiff, and lay it back, wearing sensors with
the errors that real ones have. The figure is the scatter: the standard deviation over sensors of
the error of the heading in the rest before the turn; what all share does not count. Then every
imperfection alone and every one left out: what costs how much.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from benchmarks.trials import RATE_HZ, performance
from handstudio.analysis.hand_error import heading_scatter
from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.heading import align, at_peak
from handstudio.calibration.heading_fit import CALIBRATED, UNCALIBRATED, Tolerances
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import ImuSamples
from handstudio.shell import progress
from handstudio.simulation.imperfections.strengths import IDEAL, NAMES, Imperfections, parse
from handstudio.simulation.subject import DEVELOPMENT, REPORTING, subject
from handstudio.simulation.worn import begin, sense, wear

THESIS_DEG = {"compass": 4.48, "thesis": 0.90}
"""Its table 4.2: twenty sensors on one plate."""

CASES: dict[str, tuple[str, Tolerances]] = {
    "uncalibrated": ("typical", UNCALIBRATED),
    "calibrated": ("typical,scale=0.2,misalignment=0.3", CALIBRATED),
    "ideal_scale": ("typical,scale=0,misalignment=0", CALIBRATED),
    "uncalibrated_stiff_skin": ("typical,-soft_tissue", UNCALIBRATED),
    "harsh": ("harsh,dying_sensor=0", UNCALIBRATED),
}
"""What the sensors are like, and what the alignment is told of it.

Calibrated: 0.2 % are left of scales and cross axes.
"""

MAIN = "uncalibrated"
_UNTRIED = ("lost_packets", "damaged_packets", "dying_sensor")  # they do not reach a quick start
_BUDGET_PEOPLE = 4


class Figures(msgspec.Struct, frozen=True):
    """One person's scatters [deg].

    Attributes:
        compass, thesis, ours: Of the headings.
        expected: Of ours, as its own standard deviations have it.
        ok: Whether the verdict was good.
        outlying: Sensors taken to be outlying; all are sound.
    """

    compass: float
    thesis: float
    ours: float
    expected: float
    ok: bool
    outlying: int


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 20,
    development: bool = False,
    budget: bool = True,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        development: People and seeds that parameters may be chosen on, not those reported.
        budget: Try every imperfection alone, and all without it.
    """
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    found = measured(people, development)
    if budget:
        found["budget"] = error_budget(people[:_BUDGET_PEOPLE], development)
    _show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def measured(people: Sequence[int], development: bool) -> dict[str, Any]:
    """Scatter of headings [deg] for every kind of sensors: means over people, and each of them."""
    found: dict[str, Any] = {
        "motion": "quick_start",
        "rate_hz": RATE_HZ,
        "subjects": list(people),
        "development": development,
        "thesis_deg": THESIS_DEG,
        "cases": {},
    }
    with progress("headings") as share:
        for k, (name, (words, tolerances)) in enumerate(CASES.items()):
            share(k / len(CASES))
            figures = _tried(people, development, parse(words), tolerances)
            found["cases"][name] = {"imperfections": words} | _summed(figures)
    return found


def error_budget(people: Sequence[int], development: bool) -> dict[str, Any]:
    """Scatter [deg] with every imperfection alone, and with all but it."""
    words, tolerances = CASES[MAIN]
    every = parse(words)
    cases: dict[str, Imperfections] = {"all": every}
    for name in NAMES:
        strength = getattr(every, name)
        if name in _UNTRIED or not strength:
            continue
        cases[f"only {name}"] = msgspec.structs.replace(IDEAL, **{name: strength})
        cases[f"without {name}"] = msgspec.structs.replace(every, **{name: 0.0})
    found: dict[str, Any] = {}
    with progress("error budget") as share:
        for k, (case, imperfections) in enumerate(cases.items()):
            share(k / len(cases))
            whole = _summed(_tried(people, development, imperfections, tolerances))
            found[case] = {way: whole[way] for way in ("compass", "thesis", "ours")}
    return found


def _tried(
    people: Sequence[int], development: bool, what: Imperfections, tolerances: Tolerances
) -> list[Figures]:
    seeds = 0 if development else 10_000  # kept apart as the people are
    return [run(n, seeds + n, what, tolerances) for n in people]


def run(person: int, seed: int, what: Imperfections, tolerances: Tolerances) -> Figures:
    """Let a person do the quick start, and hold the headings of the rest against what was true."""
    someone, layout = subject(person), glove()
    performed = performance(someone, "quick_start", seed)
    worn = wear(someone, layout, what, seed)
    time_us = np.arange(round(performed.duration_s * RATE_HZ)) * (1_000_000 // RATE_HZ)
    sensed, _ = sense(worn, begin(worn), performed, time_us, RATE_HZ)
    ends = [round(span.end_s * RATE_HZ) for span in performed.spans]
    samples = sensed.samples
    before, turning, after = samples[: ends[0]], samples[ends[0] : ends[1]], samples[ends[1] :]
    q_world_sensor = resting(before)
    true = sensed.truth.q_world_sensor[: ends[0]].mean(axis=0)

    def scatter(psi_cor: Array) -> float:
        turned = so3.multiply(so3.about_z(psi_cor), q_world_sensor)
        return float(np.rad2deg(heading_scatter(true[None], turned[None])))

    none = np.zeros(len(layout.names))
    try:
        found = align(before, turning, after, layout.names, tolerances=tolerances)
    except CalibrationError:
        return Figures(scatter(none), np.nan, np.nan, np.nan, False, 0)
    return Figures(
        compass=scatter(none),
        thesis=scatter(at_peak(before, turning)[0]),
        ours=scatter(np.array(found.psi_cor)),
        expected=float(np.rad2deg(np.sqrt(np.mean(np.square(found.sd))))),
        ok=found.verdict.ok,
        outlying=sum(found.outlying),
    )


def resting(rest: ImuSamples) -> Array:
    """Attitudes of a rest from means of its accelerometers and compasses."""
    fresh = (rest.fresh & rest.valid)[..., None]
    mag = np.where(fresh, rest.mag, 0.0).sum(axis=0) / np.maximum(fresh.sum(axis=0), 1)
    return attitude(rest.acc.mean(axis=0), mag)


def _summed(figures: Sequence[Figures]) -> dict[str, Any]:
    ways = ("compass", "thesis", "ours", "expected")
    return {
        **{way: float(np.mean([getattr(f, way) for f in figures])) for way in ways},
        "ours_worst": max(f.ours for f in figures),
        "good_verdicts": sum(f.ok for f in figures),
        "outlying": sum(f.outlying for f in figures),
        "people": [msgspec.to_builtins(f) for f in figures],
    }


def _show(found: dict[str, Any]) -> None:
    print("scatter of headings over sensors, SD [deg]; mean over people (thesis: 4.48 to 0.90)")
    print(f"{'':28}{'compass':>9}{'thesis':>9}{'ours':>9}{'worst':>9}{'expected':>9}")
    for name, case in found["cases"].items():
        row = (case[k] for k in ("compass", "thesis", "ours", "ours_worst", "expected"))
        print(f"{name:28}" + "".join(f"{value:9.3f}" for value in row))
    for name, case in found.get("budget", {}).items():
        print(f"{name:28}" + "".join(f"{value:9.3f}" for value in case.values()))


if __name__ == "__main__":
    tyro.cli(main)
