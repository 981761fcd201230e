"""How accurate the whole path is on virtual people, against the truth that it cannot see.

    python -m benchmarks.accuracy --json FILE

People nothing was chosen on do five minutes of work with a moving elbow, wearing sensors with the
errors that real ones have. What comes out of the pipeline is held against what was true. Then
every imperfection alone and every one left out: what costs how much. Then the thesis's
own experiment, in its own metric.
"""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np
import tyro

from benchmarks import thesis
from benchmarks.accuracy_report import picture, show
from benchmarks.trials import Calibration, Figures, Trial, run
from handstudio.shell import progress
from handstudio.simulation.imperfections.strengths import (
    GROUPS,
    IDEAL,
    NAMES,
    PRESETS,
    Imperfections,
    parse,
    tell,
)
from handstudio.simulation.subject import DEVELOPMENT, REPORTING

WORK = (
    "quick_start+joint_by_joint&elbow_moving:all 10+3*open_close&elbow_moving:all 30"
    "+scissors&elbow_moving:all 15+pouring+typing+tissue+ball_throw+grasps"
    "+writing:hand+pouring+typing&elbow_moving:all 15+joint_by_joint&elbow_moving:all 10"
    "+spinning_top"
)
"""Five minutes of work, most of it with the elbow moving."""

SHORT = "quick_start+joint_by_joint&elbow_moving:all 10+open_close+scissors&elbow_moving:all 15"
"""Forty seconds, for the error budget."""

ALONE = tuple(n for n in NAMES if n not in ("lost_packets", "damaged_packets"))
"""Imperfections tried one by one; what the line loses does not reach a trial, which has none."""

T = TypeVar("T")
R = TypeVar("R")


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 6,
    motions: str = WORK,
    imperfections: str = "typical",
    soft_tissue: bool = True,
    filter: str = "tree",
    smooth: bool = False,
    compass: bool = True,
    calibration: Calibration = "truth",
    development: bool = False,
    budget: bool = True,
    thesis_experiment: bool = True,
    picture_file: Annotated[Path | None, tyro.conf.arg(name="picture")] = None,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        motions: What they do (handstudio motions).
        imperfections: ideal, plain, typical, harsh, and changes to it.
        soft_tissue: Let sensors move on skin.
        filter: Which filter follows.
        smooth: Let it look ahead, as `process --smooth` does.
        compass: Read magnetometers; otherwise headings come from the opening turn alone.
        calibration: What the pipeline is told of hand and mounting: truth, or nothing but the
            hand's length (nominal), or what a course before found (own).
        development: People and seeds that parameters may be chosen on, not those reported.
        budget: Try every imperfection alone, and all without it.
        thesis_experiment: Repeat the thesis's experiment.
        picture_file: Where to draw the figures (PNG or SVG).
    """
    strengths = parse(imperfections if soft_tissue else f"{imperfections},-soft_tissue")
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    seeds = 0 if development else 10_000  # kept apart as the people are
    trials = [
        Trial(
            n,
            motions,
            strengths,
            seeds + n,
            filter,
            calibration,
            smooth=smooth,
            compass=compass,
        )
        for n in people
    ]
    print(f"calibration: {calibration}; filter: {filter}; imperfections: {tell(strengths)}")
    found: dict[str, Any] = {
        "calibration": calibration,
        "filter": filter,
        "imperfections": tell(strengths),
        "motions": motions,
        "subjects": list(people),
        "development": development,
    }
    figures = _tried("five minutes of work", run, trials)
    found |= summed(figures) | {"thesis": thesis.FIGURES}
    found["trials"] = [msgspec.to_builtins(figure) for figure in figures]
    if budget:
        found["budget"] = _budget(trials[0], people[:2])
    if thesis_experiment:
        found["thesis_experiment"] = _thesis(people[:4], strengths)
    show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")
    if picture_file is not None:
        picture(found, picture_file)


def summed(figures: Sequence[Figures]) -> dict[str, Any]:
    """Means over people of each figure; worst: of the means of segments or angles."""
    segments = _means([figure.segments for figure in figures])
    # a finger's deviation is its abduction again, under the sign of another school
    again = "_mcp_deviation_ulnar"
    known = [{k: v for k, v in f.angles.items() if not k.endswith(again)} for f in figures]
    angles = _means(known)
    sensors = {
        name: dict(
            zip(
                ("total", "heading", "inclination"),
                np.mean([figure.sensors[name] for figure in figures], axis=0).tolist(),
                strict=True,
            )
        )
        for name in figures[0].sensors
    }
    return {
        "orientation_deg": {
            "mean": float(np.mean(list(segments.values()))),
            "worst_segment": max(segments.values()),
            "common_heading": float(np.mean([abs(f.heading_offset_deg) for f in figures])),
            "segments": segments,
            "sensors": sensors,
            **_functional(figures),
        },
        "joint_angle_deg": {
            "mean": float(np.mean(list(angles.values()))),
            "worst_joint": max(angles.values()),
            "angles": angles,
        },
        "fingertip_mm": {
            "elbow": float(np.mean([f.tips_elbow for f in figures])),
            "hand": float(np.mean([f.tips_hand for f in figures])),
        },
        "sensor_mm": {"elbow": _means([figure.places_elbow for figure in figures])},
        "joint_centre_mm": None,  # of a calibration: benchmarks.calibration
        "link_length_mm": None,
        "heading_sd_deg": float(np.mean([f.heading_sd_deg for f in figures])),
        **_inside(figures),
    }


def _inside(figures: Sequence[Figures]) -> dict[str, Any]:
    """Shares of errors within two standard deviations; nothing of a filter that tells none."""
    told = [figure.inside for figure in figures if figure.inside is not None]
    if not told:
        return {}
    own, relative = np.mean(told, axis=0).tolist()
    return {"inside_two_sd": {"own": own, "relative": relative}}


def _functional(figures: Sequence[Figures]) -> dict[str, Any]:
    """Of segments, against frames of the calibration's own definition; nothing without one."""
    if not figures[0].functional:
        return {}
    segments = _means([figure.functional for figure in figures])
    apart = _means([figure.definition for figure in figures])
    return {
        "functional": {
            "mean": float(np.mean(list(segments.values()))),
            "worst_segment": max(segments.values()),
            "segments": segments,
        },
        "definition": {"mean": float(np.mean(list(apart.values()))), "segments": apart},
    }


