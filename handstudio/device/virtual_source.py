"""A virtual glove of our own: a process started with the line and ended with it."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading

from handstudio.device.serial_source import SerialSource
from handstudio.device.source import ByteSource, SourceLost
from handstudio.device.tcp_source import TcpSource
from handstudio.errors import DeviceError

START_S = 20.0
"""How long a virtual glove may take to start on a busy machine."""

_TX_BUFFER = 1 << 18
"""Of our own glove [bytes]: rides out 0.6 s at 1000 Hz of a machine that a browser keeps busy."""

_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
"""Small systems of equations take ten times as long where threads wait for a busy core."""

_OPTIONS = (
    "subject",
    "motion",
    "imperfections",
    "rate",
    "seed",
    "side",
    "hand-length",
    "name",
    "epoch",
    "speed",
    "tracker",
    "tracker-name",
    "tracker-errors",
)


class VirtualSource:
    """Starts a virtual glove and speaks with it through a pseudo-terminal, or TCP on Windows.

    Args:
        options: Any that the glove's command line takes, such as subject, motion, imperfections,
            rate, seed, side; ``transport=tcp`` asks for TCP.
    """

    def __init__(self, options: dict[str, str]) -> None:
        self._process = _start(options)
        try:
            self._line = _line(_address(self._process))
        except DeviceError:
            self._end()
            raise

    def read(self, timeout_s: float) -> bytes:
        """Bytes that are there, waiting up to a time for the first."""
        if self._process.poll() is not None and not isinstance(self._line, TcpSource):
            raise SourceLost("the virtual glove's process ended")
        return self._line.read(timeout_s)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._line.write(data)

    def close(self) -> None:
        """End the glove."""
        self._line.close()
        self._end()

    def _end(self) -> None:
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()  # the glove quits with its parent
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


def _start(options: dict[str, str]) -> subprocess.Popen[str]:
    unknown = options.keys() - {*_OPTIONS, "transport"}
    if unknown:
        raise DeviceError(
            "A virtual glove has no option {unknown}.",
            "It has {options} and transport.",
            unknown=", ".join(sorted(unknown)),
            options=", ".join(_OPTIONS),
        )
    from handstudio.simulation.imperfections import strengths  # noqa: PLC0415 - all of a person
    from handstudio.simulation.motions import language  # noqa: PLC0415

    language.parse(options.get("motion", "showcase"))
    strengths.parse(options.get("imperfections", "plain"))
    tcp = options.get("transport") == "tcp" or sys.platform == "win32"
    command = [sys.executable, "-m", "handstudio.device.virtual_glove", "--quit-with-parent"]
    command += ["--tx-buffer", str(_TX_BUFFER)]
    command += ["--tcp", "0"] if tcp else ["--pty"]
    for option in _OPTIONS:
        if option in options:
            command += [f"--{option}", options[option]]
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=os.environ | _ONE_THREAD,
            start_new_session=True,  # Ctrl-C in the terminal is for us: the glove ends with us
        )
    except OSError as error:
        raise DeviceError(
            "The virtual glove cannot be started: {program} ({reason}).",
            "Install handstudio anew: its Python has gone.",
            program=command[0],
            reason=error.strerror or error,
        ) from error


def _line(address: str) -> ByteSource:
    kind, _, place = address.partition(":")
    return TcpSource(place) if kind == "tcp" else SerialSource(place)


def _address(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    watchdog = threading.Timer(START_S, process.kill)
    watchdog.start()
    try:
        line = process.stdout.readline()
    finally:
        watchdog.cancel()
    try:
        told = json.loads(line)
        if "problem" in told:
            what, remedy = told["problem"]
            raise DeviceError("{what}", "{remedy}", what=what, remedy=remedy)
        address = told["address"]
    except (ValueError, KeyError, TypeError) as error:
        raise DeviceError(
            "The virtual glove did not start (it said {line!r}).",
            "Try again; its messages are in the terminal the studio runs in.",
            line=line.strip(),
        ) from error
    return str(address)
