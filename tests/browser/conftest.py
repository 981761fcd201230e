"""A real studio in a process of its own, and a real Chromium that looks at it."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

COMMAND = [sys.executable, "-c", "from handstudio.cli import main; main()"]

# Without a graphics card the page itself is drawn fastest by the processor; the scene alone needs
# WebGL, whose imitation takes both cores for a second a picture, twenty times as long where plots
# and text go through it too.
CHROMIUM_ARGUMENTS = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
    "--disable-accelerated-2d-canvas",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

# The scene is drawn only while `window.drawn` says so (page.look): whatever else a page does, it
# then does at once, and the studio beside it has a core for itself. Pictures not drawn leave the
# last one standing.
DRAW_WHEN_ASKED = """
(() => {
  const scene = WebGL2RenderingContext.prototype;
  const draw = ["drawArrays", "drawArraysInstanced", "drawElements", "drawElementsInstanced"];
  for (const name of ["clear", ...draw]) {
    const really = scene[name];
    scene[name] = function (...how) { if (window.drawn) really.apply(this, how); };
  }
})();
"""

expect.set_options(timeout=45_000)  # two busy cores


@dataclass(frozen=True)
class RunningStudio:
    """A studio that serves."""

    url: str
    sessions: Path
    process: subprocess.Popen[str]
    link: str = ""  # as it was told, with the token where one is needed

    @property
    def port(self) -> int:
        return int(self.url.rsplit(":", 1)[1])


Start = Callable[..., RunningStudio]


@pytest.fixture
def start_studio(tmp_path: Path) -> Iterator[Start]:
    """Start studios; they are ended, and must end well, when the test does."""
    running: list[RunningStudio] = []

    def start(
        *arguments: str,
        sessions: Path | None = None,
        language: str | None = "en",
        countdown_s: float | None = None,
        skin: bool = False,  # seconds a picture without a graphics card
    ) -> RunningStudio:
        if not (tmp_path / "settings.json").exists():
            remembered: dict[str, object] = {} if skin else {"shown": {"skin": False}}
            remembered |= {} if countdown_s is None else {"countdown_s": countdown_s}
            (tmp_path / "settings.json").write_text(json.dumps(remembered), encoding="utf-8")
        spoken = ["--language", language] if language is not None else []
        places = sessions or tmp_path / "sessions", tmp_path / "settings.json"
        studio = begin(*places, *spoken, *arguments)
        running.append(studio)
        return studio

    yield start
    for studio in running:
        end(studio)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=_chromium(), args=CHROMIUM_ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open pages; one that logs an error fails the test. Their scene is drawn when asked."""
    errors: list[str] = []
    contexts = []

    def open_page(
        studio: RunningStudio, width: int = 1280, height: int = 640, language: str = "en-US"
    ) -> Page:
        context = browser.new_context(
            viewport={"width": width, "height": height},
            device_scale_factor=0.5,  # a quarter of the pixels to draw; places are the same
            accept_downloads=True,
            locale=language,
        )
        contexts.append(context)
        page = context.new_page()
        page.add_init_script(DRAW_WHEN_ASKED)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(studio.url)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert errors == []


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk with room for almost nothing."""
    place = tmp_path / "tiny"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=45m", "tmpfs", str(place)]
    if shutil.which("mount") is None or subprocess.run(mount, check=False).returncode != 0:
        pytest.skip("only root can make a disk that is small")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def begin(sessions: Path, settings: Path, *arguments: str) -> RunningStudio:
    """A studio in a process of its own, once it serves."""
    command = [*COMMAND, "studio", "--no-browser", "--port", str(free_port())]
    process = subprocess.Popen(
        [*command, "--sessions", str(sessions), *arguments],
        env={**os.environ, "HANDSTUDIO_SETTINGS": str(settings)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    for line in process.stdout:
        found = re.search(r"http://[^\s/]+:(\d+)\S*", line)
        if found:
            url = f"http://localhost:{found[1]}"
            return RunningStudio(url, sessions, process, found[0])
    raise AssertionError("the studio ended before it served")


def end(studio: RunningStudio) -> None:
    """End it, if it has not ended yet; it must end well."""
    if studio.process.poll() is None:
        studio.process.send_signal(signal.SIGINT)
        studio.process.communicate(timeout=30)
    assert studio.process.returncode == 0


@contextmanager
def glove(port: int, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A virtual glove on TCP, its own process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "handstudio.device.virtual_glove", "--tcp", str(port), *arguments],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.readline()
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def _chromium() -> str | None:
    named = os.environ.get("HANDSTUDIO_CHROMIUM")
    return named or shutil.which("chromium") or shutil.which("google-chrome")
