"""The page in every state a user meets, in both languages; keys, looks, library, two pages."""

from __future__ import annotations

import json
import re
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app import words
from app.words import _
from handstudio.recording.notes import load_notes
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take

from .conftest import Start, free_port, glove
from .page import begin_recording, button, changed, choose, field, look, record

pytestmark = pytest.mark.browser

LOCALES = {"en": "en-US", "ja": "ja-JP"}


@pytest.fixture(params=["en", pytest.param("ja", marks=pytest.mark.long)])
def language(request: pytest.FixtureRequest) -> Iterator[str]:
    words.use_language(request.param)
    yield request.param
    words.use_language("en")


@pytest.fixture
def silent_port() -> Iterator[int]:
    """Something that takes a call and says nothing."""
    with closing(socket.socket()) as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield int(server.getsockname()[1])


def test_every_state_is_said(
    start_studio: Start, visit: Callable[..., Page], language: str, silent_port: int
) -> None:
    """From nothing to a take and a lost device; the language is the browser's."""
    studio = start_studio(language=language, countdown_s=5.0)  # long enough to be seen
    page = visit(studio, language=LOCALES[language])

    def sees(*texts: str) -> None:
        for text in texts:
            expect(page.get_by_text(text).filter(visible=True).first).to_be_visible()

    sees(_("No device"), _("Choose one under Device."))
    expect(button(page, _("Record"))).to_be_disabled()
    page.get_by_role("tab", name=_("Calibrate")).click()
    sees(_("Connect one under Device."), _("Joints and zero"))
    page.get_by_role("tab", name=_("Record")).click()
    sees(_("You are asked before the first take."))
    page.get_by_role("tab", name=_("Review")).click()
    sees(_("No takes yet: record one."))

    connect(page, f"tcp:127.0.0.1:{silent_port}")
    sees(_("Connecting"))
    sees(_("Not connected"))  # it never said who it is

    port = free_port()
    with glove(port, "--seed", "3") as device:
        connect(page, f"tcp:127.0.0.1:{port}")
        sees(_("Connected"))
        page.get_by_role("tab", name=_("Health")).click()
        sees(_("Byte to pose, 99 %"), "SN20")
        button(page, _("Record")).click()
        sees(_("Whose hand is it?"))
        button(page, _("Save and record")).click()
        sees(_("Space or R calls it off."))
        sees(_("Space or R ends it, M marks."))
        device.kill()
        sees(_("Device lost"), _("Trust: {word}").format(word=_("interrupted")))
        button(page, _("Stop")).first.click()
    sees(_("Replay · {name} · {subject}").format(name="take", subject="S01"))
    page.get_by_role("tab", name=_("Review")).click()
    sees(_("Zero of angles: {zero}").partition("{")[0].strip())


def test_hands_are_free_with_the_space_bar(start_studio: Start, visit: Callable[..., Page]) -> None:
    studio = start_studio("--virtual", countdown_s=4.0)
    page = visit(studio)
    expect(page.get_by_text("Connected")).to_be_visible()
    record(page, 0.5)  # says whose hand it is
    page.keyboard.press("l")
    expect(page.get_by_text("Live · Virtual glove")).to_be_visible()
    page.keyboard.press("Space")
    expect(page.get_by_text("Space or R calls it off.")).to_be_visible()
    expect(page.get_by_text("Space or R ends it, M marks.")).to_be_visible()
    page.wait_for_timeout(1000)
    page.keyboard.press("m")
    expect(page.get_by_text("marks: 1")).to_be_visible()
    page.keyboard.press("Space")
    expect(page.get_by_text("Replay · take-2")).to_be_visible()
    take = next(iter(studio.sessions.glob("*/*/take-2.mcap")))
    assert len(load_notes(take).marks) == 1
    page.keyboard.press("k")  # to the mark
    expect(page.get_by_text(re.compile(r"0:0[1-9]\.\d /"))).to_be_visible()
    page.keyboard.press("j")
    expect(page.get_by_text("0:00.0 /")).to_be_visible()
    page.keyboard.press("Space")
    expect(button(page, "Pause")).to_be_visible()


@pytest.mark.long
def test_looks_are_chosen_and_kept(start_studio: Start, visit: Callable[..., Page]) -> None:
    studio = start_studio("--virtual", skin=True)
    page = visit(studio, 1440, 900)
    expect(page.get_by_text("Connected")).to_be_visible()
    dark = look(page)
    page.get_by_text("Settings", exact=True).click()
    page.get_by_label("Light page").click()
    expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", "light")
    light = look(page)
    assert light.mean() > dark.mean() + 80
    page.mouse.click(660, 360)  # keys go to the field that was clicked last, until another is
    page.keyboard.press("5")
    page.keyboard.press("n")
    bare = look(page)
    page.keyboard.press("b")  # skin alone: nothing is seen through it
    page.wait_for_timeout(1500)
    assert changed(bare, look(page)) > 0.01
    page.keyboard.press("b")
    page.keyboard.press("g")
    page.wait_for_timeout(1000)
    studio.process.send_signal(signal.SIGINT)
    studio.process.communicate(timeout=30)
    kept = json.loads((studio.sessions.parent / "settings.json").read_bytes())
    assert (kept["shown"]["skin"], kept["shown"]["bones"]) == (False, True)
    assert (kept["theme"], kept["camera"], kept["shown"]["labels"]) == ("light", "follow", True)

    page = visit(start_studio("--virtual"))
    expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", "light")


