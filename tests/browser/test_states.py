"""What the page says when something is missing, wrong, lost or interrupted."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from benchmarks.recordings import broad_folder, dfjimu_folder
from handstudio.recording.raw_import import import_folder
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take

from .conftest import Start, free_port, glove
from .page import begin_recording, button, choose, end_recording, field, moves_within, scrub_to

pytestmark = pytest.mark.browser


def test_without_a_device_it_says_what_to_do(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    page = visit(start_studio())
    expect(page.get_by_text("No device")).to_be_visible()
    expect(page.get_by_text("Choose one under Device.")).to_be_visible()
    expect(button(page, "Record")).to_be_disabled()
    button(page, "Connect").click()  # the virtual glove is always offered
    expect(page.get_by_text("Live · Virtual glove")).to_be_visible()
    button(page, "Disconnect").click()
    expect(page.get_by_text("No device")).to_be_visible()


@pytest.mark.long
def test_an_address_that_is_none_is_explained(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    page = visit(start_studio("--connect", "serial:/dev/nowhere"))
    expect(page.get_by_text("Not connected")).to_be_visible()
    expect(page.get_by_text("there is no such port")).to_be_visible()


def test_a_lost_device_is_shown_and_the_take_goes_on(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    port = free_port()
    with glove(port, "--seed", "3") as first:
        studio = start_studio("--connect", f"tcp:127.0.0.1:{port}")
        page = visit(studio)
        expect(page.get_by_text("Connected")).to_be_visible()
        begin_recording(page)
        page.wait_for_timeout(1500)
        first.kill()
        died = time.monotonic()
        page.get_by_text("Device lost").wait_for(state="visible")
        # the studio knows within a second (tests/device hold it to that); the rest is what a page
        # drawn in software on a busy machine takes to say it
        assert time.monotonic() - died < 8.0
        expect(page.get_by_text("The take goes on")).to_be_visible()
    with glove(port, "--seed", "3"):
        expect(page.get_by_text("Recording").first).to_be_visible()
        page.wait_for_timeout(1500)
        end_recording(page)
    takes = list(studio.sessions.glob("*/*/*.mcap"))
    assert len(takes) == 1
    summary = open_take(takes[0]).summary
    assert summary is not None
    assert summary.duration_s > 3.0
    assert summary.packets > 200


@pytest.mark.long
def test_ctrl_c_while_recording_keeps_the_take(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    studio = start_studio("--virtual")
    page = visit(studio)
    expect(page.get_by_text("Connected")).to_be_visible()
    begin_recording(page)
    page.wait_for_timeout(1500)
    page.close()  # a closed page ends nothing
    time.sleep(1.0)
    studio.process.send_signal(signal.SIGINT)
    output, _ = studio.process.communicate(timeout=30)
    takes = list(studio.sessions.glob("*/*/*.mcap"))
    assert len(takes) == 1
    assert str(takes[0]) in output
    summary = open_take(takes[0]).summary
    assert summary is not None
    assert summary.duration_s > 2.4


@pytest.mark.long
def test_an_interrupted_recording_can_be_had_back(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    take = simulate(tmp_path / "sessions", seconds=6.0, code="S07", name="broken")
    cut = take.with_name(take.name + ".recording")
    cut.write_bytes(take.read_bytes()[: take.stat().st_size // 2])
    take.unlink()
    page = visit(start_studio())
    page.get_by_role("tab", name="Review").click()
    choose(page, "broken")
    expect(page.get_by_text("this recording was interrupted")).to_be_visible()
    button(page, "Recover this recording").click()
    expect(page.get_by_text("Replay · broken-recovered")).to_be_visible()


@pytest.mark.long
def test_a_recording_without_a_hand_is_shown_and_says_what_is_missing(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    folder = tmp_path / "hinge"
    write_hinge(folder)
    import_folder(folder, tmp_path / "sessions", "rig")
    page = visit(start_studio())
    page.get_by_role("tab", name="Review").click()
    choose(page, "hinge")
    expect(page.get_by_text("no hand is shown")).to_be_visible()
    expect(page.get_by_text("Turn across the joint")).to_be_visible()


@pytest.mark.long
def test_on_a_narrow_page_the_plots_start_put_away(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    studio = start_studio("--virtual")
    wide, narrow = visit(studio, 1440, 900), visit(studio, 1024, 768)
    expect(wide.get_by_text("MCP flexion")).to_be_visible()
    expect(narrow.get_by_text("Connected")).to_be_visible()
    narrow.wait_for_timeout(1500)
    expect(narrow.get_by_text("MCP flexion")).not_to_be_visible()


@pytest.mark.long
@pytest.mark.real
def test_real_recordings_are_replayed(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path, data_dir: Path
) -> None:
    for kind, write in (("broad", broad_folder), ("dfjimu", dfjimu_folder)):
        trial = sorted((data_dir / kind).glob("*.mat"))[0]
        write(trial, tmp_path / kind)
        import_folder(tmp_path / kind, tmp_path / "sessions", "real")
    page = visit(start_studio(), 1440, 900)
    page.get_by_role("tab", name="Review").click()
    for kind, curve in (("broad", "IMU"), ("dfjimu", "Turn across the joint")):
        choose(page, kind)
        expect(page.get_by_text(f"Replay · {kind}")).to_be_visible()
        expect(page.get_by_text(curve).first).to_be_visible()
        scrub_to(page, 40.0)  # trials begin at rest
        button(page, "Play").click()
        assert moves_within(page, 10.0)
        button(page, "Pause").click()


def write_hinge(folder: Path) -> None:
    """Two sensors across a hinge, the second turning."""
    folder.mkdir()
    names = [f"{s}_{k}_{a}" for s in ("A", "B") for k in ("gyr", "acc") for a in "xyz"]
    rows = [",".join(["time_s", *names])]
    for i in range(300):
        turning = 0.5 if i > 100 else 0.0
        rows.append(f"{i * 0.01:.2f},0,0,0,0,0,9.81,{turning},0,0,0,0,9.81")
    (folder / "samples.csv").write_text("\n".join(rows), encoding="utf-8")
    (folder / "layout.toml").write_text(
        '[sensors]\nA = "upper"\nB = "lower"\n'
        '[[joints]]\nname = "hinge"\nparent = "upper"\nchild = "lower"\naxes = 1\n',
        encoding="utf-8",
    )


@pytest.mark.long
def test_a_virtual_person_does_what_is_asked_and_says_what_not(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    page = visit(start_studio("--connect", "virtual:?subject=7&motion=rest:600"))
    expect(page.get_by_text("Live · Virtual glove on person 7")).to_be_visible()
    page.get_by_role("tab", name="Device").click()
    asked = field(page, "or described")
    asked.fill("juggling")
    asked.press("Tab")
    button(page, "Do this now").click()
    expect(page.get_by_text("There is no motion 'juggling'")).to_be_visible()
    asked.fill("Index MP flexion")
    asked.press("Tab")
    button(page, "Do this now").click()
    assert moves_within(page, 15.0)
