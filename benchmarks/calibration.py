"""How well a hand is calibrated, on virtual people whose truth the calibration cannot see.

    python -m benchmarks.calibration --json FILE

People nothing was chosen on do the course of a calibration, well. Their glove's sensors were
calibrated on another day by a tumble. Centres, links and axes are held against the truth; heading,
sensors, sloppy courses and the real rig have benchmarks of their own, which this one runs too.
"""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from benchmarks import heading, rig, sensor_errors, sloppy
from benchmarks.calibrated import Asked, Errors, run
from benchmarks.checked import figures
from handstudio.calibration.checking import LIMIT_DEG, LIMIT_UNCALIBRATED_DEG
from handstudio.hand.skeleton import HandType
from handstudio.recording.material import RECORDINGS
from handstudio.shell import out, print_table, progress
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.subject import DEVELOPMENT, REPORTING

SLOPPY_PEOPLE = 3
"""How many of the people do every step well and sloppily; each takes a minute."""

BUDGET = (
    "ideal",
    "typical,-soft_tissue",
    "typical,-slide",
    "typical,-rock",
    "typical,-wobble",
    "typical,-white_noise",
    "typical,-skew",
    "typical,-board_slip",
)
"""What the error is made of: what is left of it without one thing."""


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 6,
    imperfections: str = "typical",
    development: bool = False,
    budget: bool = True,
    others: bool = True,
    check: bool = True,
    sensors_first: bool = True,
    hand_type: HandType = 3,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        imperfections: ideal, plain, typical, harsh, and changes to it.
        development: People and seeds that parameters may be chosen on, not those reported.
        budget: Try without one imperfection after the other, and without sensor calibration.
        others: Run the benchmarks of headings, sensors, sloppy courses and the real rig too.
        check: See whether a check lets each calibration pass, and notices boards that slipped.
        sensors_first: Calibrate the sensors before.
        hand_type: How the palm is divided.
    """
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    seeds = 0 if development else 10_000
    asked = [
        Asked(n, seeds + n, parse(imperfections), sensors_first, check=check, hand_type=hand_type)
        for n in people
    ]
    found: dict[str, Any] = {
        "imperfections": imperfections,
        "subjects": list(people),
        "development": development,
        "sensors_first": sensors_first,
        "hand_type": hand_type,
    }
    errors = _tried("calibrations", asked)
    found |= summed(errors)
    if check:
        limit = LIMIT_DEG if sensors_first else LIMIT_UNCALIBRATED_DEG
        found["check"] = figures([one.checks for one in errors if one.checks], limit)
    found["people"] = [msgspec.to_builtins(one) for one in errors]
    if budget:
        found["budget"] = _budget([replace(one, check=False) for one in asked[:2]])
    if others:
        found |= _others(people, development)
    _show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def summed(errors: Sequence[Errors]) -> dict[str, Any]:
    """Figures over all people and joints; the ulnar CMC, which hardly moves alone, apart."""
    ulnar = "ulnar_cmc"
    centre = [v for e in errors for k, v in e.centre_mm.items() if k != ulnar]
    links = np.array([v for e in errors for k, v in e.link_mm.items() if _is_length(k)])
    axes = [v for e in errors for v in e.axis_deg.values()]
    inside = np.abs(links[:, 0]) <= 1.96 * links[:, 1]
    by_joint = {
        name: float(np.median([e.centre_mm[name] for e in errors])) for name in errors[0].centre_mm
    }
    return {
        "joint_centre_mm": {
            "median": float(np.median(centre)),
            "worst": float(np.max(centre)),
            "p90": float(np.percentile(centre, 90)),
            "along_hinge_median": float(
                np.median([abs(v) for e in errors for v in e.along_mm.values()])
            ),
            "ulnar_cmc_median": by_joint.get(ulnar),
            "by_joint": by_joint,
        },
        "link_mm": {
            "median": float(np.median(np.abs(links[:, 0]))),
            "worst": float(np.max(np.abs(links[:, 0]))),
            "in_band_pct": float(100.0 * np.mean(inside)),
            "sd_median": float(np.median(links[:, 1])),
        },
        "axis_deg": {
            "median": float(np.median(axes)),
            "worst": float(np.max(axes)),
            "against_frame_median": float(
                np.median([v for e in errors for v in e.frame_deg.values()])
            ),
        },
    }


def _is_length(joint: str) -> bool:
    """Whether the link to this joint is a length that people know: from joint to next joint."""
    return joint not in ("ulnar_cmc", "thumb_cmc") and not joint.startswith(("ring_m", "little_m"))


def _budget(asked: Sequence[Asked]) -> dict[str, Any]:
    cases = {words: [replace(a, imperfections=parse(words)) for a in asked] for words in BUDGET}
    cases["all"] = list(asked)
    cases["all, sensors not calibrated"] = [replace(a, sensors_first=False) for a in asked]
    errors = iter(_tried("error budget", [a for case in cases.values() for a in case]))
    return {name: summed([next(errors) for _ in case]) for name, case in cases.items()}


def _others(people: Sequence[int], development: bool) -> dict[str, Any]:
    aligned = heading.measured(people, development)
    sensors = sensor_errors.measured(people, development)
    judged = sloppy.measured(people[:SLOPPY_PEOPLE], development)
    found: dict[str, Any] = {
        "heading_sd_deg": {name: case["ours"] for name, case in aligned["cases"].items()},
        "gyro_scale_pct": sensors["after"]["gyro_scale_pct"],
        "sloppy": {
            "caught_pct": judged["caught_pct"],
            "false_alarm_pct": judged["false_alarm_pct"],
        },
        "lever_arm_scatter_mm": None,
        "others": {"heading": aligned, "sensors": sensors, "sloppy": judged},
    }
    folder = os.environ.get(RECORDINGS)
    if folder is not None and (Path(folder) / "dfjimu").is_dir():
        found["lever_arm_scatter_mm"] = rig.measured(Path(folder) / "dfjimu")[
            "lever_arm_scatter_mm"
        ]
    return found


def _tried(words: str, asked: Sequence[Asked]) -> list[Errors]:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # a process a core already
    results = []
    with (
        multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool,
        progress(words) as share,
    ):
        for count, one in enumerate(pool.imap(run, asked), start=1):
            results.append(one)
            share(count / len(asked))
    return results


def _show(found: dict[str, Any]) -> None:
    centre, link, axis = (found[k] for k in ("joint_centre_mm", "link_mm", "axis_deg"))
    rows = [
        ["joint centre [mm]", f"{centre['median']:.2f}", f"{centre['worst']:.2f}", "1, 3"],
        ["link length [mm]", f"{link['median']:.2f}", f"{link['worst']:.2f}", "0.7, 1.5"],
        ["axis [deg]", f"{axis['median']:.2f}", f"{axis['worst']:.2f}", "0.7, 2"],
    ]
    print_table("Calibrated hands", ["", "median", "worst", "wanted"], rows)
    out.print(f"lengths inside their error bars: {link['in_band_pct']:.0f} % (95 wanted)")
    by_joint = centre["by_joint"].items()
    print_table("Centres, median [mm]", ["joint", ""], [[k, f"{v:.2f}"] for k, v in by_joint])
    if "budget" in found:
        rows = [
            [
                name,
                f"{case['joint_centre_mm']['median']:.2f}",
                f"{case['joint_centre_mm']['worst']:.2f}",
                f"{case['link_mm']['median']:.2f}",
                f"{case['axis_deg']['median']:.2f}",
            ]
            for name, case in found["budget"].items()
        ]
        print_table("Error budget, two people", ["", "centre", "worst", "link", "axis"], rows)
    if "check" in found:
        out.print(f"check: {found['check']}")
    for key in ("heading_sd_deg", "gyro_scale_pct", "sloppy", "lever_arm_scatter_mm"):
        if key in found:
            out.print(f"{key}: {found[key]}")


if __name__ == "__main__":
    tyro.cli(main)