@pytest.mark.long
def test_the_library_is_kept_tidy(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    sessions = tmp_path / "sessions"
    for name in ("reach", "grasp"):
        simulate(sessions, seconds=3.0, code="S07", name=name)
    page = visit(start_studio())
    page.get_by_role("tab", name="Review").click()
    expect(page.get_by_text("Takes: 2")).to_be_visible()
    field(page, "Search").fill("grasp")
    expect(page.get_by_text("Takes: 1 of 2")).to_be_visible()
    choose(page, "grasp")
    expect(page.get_by_text("Replay · grasp")).to_be_visible()

    page.get_by_text("Notes", exact=True).first.click()
    field(page, "Notes").fill("thumb hurts")
    page.get_by_text("Keep tidy").click()
    field(page, "New name").fill("pinch")
    button(page, "Rename the take").click()
    expect(page.get_by_text("Replay · pinch")).to_be_visible()
    (renamed,) = sessions.glob("*/*/pinch.mcap")
    assert load_notes(renamed).text == "thumb hurts"

    field(page, "Search").fill("")
    button(page, "Move to the bin").click()
    expect(page.get_by_text("Undo: moving pinch to the bin")).to_be_visible()
    assert not renamed.exists()
    page.get_by_text("Keep tidy").click(force=True)
    page.keyboard.press("Escape")
    page.keyboard.press("Control+z")
    expect(page.get_by_text("Taken back")).to_be_visible()
    assert renamed.exists()

    page.get_by_text("Keep tidy").click()
    button(page, "Delete a subject").click()
    expect(page.get_by_text("This cannot be taken back.")).to_be_visible()
    expect(button(page, "Delete for good")).to_be_disabled()
    field(page, "Type the code").fill("S07")
    button(page, "Delete for good").click()
    expect(page.get_by_text("No takes yet: record one.")).to_be_visible()
    assert not [path for path in sessions.rglob("*") if "S07" in path.name]


@pytest.mark.long
def test_two_pages_control_one_studio_and_are_told(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    studio = start_studio("--virtual")
    one, two = visit(studio, 900, 500), visit(studio, 900, 500)
    expect(one.get_by_text("2 pages are open")).to_be_visible()
    expect(two.get_by_text("2 pages are open")).to_be_visible()
    begin_recording(one)
    expect(button(two, "Stop").first).to_be_visible()
    two.keyboard.press("r")
    expect(one.get_by_text("Replay · take")).to_be_visible()
    two.close()
    expect(one.get_by_text("2 pages are open")).not_to_be_visible()


@pytest.mark.long
def test_the_browsers_language_is_spoken_and_another_can_be_chosen(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    studio = start_studio(language=None)
    page = visit(studio, language="ja-JP")
    expect(page.get_by_text("機器なし")).to_be_visible()
    page.get_by_text("設定", exact=True).click()
    page.get_by_role("combobox", name="言語").click()
    page.get_by_role("option", name="English").click()
    expect(page.get_by_text("No device").first).to_be_visible()
    expect(page.get_by_role("tab", name="Review")).to_be_visible()


@pytest.mark.long
def test_a_full_disk_begins_no_take(
    start_studio: Start, visit: Callable[..., Page], tiny_disk: Path
) -> None:
    page = visit(start_studio("--virtual", sessions=tiny_disk / "sessions"))
    expect(page.get_by_text("Connected")).to_be_visible()
    button(page, "Record").click()
    button(page, "Save and record").click()
    expect(page.get_by_text("is full: ")).to_be_visible()
    expect(page.get_by_text("Free some space")).to_be_visible()
    expect(button(page, "Record")).to_be_enabled()


@pytest.mark.long
def test_diagnostics_come_with_one_click(start_studio: Start, visit: Callable[..., Page]) -> None:
    page = visit(start_studio("--virtual"))
    expect(page.get_by_text("Connected")).to_be_visible()
    page.get_by_text("Settings", exact=True).click()
    with page.expect_download() as waiting:
        button(page, "Diagnostics").click()
    assert waiting.value.suggested_filename.endswith(".zip")
    assert Path(waiting.value.path()).read_bytes().startswith(b"PK")


@pytest.mark.long
def test_a_take_of_long_ago_is_computed_with_progress_and_opens(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    path = simulate(tmp_path / "sessions", seconds=240.0, code="S07", name="long")
    assert open_take(path).summary is not None
    page = visit(start_studio())
    page.get_by_role("tab", name="Review").click()
    choose(page, "long")
    expect(page.get_by_text("Computing the motion of long")).to_be_visible()
    expect(page.get_by_text("Replay · long")).to_be_visible()


def connect(page: Page, address: str) -> None:
    page.get_by_role("tab", name=_("Device")).click()
    field(page, _("or address")).fill(address)
    page.wait_for_timeout(300)
    button(page, _("Connect")).click()
