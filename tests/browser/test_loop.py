"""From the device to the screen and into a file, as a newcomer does it."""

from __future__ import annotations

import csv
import io
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from playwright.sync_api import Locator, Page, expect

from app.view import clock_of

from .conftest import COMMAND, RunningStudio, Start

pytestmark = pytest.mark.browser

CENTRE = {"x": 340, "y": 240, "width": 650, "height": 390}  # between notices and transport


def look(page: Page) -> np.ndarray:
    """The centre of the page as pixels."""
    shot = page.screenshot(clip=CENTRE)  # type: ignore[arg-type]
    return np.asarray(PIL.Image.open(io.BytesIO(shot)).convert("RGB"), dtype=float)


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """Share of the pixels that clearly differ."""
    return float((np.abs(before - after).max(axis=-1) > 40).mean())


def moves_within(page: Page, seconds: float) -> bool:
    """Whether the picture changes clearly in that time."""
    before = look(page)
    for _ in range(int(seconds * 2)):
        page.wait_for_timeout(500)
        if changed(before, look(page)) > 0.01:
            return True
    return False


def settles_within(page: Page, seconds: float) -> bool:
    """Whether the picture comes to rest in that time."""
    before = look(page)
    for _ in range(int(seconds)):
        page.wait_for_timeout(1000)
        now = look(page)
        if changed(before, now) < 0.001:
            return True
        before = now
    return False


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def record(page: Page, seconds: float) -> None:
    button(page, "Record").click()
    expect(button(page, "Stop")).to_be_visible()
    page.wait_for_timeout(seconds * 1000)
    button(page, "Stop").click()
    expect(page.get_by_text("Replay ·")).to_be_visible()


def test_the_live_hand_moves(start_studio: Start, visit: Callable[..., Page]) -> None:
    page = visit(start_studio("--virtual"))
    expect(page.get_by_text("Live · Virtual glove")).to_be_visible()
    expect(page.get_by_text("Connected")).to_be_visible()
    page.wait_for_timeout(3000)  # the light comes up
    assert moves_within(page, 15.0)


def test_a_take_is_recorded_replayed_and_exported(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    studio = start_studio("--virtual")
    page = visit(studio)
    expect(page.get_by_text("Connected")).to_be_visible()
    page.wait_for_timeout(4500)  # past the rest the showcase begins with
    record(page, 4.0)

    take = only(studio.sessions.glob("*/*/*.mcap"))
    assert settles_within(page, 10.0), "a paused take stands still"

    button(page, "Play").click()
    assert moves_within(page, 5.0)
    expect(page.get_by_text(re.compile(r"\d:(0[1-9]|[1-9]\d)\.\d / "))).to_be_visible()
    scrub_to(page, 0.5)

    page.get_by_role("tab", name="Review").click()
    with page.expect_download() as waiting:
        button(page, "Export CSV").click()
    downloaded = Path(waiting.value.path()).read_bytes()
    assert_same_as_the_shell_computes(studio, take, downloaded, tmp_path / "alone")


def scrub_to(page: Page, at_s: float) -> None:
    """Type a time of the take; the clock follows."""
    numbers = [
        field
        for field in page.locator("input:visible").all()
        if re.fullmatch(r"\d+(\.\d+)?", field.input_value())
    ]
    field = numbers[-1]  # the slider's own: the transport comes last on the page
    # the page's number field passes over the first input after its value was set from outside
    for text in (f"{at_s + 1.0}", f"{at_s}"):
        field.fill(text)
        field.press("Enter")
        page.wait_for_timeout(300)
    expect(page.get_by_text(f"{clock_of(at_s)} / ")).to_be_visible()


def assert_same_as_the_shell_computes(
    studio: RunningStudio, take: Path, downloaded: bytes, alone: Path
) -> None:
    alone.mkdir()
    copy = Path(shutil.copy(take, alone))  # without the motion kept beside it: computed anew
    subprocess.run(
        [*COMMAND, "process", str(copy), "--csv", "--json"], check=True, capture_output=True
    )
    computed = copy.with_suffix(".angles.csv").read_bytes()
    assert downloaded == computed
    assert take.with_suffix(".angles.csv").read_bytes() == computed
    rows = list(csv.DictReader(io.StringIO(downloaded.decode())))
    assert float(rows[-1]["time_s"]) > 3.0
    assert max(abs(float(row["index_mcp_flexion_deg"])) for row in rows) > 5.0
    assert studio.process.poll() is None


def only(paths: object) -> Path:
    found = list(paths)  # type: ignore[call-overload]
    assert len(found) == 1, found
    return Path(found[0])
