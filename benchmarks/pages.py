"""Pages that look at a studio: a small one that only takes in what is sent, and a real browser.

    python -m benchmarks.pages http://localhost:8865

The small page speaks as viser's own page does (`viser.infra`): it names its version as the
subprotocol, and says once where its camera is, from when on it counts as a page.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib.metadata import version
from urllib.parse import urlsplit

import msgspec
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

WITHIN_S = 60.0
"""How long a page may take to open on a busy machine."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")

SOFTWARE_RENDERING = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

_PROTOCOL = f"viser-v{version('viser')}"

_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, -1.0, 1.0),
    "fov": 1.3,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 900,
    "image_width": 1440,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


@dataclass
class Sent:
    """What a page was sent, known once it is closed; None where the page does not count."""

    messages_per_s: float | None = None  # one holds all that changed at a time
    kbytes_per_s: float | None = None
    longest_silence_ms: float | None = None


@contextmanager
def small_page(url: str) -> Iterator[Sent]:
    """A page in a process of its own that takes in every message, as fast as it can.

    Raises:
        RuntimeError: it got nothing.
    """
    sent = Sent()
    command = [sys.executable, "-m", "benchmarks.pages", url]
    page = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert page.stdout is not None
    try:
        if not page.stdout.readline():
            raise RuntimeError(f"no page could be opened at {url}")
        yield sent
        if page.poll() is not None:
            raise RuntimeError("the page closed by itself")
    finally:
        page.send_signal(signal.SIGTERM)
        said, _ = page.communicate()
    for name, value in json.loads(said).items():
        setattr(sent, name, value)


@contextmanager
def browser_page(url: str) -> Iterator[Sent]:
    """The page in a real browser that draws in software.

    Raises:
        RuntimeError: there is no browser, or it does not show the page.
    """
    try:
        from playwright.sync_api import Error, sync_playwright  # noqa: PLC0415 - a tool of tests
    except ImportError as error:
        raise RuntimeError("no playwright: pip install playwright") from error
    with sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(
                executable_path=_installed_browser(), args=SOFTWARE_RENDERING
            )
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.goto(url)
            page.get_by_text("Connected").wait_for(timeout=WITHIN_S * 1e3)
        except Error as error:
            raise RuntimeError(f"no browser shows the page: {error}") from error
        yield Sent()
        browser.close()


def _installed_browser() -> str | None:
    named = os.environ.get("HANDSTUDIO_CHROMIUM")
    return named or next((place for name in BROWSERS if (place := shutil.which(name))), None)


def main() -> None:
    """Be a page until somebody ends us; say when the first news came, and in the end how much."""
    url = urlsplit(sys.argv[1])
    origin, protocol = Origin(f"{url.scheme}://{url.netloc}"), Subprotocol(_PROTOCOL)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with connect(
        f"ws://{url.netloc}", origin=origin, subprotocols=[protocol], max_size=None
    ) as line:
        line.send(msgspec.msgpack.encode(_CAMERA))
        time.sleep(1.0)  # what is there already comes at once
        print("open", flush=True)
        print(json.dumps(asdict(_listen(line))), flush=True)


def _listen(line: Connection) -> Sent:
    began = before = time.monotonic()
    messages = size = 0
    longest_s = 0.0
    with suppress(KeyboardInterrupt):
        while True:
            size += len(line.recv())
            now = time.monotonic()
            messages, longest_s, before = messages + 1, max(longest_s, now - before), now
    seconds = before - began
    return Sent(
        round(messages / seconds, 1), round(size / seconds / 1e3, 1), round(longest_s * 1e3, 1)
    )


if __name__ == "__main__":
    main()
