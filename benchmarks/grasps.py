"""How well grasps are recognised on virtual people, and how large what they hold is told to be.

    python -m benchmarks.grasps --json FILE

People nothing was chosen on hold things of usual sizes in every class of grasp, wearing sensors
with the errors that real ones have, after a calibration of their own. What `handstudio grasps`
makes of it is held against what they did. A hand that only pushes is no grasp here: it is open.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.trials import Calibration, Followed, Trial, follow
from handstudio.analysis.grasp_prototypes import ANGLES, OPEN, PROTOTYPES
from handstudio.analysis.take_grasps import TakenGrasp, grasps_in
from handstudio.hand.angles import hand_angles, joint_angles
from handstudio.hand_fit import fit_of
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.shell import out, progress
from handstudio.simulation.graspable import Cylinder, HeldObject, Sphere
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.grasp_classes import GRASPS
from handstudio.simulation.motions.grasping import grasp_of
from handstudio.simulation.placing import placer
from handstudio.simulation.subject import DEVELOPMENT, REPORTING, subject
from handstudio.simulation.trajectory import Span

DESIGN = ((1, 4), (2, 4), (3, 1))
"""People that the mean postures are of, and how many times each did every class."""


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 1,
    development: bool = False,
    calibration: Calibration = "own",
    imperfections: str = "typical",
    design: bool = False,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        development: People that parameters may be chosen on, not those reported.
        calibration: What the pipeline is told of hand and mounting.
        imperfections: ideal, plain, typical, harsh, and changes to it.
        design: Print the mean postures that the classes are told by, and nothing else.
    """
    if design:
        for name, degrees in designed().items():
            out.print(f"{name}: {degrees}")
        return
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    seeds = 0 if development else 10_000
    rows: list[dict[str, Any]] = []
    with progress("grasps") as share:
        for number, person in enumerate(people, start=1):
            trial = Trial(
                person,
                "quick_start+grasps",
                parse(imperfections),
                seeds + person,
                "tree",
                calibration,
            )
            rows += compared(person, follow(trial), calibration)
            share(number / len(people))
    found = summed(rows) | {"people": list(people), "rows": rows}
    _show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def compared(person: int, followed: Followed, calibration: Calibration) -> list[dict[str, Any]]:
    """A row for every grasp that was done, and for every one that was seen where none was."""
    fit = followed.fit if calibration == "truth" else fit_of(followed.setup)
    seen = grasps_in(followed.setup, followed.motion, 0, fit)
    done = [s for s in followed.trajectory.spans if s.name.startswith("grasp:")]
    rows = []
    for span in done:
        mine = [grasp for grasp in seen if _meets(grasp, span)]
        row: dict[str, Any] = {"person": person, "true": span.name.removeprefix("grasp:")}
        row |= {"seen": OPEN, "confidence": None, "diameter_error_mm": None}
        if mine:
            longest = max(mine, key=lambda g: g.segment.release_s - g.segment.hold_s)
            row |= _told(longest, span)
        rows.append(row)
    extra = [grasp for grasp in seen if not any(_meets(grasp, span) for span in done)]
    return rows + [{"person": person, "true": OPEN, "seen": g.segment.found.name} for g in extra]


def summed(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Share of grasps that were told right, what was taken for what, and sizes."""
    grasps = [row for row in rows if row["true"] != OPEN]
    confusion = Counter((row["true"], row["seen"]) for row in rows)
    sizes = {}
    for name in [kind.name for kind in GRASPS]:
        off = [r for r in grasps if r["true"] == name and r["diameter_error_mm"] is not None]
        if off:
            sizes[name] = {
                "errors_mm": [round(r["diameter_error_mm"], 2) for r in off],
                "sd_in_a_hold_mm": max(r["diameter_sd_mm"] for r in off),
            }
    return {
        "grasps": len(grasps),
        "right": float(np.mean([row["true"] == row["seen"] for row in grasps])),
        "false": sum(row["true"] == OPEN and row["seen"] != OPEN for row in rows),
        "confusion": [
            {"true": true, "seen": seen, "times": times}
            for (true, seen), times in sorted(confusion.items())
        ],
        "sizes": sizes,
    }


def designed() -> dict[str, list[int]]:
    """Mean postures of the classes [deg]; takes minutes."""
    wanted = [next(a for a in hand_angles() if a.name == name) for name in ANGLES]
    postures: dict[str, list[Any]] = {prototype.name: [] for prototype in PROTOTYPES}
    for person, times in DESIGN:
        someone, rng = subject(person), np.random.default_rng(person)
        place = placer(someone)
        for time in range(times):
            for index, kind in enumerate(GRASPS):
                usual = time == 0 if times > 1 else index % 3 == 0
                size = "" if usual else f"/{rng.uniform(*kind.size_mm[1:]):.1f}"
                actor = Actor(someone, 100 * person + time, material())
                placed = place.placed(grasp_of(actor, kind.name + size).posture[None])
                q = so3.from_matrix(placed.attitude)
                angles = joint_angles(someone.skeleton, q, so3.IDENTITY[None], wanted)
                postures[kind.name].append(angles[0])
    return {
        name: np.rad2deg(np.mean(each, axis=0)).round().astype(int).tolist()
        for name, each in postures.items()
    }


def _meets(grasp: TakenGrasp, span: Span) -> bool:
    return grasp.segment.hold_s < span.end_s and grasp.segment.release_s > span.start_s


def _told(grasp: TakenGrasp, span: Span) -> dict[str, Any]:
    found = grasp.segment.found
    row: dict[str, Any] = {
        "seen": found.name,
        "confidence": round(found.confidence, 3),
        "hold_late_s": round(grasp.segment.hold_s - span.start_s, 3),
        "release_late_s": round(grasp.segment.release_s - span.end_s, 3),
    }
    held = span.held
    if (
        grasp.size is not None
        and isinstance(held, HeldObject)
        and isinstance(held.shape, (Sphere, Cylinder))
    ):
        off = grasp.size.diameter_m - 2.0 * held.shape.radius_m
        row |= {"diameter_error_mm": 1e3 * off, "diameter_sd_mm": 1e3 * grasp.size.sd_m}
    return row


def _show(found: dict[str, Any]) -> None:
    out.print(
        f"{found['grasps']} grasps, {100.0 * found['right']:.1f} % told right, "
        f"{found['false']} seen where none was"
    )
    for entry in found["confusion"]:
        if entry["true"] != entry["seen"]:
            out.print(f"  {entry['true']} taken for {entry['seen']}: {entry['times']}")
    for name, size in found["sizes"].items():
        errors = ", ".join(f"{error:+.1f}" for error in size["errors_mm"])
        out.print(f"  {name}: diameter off by {errors} mm")


if __name__ == "__main__":
    tyro.cli(main)
