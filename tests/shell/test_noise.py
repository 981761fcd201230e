"""The noise of sensors, told from takes in which they lay still."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PIL import Image

from handstudio.commands.noise import noise
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.recording.header import Header, Summary
from handstudio.recording.notes import Label, Notes, save_notes
from handstudio.recording.take import Take
from handstudio.recording.writer import TakeWriter
from handstudio.samples import STANDARD_GRAVITY, Gap, ImuSamples, Why
from handstudio.setup import Setup

RATE_HZ, SECONDS = 50, 260
Q = np.deg2rad(6.5e-3), 1.15e-4 * STANDARD_GRAVITY


def at_rest(seconds: int) -> ImuSamples:
    rng, n, layout = np.random.default_rng(4), seconds * RATE_HZ, glove()
    shape = (n, len(layout.sensors), 3)
    silent = np.zeros(shape[:2], dtype=bool)
    gyr, acc = (q * np.sqrt(RATE_HZ) * rng.standard_normal(shape) for q in Q)
    return ImuSamples(
        time_us=5_000_000 + np.arange(n, dtype=np.int64) * (1_000_000 // RATE_HZ),
        gyr=gyr,
        acc=acc + np.array([0.0, 0.0, STANDARD_GRAVITY]),
        mag=np.full(shape, np.nan),
        fresh=silent,
        valid=~silent,
        saturated=silent,
    )


def written(folder: Path, seconds: int) -> Path:
    setup = Setup(glove(), float(RATE_HZ))
    writer = TakeWriter(folder / "rest.mcap", Header("rest", "S01", 0, setup, "samples", "test"))
    samples = at_rest(seconds)
    for start in range(0, len(samples), 1000):
        writer.write_samples(samples[start : start + 1000], 0)
    return writer.close(Summary(0, 0, float(seconds)))


@pytest.fixture
def take(tmp_path) -> Path:
    return written(tmp_path, SECONDS)


@pytest.fixture
def said(capsys, wide):
    """``said(take)``: what the command prints."""

    def run(*takes: Path, **more) -> str:
        assert noise(takes, **more) == 0
        return capsys.readouterr().out

    return run


def test_a_person_reads_a_table_in_the_thesis_s_units_and_sees_a_picture(said, take, tmp_path):
    picture = tmp_path / "new" / "noise.png"
    words = said(take, picture=picture)
    assert all(f"SN{number} " in words for number in range(1, 21))
    assert "deg/sqrt(s)" in words
    assert "0.0062 to 0.0069" in words
    assert "0.0065" in words
    assert "< " in words  # there is no walk
    with Image.open(picture) as image:
        assert image.width > 1000
        assert len(image.getcolors(1 << 20)) > 100


def test_a_program_reads_si_of_the_stretch_labelled_rest(said, take):
    save_notes(take, Notes(labels=(Label(0.0, 1.0, "work"), Label(2.0, 127.0, "rest"))))
    found = msgspec.json.decode(said(take, json=True))
    assert found["units"]["gyr"]["white"] == "rad/sqrt(s)"
    assert found["durations_s"] == [pytest.approx(125.0, abs=0.1)]
    for kind, q in zip(("gyr", "acc"), Q, strict=True):
        values = [axis["white"]["value"] for one in found["sensors"] for axis in one[kind]]
        assert np.mean(values) == pytest.approx(q, rel=0.01)


def test_a_restart_or_a_long_gap_makes_two_recordings_on_one_time(said, take, monkeypatch):
    """Stamps begin anew after a restart; labels count from the first instant of the take."""
    samples = at_rest(SECONDS)
    half = len(samples) // 2
    later = replace(samples[half:], time_us=samples.time_us[half:] + 3_000_000)
    anew = replace(samples[half:], time_us=samples.time_us[: len(samples) - half])
    for gap, after in ((Gap(Why.LOST, 150), later), (Gap(Why.RESTART, 0, 3_000_000), anew)):
        monkeypatch.setattr(Take, "events", lambda _, g=gap, a=after: [[samples[:half], g], [a]])
        save_notes(take, Notes())
        found = msgspec.json.decode(said(take, json=True))
        assert found["durations_s"] == [130.0, 130.0]
        save_notes(take, Notes(labels=(Label(133.0, 260.0, "rest"),)))
        found = msgspec.json.decode(said(take, json=True))
        assert found["durations_s"] == [pytest.approx(127.0, abs=0.1)]


def test_too_little_or_nothing_is_refused(tmp_path):
    with pytest.raises(CalibrationError, match="is 5 s long, at least 120 s"):
        noise((written(tmp_path, 5),))
    with pytest.raises(CalibrationError, match="No take was named"):
        noise(())
