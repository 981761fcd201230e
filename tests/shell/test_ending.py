"""Ctrl-C and its like: the take is whole, the shell is told, and nothing runs on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from handstudio.process import kept_motion, process
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import Restart
from handstudio.recording.take import open_take

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="uses POSIX signals")

WITHIN_S = 60.0


def name_of(folder: Path) -> str:
    """A name no other glove on this machine has."""
    return f"{os.getpid()}-{folder.name}"


def recording(begun, sessions: Path, *more: str):
    """A recording that has gone on for a while."""
    address = f"virtual:?name={name_of(sessions.parent)}"
    running = begun("record", address, "--sessions", sessions, *more)
    await_file(sessions, running)
    time.sleep(0.7)
    return running


def await_file(sessions: Path, running) -> None:
    end = time.monotonic() + WITHIN_S
    while not list(sessions.rglob("*.mcap.recording")):
        assert time.monotonic() < end
        assert running.poll() is None, running.communicate()
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("name", "whom"),
    [
        ("SIGINT", "us"),
        ("SIGINT", "everybody in the terminal"),
        ("SIGTERM", "us"),
        ("SIGHUP", "us"),
    ],
)
def test_a_signal_ends_the_take_whole(begun, running, tmp_path, name, whom):
    number = signal.Signals[name]
    sessions = tmp_path / "sessions"
    recorder = recording(begun, sessions)
    if whom == "us":
        recorder.send_signal(number)
    else:
        os.killpg(recorder.pid, number)
    out, err = recorder.communicate(timeout=WITHIN_S)
    assert recorder.returncode == 0, err
    (path,) = sessions.rglob("*.mcap*")
    assert str(path) in out
    take = open_take(path)
    assert take.summary is not None
    assert kept_motion(take) is not None
    assert len(process(take)) > 50
    decoder = V1Decoder()
    packets = [packet for _, chunk in take.chunks() for packet in decoder.feed(chunk)]
    assert not [packet for packet in packets if isinstance(packet, Restart)]
    assert running(name_of(tmp_path)) == []


def test_a_glove_that_goes_and_comes_back_is_told_of(begun, tmp_path):
    link = tmp_path / "glove"
    command = [sys.executable, "-m", "handstudio.device.virtual_glove", "--link", str(link)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as glove:
        assert glove.stdout is not None
        glove.stdout.readline()
        recorder = begun("record", f"serial:{link}", "--sessions", tmp_path, "--json")
        assert recorder.stderr is not None
        await_file(tmp_path, recorder)
        glove.kill()
        link.unlink()
    assert "is lost" in recorder.stderr.readline()
    with subprocess.Popen(command, stdout=subprocess.PIPE) as glove:
        try:
            assert f"serial:{link} is back" in recorder.stderr.readline()
            recorder.send_signal(signal.SIGINT)
            out, _ = recorder.communicate(timeout=WITHIN_S)
        finally:
            glove.terminate()
    assert recorder.returncode == 0
    assert open_take(Path(msgspec.json.decode(out)["path"])).summary is not None


def test_a_program_gets_its_json_alone(begun, tmp_path):
    recorder = recording(begun, tmp_path / "sessions", "--json")
    recorder.send_signal(signal.SIGINT)
    out, _ = recorder.communicate(timeout=WITHIN_S)
    assert recorder.returncode == 0
    assert Path(msgspec.json.decode(out)["path"]).exists()


def test_giving_up_before_there_is_a_device_leaves_nothing(begun, tmp_path):
    ours, hosts = os.openpty()
    try:
        recorder = begun("record", f"serial:{os.ttyname(hosts)}", "--sessions", tmp_path)
        os.read(ours, 1)  # it asks who is there
        recorder.send_signal(signal.SIGINT)
        out, err = recorder.communicate(timeout=WITHIN_S)
    finally:
        os.close(ours)
        os.close(hosts)
    assert recorder.returncode == 130
    assert out == ""
    assert "Traceback" not in err
    assert not list(tmp_path.rglob("*.mcap*"))
