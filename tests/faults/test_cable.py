"""A cable that comes out and goes in again while the studio records."""

from __future__ import annotations

import contextlib
import shutil
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app import intents
from app.state import State
from app.studio import Studio
from handstudio.device.capture import Capture
from handstudio.device.orders import Phase
from handstudio.pipeline import Motion, join
from handstudio.process import kept_motion, process
from handstudio.recording.take import open_take
from handstudio.settings import SettingsStore

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

FIELDS = ("time_us", "q_world_sensor", "q_world_start", "doubt")
PERIOD_US = 10_000
WITHIN_S = 30.0


class Cable:
    """A socket between studio and glove that can be pulled and plugged; the glove stays on."""

    def __init__(self, address: str) -> None:
        _, host, port = address.split(":")
        self._far = host, int(port)
        self._door = socket.create_server(("127.0.0.1", 0))
        self._port = int(self._door.getsockname()[1])
        self.address = f"tcp:127.0.0.1:{self._port}"
        self._out = threading.Event()
        self._thread = self._carrying()

    def pull(self) -> None:
        """Nobody answers at this address any more."""
        self._out.set()
        self._thread.join()
        self._door.close()

    def plug(self) -> None:
        """The glove can be reached again."""
        self._out.clear()
        self._door = socket.create_server(("127.0.0.1", self._port))
        self._thread = self._carrying()

    def _carrying(self) -> threading.Thread:
        thread = threading.Thread(target=self._carry, name="cable")
        thread.start()
        return thread

    def _carry(self) -> None:
        self._door.settimeout(0.02)
        while not self._out.is_set():
            with contextlib.suppress(TimeoutError):
                near, _ = self._door.accept()
                with near, socket.create_connection(self._far) as far:
                    near.settimeout(0.002)
                    far.settimeout(0.002)
                    while not self._out.is_set() and pass_on(near, far) and pass_on(far, near):
                        pass


def pass_on(source: socket.socket, sink: socket.socket) -> bool:
    """Carry what is there; whether both ends still are."""
    try:
        data = source.recv(65536)
        sink.sendall(data)
    except TimeoutError:
        return True
    except ConnectionError:
        return False
    return bool(data)


@pytest.fixture
def cable(glove) -> Iterator[Callable[[str], Cable]]:
    cables: list[Cable] = []

    def make(address: str) -> Cable:
        cables.append(Cable(address))
        return cables[-1]

    yield make
    for one in cables:
        one.pull()


class NoJobs:
    """Nothing has to be computed: the motion of a take is there when it is whole."""

    share_done = 0.0

    def survey(self, path: Path, setup: object = None) -> Future[tuple[()]]:
        return _never()

    def find(self, path: Path, setup: object) -> Future[None]:
        return _never()


def _never() -> Future[Any]:
    return Future()


class Desk:
    """The studio behind the page, ticked as its loop does, with all motion that passed."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.motions: list[Motion] = []
        self.phases: list[Phase] = []
        self.capture = Capture()
        drain = self.capture.drain

        def heard() -> list[Motion]:
            motions = drain()
            self.motions += motions
            return motions

        monkeypatch.setattr(self.capture, "drain", heard)
        store = SettingsStore(folder / "settings.json")
        self.studio = Studio(self.capture, NoJobs(), store, State(folder))
        self.capture.start()

    def until(self, condition: Callable[[State], object], what: str) -> State:
        """Tick until the state is as it should be."""
        end = time.monotonic() + WITHIN_S
        while True:
            state = self.studio.tick(1 / 60)
            if not self.phases or self.phases[-1] is not state.newest.phase:
                self.phases.append(state.newest.phase)
            if condition(state):
                return state
            assert time.monotonic() < end, f"{what}: {state.newest.phase} {state.newest.problem}"
            time.sleep(1 / 60)

    def go_on(self, instants: int) -> None:
        """Wait for so many more."""
        known = sum(map(len, self.motions))
        self.until(
            lambda _: sum(map(len, self.motions)) >= known + instants, f"{instants} more instants"
        )


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    one = Desk(tmp_path / "sessions", monkeypatch)
    yield one
    one.capture.stop()
    one.studio.state = State(sessions=tmp_path)  # the open take is a file


def streams(state: State) -> bool:
    return state.newest.phase is Phase.STREAMING


def lost(state: State) -> bool:
    return state.newest.phase is Phase.LOST


@pytest.mark.parametrize("times", [2, pytest.param(20, marks=pytest.mark.long)])
@pytest.mark.parametrize("powered", [True, False], ids=["the glove stays on", "its power goes too"])
def test_a_cable_that_comes_out_leaves_one_take_with_its_gaps_marked(
    desk, glove, cable, times, powered
):
    one = glove("tcp", seed=91, epoch=1)
    wire = cable(one.address)
    number = int(one.address.rpartition(":")[2])
    desk.studio.send(intents.ConnectDevice(wire.address))
    desk.until(streams, "it streams")
    for intent in (
        intents.PagesOpen(1),
        intents.SetCountdown(0),
        intents.SaveSubject("S01", "right", 187.0, then_record=True),
    ):
        desk.studio.send(intent)
    recorder = desk.until(lambda state: state.newest.recorder, "a take is on").newest.recorder
    desk.go_on(80)
    desk.phases.clear()
    for k in range(times):
        wire.pull()
        state = desk.until(lost, "the page says that it is lost")
        assert state.newest.recorder is recorder
        assert state.newest.health.rate_hz == 0.0
        if not powered:
            one.switch_off()
            one = glove("tcp", seed=91, epoch=2 + k, port=number)
        wire.plug()
        state = desk.until(streams, "the page says that it is back")
        assert state.newest.recorder is recorder
        desk.go_on(20)
    assert [phase for phase in desk.phases if phase is Phase.LOST] == [Phase.LOST] * times
    assert set(desk.phases) == {Phase.STREAMING, Phase.LOST}
    desk.studio.send(intents.ToggleRecording())
    state = desk.until(lambda state: state.review, "the take is opened")
    assert [path.name for path in recorder.path.parent.glob("*.mcap*")] == [recorder.path.name]
    motion = computed_as_shown(recorder.path, join(desk.motions))
    assert_gaps_marked(motion, times)
    assert state.newest.health.restarts == (0 if powered else times)


def computed_as_shown(path: Path, live: Motion) -> Motion:
    """Kept, computed and shown motion of a take are equal to the last bit; that motion."""
    take = open_take(path)
    assert kept_motion(take) is not None
    shutil.rmtree(path.with_suffix(".motion"))
    computed = process(take)
    first = int(np.searchsorted(live.time_us, computed.time_us[0]))
    shown = live[first : first + len(computed)]
    for name in FIELDS:
        assert getattr(shown, name).tobytes() == np.asarray(getattr(computed, name)).tobytes(), name
    return computed


def assert_gaps_marked(motion: Motion, times: int) -> None:
    """Where time is missing the clock steps, and every sensor is in doubt; nowhere else a step."""
    steps = np.diff(motion.time_us)
    after = np.flatnonzero(steps > 1.5 * PERIOD_US) + 1
    assert len(after) == times
    assert (motion.doubt[after] != 0).all()
    assert (np.delete(steps, after - 1) > 0).all()
