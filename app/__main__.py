"""The studio's main loop: take in what happened, draw it, at most sixty times a second."""

from __future__ import annotations

import signal
import threading
import time
import webbrowser
from pathlib import Path
from types import FrameType

from app import intents
from app.jobs import Jobs
from app.server import Server
from app.studio import State, Studio
from handstudio.device.capture import Capture
from handstudio.shell import out

TICK_S = 1.0 / 60.0


def run(sessions: Path, *, address: str | None, port: int, browser: bool) -> int:
    """Serve the studio until Ctrl-C; ends a take that is on, so that nothing is lost."""
    ended = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ended.set()

    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, end)
    capture, jobs = Capture(), Jobs()
    capture.start()
    try:
        studio = Studio(capture, jobs, State(sessions=sessions))
        server = Server(studio, port)
        out.print(f"handstudio is at {server.url}  (takes in {sessions})\nCtrl-C ends it.")
        if browser:
            webbrowser.open(server.url)
        _begin(studio, address)
        _loop(studio, server, ended)
        server.close()
    finally:
        capture.stop()
        jobs.close()
        for report in capture.reports():
            out.print(str(getattr(report, "path", report)))
    return 0


def _begin(studio: Studio, address: str | None) -> None:
    studio.jobs.warm_up()
    studio.refresh_takes()
    studio.send(intents.FindDevices())
    if address is not None:
        studio.send(intents.ConnectDevice(address))


def _loop(studio: Studio, server: Server, ended: threading.Event) -> None:
    before = time.monotonic()
    while not ended.is_set():
        now = time.monotonic()
        server.render(studio.tick(now - before))
        before = now
        ended.wait(max(0.001, TICK_S - (time.monotonic() - now)))
