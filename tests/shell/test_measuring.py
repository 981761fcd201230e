"""Measures and reports from the shell."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from app import words
from handstudio.recording.simulated import rehearse, simulate


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate(tmp_path_factory.mktemp("sessions"), rehearse(seed=3), seconds=9.0)


@pytest.fixture(autouse=True)
def _english(monkeypatch):
    for name in ("_catalogue", "_errors", "_language"):
        monkeypatch.setattr(words, name, getattr(words, name))


def test_measures_are_printed_with_norms_and_uncertainties(here, take):
    said = here("measure", take)
    assert said.code == 0, said.err
    line = next(line for line in said.out.splitlines() if line.startswith("index_pip_flexion"))
    assert "±" in line
    assert "0 to 100" in line
    assert "Time in posture" in said.out
    assert "needs a calibration of the hand" in said.out


def test_measures_for_a_program_and_into_a_file(here, take, tmp_path):
    target = tmp_path / "measures.json"
    said = here(
        "measure", take, "--json", "--json-file", target, "--posture", "up=wrist_flexion:1:"
    )
    assert said.json == msgspec.json.decode(target.read_bytes())
    postures = [m["about"] for m in said.json["measures"] if m["kind"] == "time_in_posture"]
    assert postures == ["up"]
    refused = here("measure", take, "--json-file", tmp_path / "no" / "such.json")
    assert refused.code == 1
    assert "cannot be written" in refused.err


def test_two_visits_are_compared(here, tmp_path):
    first, second = (simulate(tmp_path, rehearse(seed=s), seconds=4.0, code="S") for s in (1, 2))
    said = here("measure", second, "--earlier", first)
    assert said.code == 0, said.err
    assert "no detectable change" in said.out
    assert here("measure", first, "--earlier", second).code == 1


def test_the_other_hand_is_compared_with(here, tmp_path):
    right, left = (
        simulate(tmp_path, rehearse(seed=1, side=s), seconds=4.0, code="S", name=s)
        for s in ("right", "left")
    )
    said = here("measure", right, "--other-side", left)
    assert said.code == 0, said.err
    assert "of the other hand" in said.out
    assert "the other hand: left" in said.out
    report = tmp_path / "r.html"
    assert here("report", right, "--other-side", left, "--to", report, "--end-s", "3").code == 0
    assert "Of the other hand" in report.read_text(encoding="utf-8")
    assert here("measure", right, "--other-side", right).code == 1


def test_a_report_is_written_beside_the_take(here, take):
    said = here("report", take, "--language", "ja", "--end-s", "3")
    assert said.code == 0, said.err
    page = take.with_suffix(".report.ja.html")
    assert said.out.strip() == str(page)
    assert '<html lang="ja">' in page.read_text(encoding="utf-8")


def test_without_a_browser_the_report_says_how_to_print_it(here, take, monkeypatch, tmp_path):
    monkeypatch.setenv("HANDSTUDIO_CHROMIUM", str(tmp_path / "none"))
    said = here("report", take, "--pdf", "--to", tmp_path / "r.html", "--end-s", "2")
    assert said.code == 1
    assert (tmp_path / "r.html").is_file()
    assert "print it to PDF" in said.err
