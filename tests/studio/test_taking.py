"""What happens around a take: it is counted in, warned of, and ended when nobody is there."""

from __future__ import annotations

import io
import wave

import pytest

from app import sounds
from app.shown import taking
from app.shown.taking import Countdown, Disk, Ending, Watch


def test_the_count_is_three_two_one() -> None:
    countdown, shown = Countdown(3.0), []
    while not countdown.over:
        shown.append(countdown.shown)
        countdown = taking.counted(countdown, 0.25)
    assert shown == [3] * 4 + [2] * 4 + [1] * 4


def test_the_last_page_that_closes_ends_a_take_after_a_while() -> None:
    watch = Watch()
    for _ in range(100):
        watch = taking.watched(watch, 10.0, pages=1, lost=False)
    assert taking.ending_of(watch, None) is None
    for _ in range(7):
        watch = taking.watched(watch, 10.0, pages=0, lost=False)
    assert taking.ending_of(watch, None) is Ending.ALONE
    back = taking.watched(watch, 0.1, pages=1, lost=False)
    assert taking.ending_of(back, None) is None


def test_a_device_that_stays_away_ends_a_take_and_one_that_comes_back_does_not() -> None:
    watch = Watch()
    for _ in range(59):
        watch = taking.watched(watch, 10.0, pages=1, lost=True)
    watch = taking.watched(watch, 0.1, pages=1, lost=False)
    for _ in range(60):
        watch = taking.watched(watch, 10.0, pages=1, lost=True)
    assert taking.ending_of(watch, None) is None
    watch = taking.watched(watch, 1.0, pages=1, lost=True)
    assert taking.ending_of(watch, None) is Ending.LOST


@pytest.mark.parametrize(
    ("free", "rate", "low", "full"),
    [
        (100_000_000_000, 42_000, False, False),
        (400_000_000, 42_000, True, False),  # little, though it lasts for hours
        (600_000_000, 900_000, True, False),  # ten minutes at a high rate
        (49_000_000, 42_000, True, True),
        (0, 0.0, True, True),
    ],
)
def test_a_disk_is_warned_of_before_it_is_full(free: int, rate: int, low: bool, full: bool) -> None:
    disk = Disk(free, rate)
    assert (disk.low, disk.full) == (low, full)
    assert (taking.ending_of(Watch(), disk) is Ending.FULL) == full


@pytest.mark.parametrize("sound", list(sounds.Sound))
def test_sounds_are_short_and_end_softly(sound: sounds.Sound) -> None:
    with wave.open(io.BytesIO(sounds.wav(sound))) as file:
        seconds = file.getnframes() / file.getframerate()
        frames = file.readframes(file.getnframes())
    assert 0.05 < seconds < 1.0
    assert abs(int.from_bytes(frames[-2:], "little", signed=True)) < 3000
    assert "autoplay" in sounds.as_html(sound)
