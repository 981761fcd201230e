"""From the device to the screen and into a file, as a newcomer does it."""

from __future__ import annotations

import csv
import io
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from .conftest import COMMAND, RunningStudio, Start
from .page import button, moves_within, record, scrub_to, settles_within

pytestmark = pytest.mark.browser


def test_the_live_hand_moves(start_studio: Start, visit: Callable[..., Page]) -> None:
    page = visit(start_studio("--virtual"), 1440, 900)
    expect(page.get_by_text("Live · Virtual glove")).to_be_visible()
    expect(page.get_by_text("Connected")).to_be_visible()
    page.wait_for_timeout(3000)  # the light comes up
    assert moves_within(page, 15.0)


def test_a_take_is_recorded_replayed_and_exported(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    studio = start_studio("--virtual")
    page = visit(studio, 1440, 900)
    expect(page.get_by_text("Connected")).to_be_visible()
    page.wait_for_timeout(4500)  # past the rest the showcase begins with
    record(page, 6.0)

    take = only(studio.sessions.glob("*/*/*.mcap"))
    assert settles_within(page, 10.0), "a paused take stands still"

    page.get_by_label("Loop").click()  # a picture may take as long as the take
    button(page, "Play").click()
    assert moves_within(page, 10.0)
    expect(page.get_by_text(re.compile(r"\d:(0[1-9]|[1-9]\d)\.\d / "))).to_be_visible()
    scrub_to(page, 0.5)

    page.get_by_role("tab", name="Review").click()
    with page.expect_download() as waiting:
        button(page, "Export CSV").click()
    downloaded = Path(waiting.value.path()).read_bytes()
    assert_same_as_the_shell_computes(studio, take, downloaded, tmp_path / "alone")

    page.get_by_role("combobox", name="Format").click()
    page.get_by_role("option", name="C3D (positions)").click()
    expect(page.get_by_role("combobox", name="Contents")).to_be_hidden()
    with page.expect_download() as waiting:
        button(page, "Export C3D").click()
    assert waiting.value.suggested_filename == f"{take.stem}.c3d"
    assert Path(waiting.value.path()).read_bytes() == take.with_suffix(".c3d").read_bytes()


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
