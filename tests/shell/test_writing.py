"""What was written and grasped in a take, by the command; files read by others' readers."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from handstudio.recording.simulated import rehearse, simulate

READS = shutil.which("tesseract") is not None


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """The ideal hand writes one stroke."""
    folder = tmp_path_factory.mktemp("written")
    return simulate(folder, rehearse(motion="static+writing:一"), name="written")


def test_a_trace_is_told_and_written_as_svg_png_and_csv(here, written, tmp_path):
    said = here("trace", written, "--svg", "--png", "--csv", "--to", tmp_path, "--json")
    assert said.code == 0, said.err
    (told,) = json.loads(said.out)
    assert told["strokes"] == 1
    assert told["width_mm"] == pytest.approx(24.0, abs=4.0)
    assert told["off_plane_sd_mm"] < 0.5
    svg, png, table = (Path(path) for path in told["files"])
    paths = ElementTree.parse(svg).findall(".//{http://www.w3.org/2000/svg}path")
    assert len(paths) == 1
    assert png.read_bytes().startswith(b"\x89PNG")
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    down = [row for row in rows if float(row["stroke"]) == 1.0]
    x = np.array([float(row["page_x_mm"]) for row in down])
    assert np.ptp(x) == pytest.approx(told["width_mm"], abs=0.11)
    assert x[-1] > x[0]
    sidecar = json.loads(table.with_name(table.name + ".json").read_text())
    assert sidecar["content"] == "trace"
    assert sidecar["writing"]["strokes"] == 1
    assert sidecar["raw_sha256"]


def test_a_part_in_which_nothing_is_written_says_so(here, written):
    said = here("trace", written, "--end-s", 2)
    assert said.code == 1
    assert "no pen was seen to write" in said.err
    said = here("grasps", written, "--end-s", 2, "--json")
    assert (said.code, json.loads(said.out)) == (0, [])


@pytest.mark.long
@pytest.mark.skipif(not READS, reason="tesseract is not installed")
def test_tesseract_reads_what_was_written(here, tmp_path):
    take = simulate(tmp_path, rehearse(motion="static+writing:hand"), name="hand")
    said = here("trace", take, "--png", "--to", tmp_path, "--json")
    (told,) = json.loads(said.out)
    read = subprocess.run(
        ["tesseract", told["files"][0], "-", "-l", "eng", "--psm", "7"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert read.stdout.strip() == "hand"
