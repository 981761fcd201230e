"""The studio's main loop: take in what happened, draw it, at most sixty times a second."""

from __future__ import annotations

import logging
import platform
import signal
import threading
import time
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from app import intents
from app.journal import Journal
from app.server import HOST, Server
from app.state import State
from app.studio import Studio
from app.work.jobs import Jobs
from app.work.preparing import Preparation
from handstudio import __version__
from handstudio.device.capture import Capture
from handstudio.device.orders import HeadingTaken, TakeDone
from handstudio.log import log_folder, logging_to
from handstudio.scrub import Scrubber
from handstudio.settings import SettingsStore
from handstudio.shell import err, out

_log = logging.getLogger("app")  # this module may be called __main__

TICK_S = 1.0 / 60.0

_PAUSE_S = 0.5  # after something that should not happen: the log is not to be filled with it


@dataclass(frozen=True, slots=True)
class Options:
    """How a studio is started.

    Attributes:
        sessions: Folder of the takes.
        address: A device to begin with.
        port: Port of the page, or where to begin looking for a free one.
        browser: Open the page.
        host: Where to serve.
        token: What visitors must know; see `Server`.
        language: To begin with; None: the one chosen before, the browser's or the system's.
    """

    sessions: Path
    address: str | None = None
    port: int = 8765
    browser: bool = True
    host: str = HOST
    token: str | None = None
    language: str | None = None


def run(options: Options) -> int:
    """Serve the studio until Ctrl-C; ends a take that is on, so that nothing is lost.

    Raises:
        HandstudioError: it cannot be served there.
    """
    scrubber = Scrubber()
    scrubber.sessions(options.sessions)
    scrubber.tokens(() if options.token is None else (options.token,))
    with logging_to(log_folder(), scrubber) as log:
        if log.problem:
            err.print(f"No log is kept: {log.folder} cannot be written ({log.problem}).")
        _log.info("handstudio %s on Python %s, %s", __version__, *_platform())
        code = _serve(options, scrubber)
        _log.info("ended")
        return code


def _serve(options: Options, scrubber: Scrubber) -> int:
    ended = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ended.set()

    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, end)
    capture, jobs, store = Capture(), Jobs(), SettingsStore.opened()
    capture.start()
    preparation: Preparation | None = None
    studio: Studio | None = None
    try:
        studio = Studio(capture, jobs, store, State(options.sessions), options.language)
        server = Server(studio, options.port, options.host, options.token)
        scrubber.tokens(server.door.secrets)
        _log.info("served %s", "with a token" if server.door.asks else "to this machine")
        _tell(server, options.sessions)
        if options.browser:
            webbrowser.open(server.browser_url())
        _begin(studio, options.address)
        preparation = Preparation()
        studio.prepare(preparation)
        _loop(studio, server, Journal(scrubber), ended)
        server.close()
    finally:
        capture.stop()
        if studio is not None:
            studio.end()
        jobs.close()
        if preparation is not None:
            preparation.close()
        store.flush()
        for report in capture.reports():
            if not isinstance(report, HeadingTaken):
                out.print(str(report.path if isinstance(report, TakeDone) else report))
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
        try:
            state = studio.tick(now - before)
            journal.note(state)
            server.render(state)
        except Exception:  # a page that cannot be drawn must not end a recording
            _log.exception("the page could not be drawn")
            ended.wait(_PAUSE_S)
        before = now
        ended.wait(max(0.001, TICK_S - (time.monotonic() - now)))
