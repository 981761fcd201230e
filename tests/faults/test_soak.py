"""Everything that can happen to a capture, at random, for as long as one cares to wait."""

from __future__ import annotations

import shutil
import sys
import time

import numpy as np
import pytest

from handstudio.device.orders import Ask, Connect, Disconnect, Phase, StartTake, StopTake
from handstudio.errors import DeviceError
from handstudio.process import kept_motion, process
from handstudio.protocol.packets import Command
from handstudio.recording.take import open_take

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

FIELDS = ("time_us", "q_world_sensor", "q_world_start", "doubt")


def soak(studio, glove, seed: int, steps: int) -> None:
    rng = np.random.default_rng(seed)
    epoch, takes = 1, 0
    one = glove("pty", seed=7, epoch=epoch)
    address = one.address
    studio.send(Connect(address))
    for _ in range(steps):
        match rng.choice(["take", "end", "off", "other", "still", "rate", "again", "away", "wait"]):
            case "take":
                takes += 1
                studio.send(StartTake(studio.folder / f"take{takes}.mcap", "S01"))
            case "end":
                studio.send(StopTake())
            case "off" | "other" as what:
                one.switch_off()
                time.sleep(float(rng.uniform(0.0, 0.5)))
                epoch += 1
                rate = int(rng.choice([100, 200]))
                one = glove("pty", seed=8 if what == "other" else 7, epoch=epoch, rate=rate)
            case "still":
                studio.send(Ask(Command.STOP))
            case "rate":
                asked = int(rng.choice([50, 100, 200]))
                studio.send(Ask(Command.SET_RATE, asked.to_bytes(2, "little")))
            case "again":
                studio.send(Connect(address))
            case "away":
                studio.send(Disconnect())
                studio.send(Connect(address))
            case _:
                pass
        time.sleep(float(rng.exponential(0.4)))
        studio.hear()
    studio.send(StopTake())
    studio.send(Connect(address))
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it streams in the end")
    studio.capture.stop()
    studio.hear()
    unexpected = [report for report in studio.reports if type(report) is DeviceError]
    assert all("take" in report.what or "No device" in report.what for report in unexpected)
    check_takes(studio, takes)


def check_takes(studio, most: int) -> None:
    """Every take is whole, and its kept motion is what is computed from its bytes."""
    assert not list(studio.folder.glob("*.recording"))
    paths = sorted(studio.folder.glob("*.mcap"))
    assert 0 < len(paths) <= most
    for path in paths:
        take = open_take(path)
        assert take.summary is not None
        kept = kept_motion(take)
        assert kept is not None
        arrays = [np.array(getattr(kept, name)) for name in FIELDS]
        shutil.rmtree(path.with_suffix(".motion"))
        computed = process(take)
        for name, array in zip(FIELDS, arrays, strict=True):
            assert array.tobytes() == np.asarray(getattr(computed, name)).tobytes(), (path, name)


@pytest.mark.long
def test_a_troubled_quarter_of_a_minute_leaves_whole_takes(studio, glove):
    soak(studio, glove, 101, 25)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(201, 205))
def test_a_troubled_minute_leaves_whole_takes(studio, glove, seed):
    soak(studio, glove, seed, 120)
