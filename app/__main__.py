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
from app.server import HOST, Server
from app.studio import State, Studio
from handstudio.device.capture import Capture
from handstudio.shell import out

TICK_S = 1.0 / 60.0


def run(
    sessions: Path,
    *,
    address: str | None,
    port: int,
    browser: bool,
    host: str = HOST,
    token: str | None = None,
) -> int:
    """Serve the studio until Ctrl-C; ends a take that is on, so that nothing is lost.

    Raises:
        HandstudioError: it cannot be served there.
    """
    ended = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ended.set()

    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, end)
    capture, jobs = Capture(), Jobs()
    capture.start()
    try:
        studio = Studio(capture, jobs, State(sessions=sessions))
        server = Server(studio, port, host, token)
        _tell(server, sessions)
        if browser:
            webbrowser.open(server.browser_url())
        _begin(studio, address)
        _loop(studio, server, ended)
        server.close()
    finally:
        capture.stop()
        jobs.close()
        for report in capture.reports():
            out.print(str(getattr(report, "path", report)))
    return 0


def _tell(server: Server, sessions: Path) -> None:
    links = server.links(for_a_person=out.is_terminal)
    if server.door.asks:
        out.print("\n  ".join(["handstudio is at", *links]) + f"\n(takes in {sessions})")
        out.print("Who has such a link can use the studio. What is sent is not encrypted.")
    else:
        out.print(f"handstudio is at {links[0]}  (takes in {sessions})")
    out.print("Ctrl-C ends it.")


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
