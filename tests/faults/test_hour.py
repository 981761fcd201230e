"""An hour of recording: nothing lost, and neither memory nor the work for a chunk grows."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

GROWTH_MB = 16.0
"""After the first tenth of the hour. Measured: 6.6, nearly all of it the index that the file ends
with, 370 bytes a flush. What was recorded meanwhile is 140 MB of bytes and 250 MB of motion."""

SLOWER = 1.5
"""CPU time in the last tenth of the hour over that in the first. Measured: 1.02."""


@pytest.mark.long
def test_an_hour_of_recording_costs_in_the_end_what_it_cost_at_first(tmp_path):
    done = subprocess.run(
        [sys.executable, str(ROOT / "tests" / "faults" / "hour.py"), str(tmp_path), "60"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        stdout=subprocess.PIPE,
        check=True,
    )
    told = json.loads(done.stdout)
    assert told["packets"] == told["instants_in_file"] == 360_000
    assert told["missing"] == 0
    settled = [size for share, size in told["rss"] if share >= 0.1]
    assert len(settled) > 50
    grown_mb = (max(settled) - settled[0]) / 1e6
    ratios = [last / first for first, last in (told["chunk_s"], told["tick_s"])]
    print(f"grew by {grown_mb:.1f} MB, costs grew by {ratios}", file=sys.stderr)
    assert grown_mb < GROWTH_MB
    assert max(ratios) < SLOWER
