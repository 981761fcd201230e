"""How much faster than real time takes of virtual people are written, the truth beside them.

    python -m benchmarks.simulation --json FILE

Real time is the measure, so only the machine's own speed enters.
"""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import Annotated

import tyro

from handstudio.recording.simulated import Rehearsed, rehearse, simulate
from handstudio.shell import print_table
from handstudio.simulation.imperfections.strengths import parse


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    motion: str = "calibration+scissors",
    rate: int = 100,
    times: int = 3,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        motion: What is done (handstudio motions).
        rate: Samples a second.
        times: How often; the middle one counts.
    """
    found = {}
    for imperfections in ("plain", "typical", "harsh"):
        rehearsed = rehearse(7, motion, parse(imperfections), 3)
        found[imperfections] = sorted(_ratio(rehearsed, rate) for _ in range(times))[times // 2]
    rows = [[name, f"{ratio:.0f}"] for name, ratio in found.items()]
    print_table(f"{motion}, {rate} Hz, times real time", ["imperfections", "ratio"], rows)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps({"x_realtime": found}, indent=2), encoding="utf-8")


def _ratio(rehearsed: Rehearsed, rate: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        simulate(Path(folder), rehearsed, rate_hz=rate)
        return float(rehearsed.trajectory.duration_s / (time.perf_counter() - began))


if __name__ == "__main__":
    tyro.cli(main)