def _budget(like: Trial, people: Sequence[int]) -> dict[str, Any]:
    """What every imperfection costs: alone, and left out of all the others."""
    base = like.imperfections
    cases: dict[str, Imperfections] = {"ideal": IDEAL, "all": base}
    for name in ALONE:
        strength = getattr(base, name) or 1.0
        cases[f"only {name}"] = msgspec.structs.replace(IDEAL, **{name: strength})
        if getattr(base, name):
            cases[f"without {name}"] = msgspec.structs.replace(base, **{name: 0.0})
    for group, members in GROUPS.items():
        cases[f"without {group}"] = msgspec.structs.replace(base, **dict.fromkeys(members, 0.0))
    for preset in ("plain", "harsh"):
        cases[preset] = PRESETS[preset]
    briefly = replace(like, motion=SHORT)
    asked = [
        (case, replace(briefly, person=n, seed=like.seed - like.person + n, imperfections=i))
        for case, i in cases.items()
        for n in people
    ]
    figures = _tried("error budget", run, [trial for _, trial in asked])
    found: dict[str, Any] = {}
    for case in cases:
        mine = [f for (name, _), f in zip(asked, figures, strict=True) if name == case]
        whole = summed(mine)
        found[case] = {
            "orientation_deg": whole["orientation_deg"]["mean"],
            "joint_angle_deg": whole["joint_angle_deg"]["mean"],
            "fingertip_mm": whole["fingertip_mm"]["hand"],
        }
    return found


def _thesis(people: Sequence[int], strengths: Imperfections) -> dict[str, Any]:
    asked = thesis.takes(people, strengths)
    figures = _tried("the thesis's experiment", thesis.run, asked)
    found: dict[str, Any] = {}
    for setting, published in thesis.PUBLISHED.items():
        ours = {
            (name, along): np.mean(
                [
                    figure
                    for one, figure in zip(asked, figures, strict=True)
                    if one.setting == setting
                    and (one.trial.filter, one.trial.x_along_bone) == (name, along)
                ],
                axis=0,
            ).tolist()
            for name in thesis.FILTERS
            for along in (False, True)
        }
        found[setting] = {
            "published": {k: list(v) for k, v in published.items()},
            "x along the flexion axis": {k: v for (k, along), v in ours.items() if not along},
            "x along the bone": {k: v for (k, along), v in ours.items() if along},
        }
    return {"sensors": list(thesis.SENSORS), "settings": found}


def _tried(words: str, what: Callable[[T], R], tasks: Sequence[T]) -> list[R]:
    """Results of all tasks, in their order, on all cores."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # small systems, and a process a core already
    with (
        multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool,
        progress(words) as share,
    ):
        return list(_counted(pool.imap(what, tasks), len(tasks), share))


def _counted(results: Iterable[R], count: int, share: Callable[[float], None]) -> Iterator[R]:
    for number, result in enumerate(results, start=1):
        share(number / count)
        yield result


def _means(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


if __name__ == "__main__":
    tyro.cli(main)
