"""The studio's main loop: take in what happened, draw it, at most sixty times a second."""

from __future__ import annotations

import logging
import platform
import signal
import threading
import time
import webbrowser
from pathlib import Path
from types import FrameType

from app import intents
from app.jobs import Jobs
from app.journal import Journal
from app.server import HOST, Server
from app.studio import State, Studio
from handstudio import __version__
from handstudio.device.capture import Capture
from handstudio.log import log_folder, logging_to
from handstudio.scrub import Scrubber
from handstudio.shell import err, out

_log = logging.getLogger("app")  # this module may be called __main__

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
    scrubber = Scrubber()
    scrubber.sessions(sessions)
    scrubber.tokens(() if token is None else (token,))
    with logging_to(log_folder(), scrubber) as log:
        if log.problem:
            err.print(f"No log is kept: {log.folder} cannot be written ({log.problem}).")
        _log.info("handstudio %s on Python %s, %s", __version__, *_platform())
        code = _serve(
            sessions, address, scrubber, port=port, browser=browser, host=host, token=token
        )
        _log.info("ended")
        return code


def _serve(
    sessions: Path,
    address: str | None,
    scrubber: Scrubber,
    *,
    port: int,
    browser: bool,
    host: str,
    token: str | None,
) -> int:
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
        scrubber.tokens(server.door.secrets)
        _log.info("served %s", "with a token" if server.door.asks else "to this machine")
        _tell(server, sessions)
        if browser:
            webbrowser.open(server.browser_url())
        _begin(studio, address)
        _loop(studio, server, Journal(scrubber), ended)
        server.close()
    finally:
        capture.stop()
        jobs.close()
        for report in capture.reports():
            out.print(str(getattr(report, "path", report)))
    return 0


def _platform() -> tuple[str, str]:
    return platform.python_version(), platform.platform()


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


def _loop(studio: Studio, server: Server, journal: Journal, ended: threading.Event) -> None:
    before = time.monotonic()
    while not ended.is_set():
        now = time.monotonic()
        state = studio.tick(now - before)
        journal.note(state)
        server.render(state)
        before = now
        ended.wait(max(0.001, TICK_S - (time.monotonic() - now)))
