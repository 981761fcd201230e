"""How well a pen is followed that virtual people write with, against what it truly did.

    python -m benchmarks.writing --json FILE

People nothing was chosen on write 同志社大 and a Latin word, characters of 30 mm, wearing sensors
with the errors that real ones have, after a calibration of their own. What `handstudio trace`
makes of it is held against the true tip of the true pen, wherever that truly wrote, after the
similarity that fits best; and tesseract, where it is installed, reads the picture.
"""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.trials import Calibration, Followed, Trial, follow
from handstudio.analysis.take_writing import writings_in
from handstudio.analysis.trace_error import trace_error
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.export.trace import trace_png
from handstudio.hand_fit import fit_of
from handstudio.shell import out, progress
from handstudio.simulation.imperfections.strengths import parse, tell
from handstudio.simulation.subject import DEVELOPMENT, REPORTING
from handstudio.simulation.things import Things, things_held
from handstudio.simulation.trajectory import Span

TEXTS = ("同志社大", "hand")
LANGUAGES = {"同志社大": "jpn", "hand": "eng"}


@dataclass(frozen=True, slots=True)
class Case:
    """What is different from the trial that the target is about."""

    name: str
    imperfections: str = "typical"
    calibration: Calibration = "own"
    smooth: bool = False


TARGET = Case("typical, own calibration")
LIMITS = (
    Case("the same, smoothed", smooth=True),
    Case("without soft tissue", "typical,-soft_tissue"),
    Case("perfect sensors that sit on skin", "ideal,soft_tissue"),
    Case("perfect sensors on bone, hand and mounting known", "ideal", "truth"),
    Case("typical, hand and mounting known, sensors and headings not", calibration="truth"),
)


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 1,
    development: bool = False,
    limits: bool = False,
    pictures: Path | None = None,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people; 4 for those in docs/writing.md.
        development: People that parameters may be chosen on, not those reported.
        limits: Also with some of the errors taken away: which of them limits.
        pictures: Folder to draw the traces into.
    """
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    cases = (TARGET, *LIMITS) if limits else (TARGET,)
    asked = [(case, person) for case in cases for person in people]
    rows: list[dict[str, Any]] = []
    with progress("writing") as share:
        for number, (case, person) in enumerate(asked, start=1):
            rows += tried(case, person, 0 if development else 10_000, pictures)
            share(number / len(asked))
    found = {
        "development": development,
        "reads": which("tesseract") is not None,
        "cases": [summed(case, [r for r in rows if r["case"] == case.name]) for case in cases],
        "writings": rows,
    }
    _show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2, ensure_ascii=False), encoding="utf-8")


def tried(case: Case, person: int, seeds: int, pictures: Path | None) -> list[dict[str, Any]]:
    """One person writing every text, a row a text."""
    motion = "+".join(["quick_start", *(f"writing:{text}" for text in TEXTS)])
    strengths = parse(case.imperfections)
    trial = Trial(
        person, motion, strengths, seeds + person, "tree", case.calibration, smooth=case.smooth
    )
    followed = follow(trial)
    fit = followed.fit if case.calibration == "truth" else fit_of(followed.setup)
    found = writings_in(followed.setup, followed.motion, 0, fit)
    spans = [s for s in followed.trajectory.spans if s.name.startswith("writing:")]
    truth = followed.truth
    held = things_held(
        followed.trajectory, truth.time_us, truth.q_world_segment, truth.t_world_joint
    )
    out: list[dict[str, Any]] = []
    for span in spans:
        text = span.name.removeprefix("writing:")
        row: dict[str, Any] = {"case": case.name, "imperfections": tell(strengths)}
        row |= {"person": person, "text": text}
        mine = [w for w in found if w.time_s[0] < span.end_s and w.time_s[-1] > span.start_s]
        row["found"] = len(mine)
        if mine:
            longest = max(mine, key=lambda writing: writing.length_m)
            row |= compared(longest, followed, held, span)
            row["read"] = read(longest, LANGUAGES[text])
            _draw(pictures, longest, row)
        out.append(row)
    return out


def compared(writing: Writing, followed: Followed, held: Things, span: Span) -> dict[str, Any]:
    """A trace against the true tip, where that truly wrote [mm]."""
    time_us = followed.truth.time_us
    at = np.searchsorted(time_us, np.round(writing.time_s * 1e6).astype(int))
    elbow = followed.truth.t_world_joint[at, 0]
    true, down = held.t_world_held[at] - elbow, held.pen_down[at]
    whole = trace_error(writing.flat[down], true[down, :2])
    characters = [s for s in followed.trajectory.spans if _within(s, span)]
    each = []
    for character in characters:
        now = down & (writing.time_s >= character.start_s) & (writing.time_s <= character.end_s)
        if now.sum() < 2:  # the pen was lost before
            continue
        each.append(trace_error(writing.flat[now], true[now, :2]).rmse_m)
    return {
        "rmse_mm": 1e3 * whole.rmse_m,
        "size": 1.0 / whole.scale,
        "character_rmse_mm": [1e3 * rmse for rmse in each],
        "missed": float((down & ~writing.down).sum() / down.sum()),
        "added": float((writing.down & ~down).sum() / writing.down.sum()),
        "strokes": len(writing.strokes),
        "true_strokes": _runs(held.pen_down[at]),
    }


def read(writing: Writing, language: str) -> str | None:
    """What tesseract reads in the picture; None where it is not installed."""
    if which("tesseract") is None:
        return None
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trace.png"
        path.write_bytes(trace_png(writing))
        said = subprocess.run(
            ["tesseract", str(path), "-", "-l", language, "--psm", "7"],
            capture_output=True,
            text=True,
            check=False,
        )
    return said.stdout.strip().replace(" ", "")


def summed(case: Case, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Over people and texts."""
    known = [row for row in rows if row["found"]]
    rmse = [row["rmse_mm"] for row in known]
    return {
        "case": case.name,
        "writings": len(rows),
        "found": len(known),
        "rmse_mm": {
            "median": float(np.median(rmse)),
            "worst": max(rmse),
        },
        "character_rmse_mm": {
            "median": float(np.median(np.concatenate([r["character_rmse_mm"] for r in known])))
        },
        "read": sum(row["read"] == row["text"] for row in known),
        "missed": float(np.mean([row["missed"] for row in known])),
        "added": float(np.mean([row["added"] for row in known])),
    }


def _within(inner: Span, outer: Span) -> bool:
    inside = outer.start_s <= inner.start_s and inner.end_s <= outer.end_s
    return inside and inner is not outer and len(inner.name) == 1


def _runs(down: Array) -> int:
    return int(np.sum(np.diff(np.concatenate([[False], down])) & down))


def _draw(folder: Path | None, writing: Writing, row: dict[str, Any]) -> None:
    if folder is None or row["case"] != TARGET.name:
        return
    folder.mkdir(parents=True, exist_ok=True)
    name = f"writing-{row['person']}-{TEXTS.index(row['text'])}.png"
    (folder / name).write_bytes(trace_png(writing, dpi=100))


def _show(found: dict[str, Any]) -> None:
    for case in found["cases"]:
        read = f"{case['read']} read" if found["reads"] else "tesseract is not installed"
        out.print(
            f"{case['case']}: {case['found']} of {case['writings']} found, RMSE median "
            f"{case['rmse_mm']['median']:.2f} mm, worst {case['rmse_mm']['worst']:.2f} mm, a "
            f"character {case['character_rmse_mm']['median']:.2f} mm, {read}"
        )


if __name__ == "__main__":
    tyro.cli(main)
