"""Guided courses in a real browser: the virtual person does them alone, a sloppy one is refused."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from handstudio.recording.notes import load_notes

from .conftest import RunningStudio, Start, free_port, glove
from .page import button, press_until

pytestmark = pytest.mark.browser

REFUSALS = 3  # of the whole course: people of typical sensors are now and then refused

WHOLE_S = 1500.0  # at twice the pace, drawn in software on busy cores


def begin(
    start_studio: Start, visit: Callable[..., Page], address: str
) -> tuple[RunningStudio, Page]:
    """The course of the hand, begun; asked whose hand it is."""
    studio = start_studio("--connect", address)
    page = visit(studio, 1024, 768)
    expect(page.get_by_text("Connected")).to_be_visible()
    page.get_by_role("tab", name="Calibrate").click()
    button(page, "Begin: Hand").click()
    expect(page.get_by_text("Whose hand is it?")).to_be_visible()
    button(page, "Save and begin").click()
    expect(page.get_by_text(re.compile(r"Step \d+ of 32"))).to_be_visible()
    return studio, page


def labels(studio: RunningStudio, name: str = "calibration") -> list[str]:
    (take,) = studio.sessions.glob(f"*/*/{name}.mcap*")
    return [label.label for label in load_notes(Path(str(take).removesuffix(".recording"))).labels]


def test_the_first_steps_are_done_alone_and_gone_on_with_later(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    studio, page = begin(start_studio, visit, "virtual:?subject=7&imperfections=typical&speed=2")
    expect(page.get_by_text("Step 5 of 32")).to_be_visible(timeout=120_000)
    assert labels(studio)[:4] == ["fit", "static", "heading_rotation", "static"]
    press_until(page, "Leave", page.get_by_text("The course waits under Calibrate"))
    # what every take begins with belongs to that take: nothing of this one is gone on with
    expect(button(page, "Begin: Hand")).to_be_visible()
    expect(button(page, "Record")).to_be_enabled()


@pytest.mark.long
def test_hands_are_free_with_the_space_bar(start_studio: Start, visit: Callable[..., Page]) -> None:
    _studio, page = begin(start_studio, visit, "virtual:?subject=7&speed=2")
    page.get_by_label("Go on by itself").click()  # it does with a virtual glove
    page.wait_for_timeout(3000)  # a verdict that was there before is gone by now
    on = button(page, "Next")
    expect(on).to_be_visible()
    page.mouse.click(600, 120)  # keys go to the field that was clicked last, until another is
    page.keyboard.press("Space")
    expect(page.get_by_text("Space begins.")).to_be_visible()
    expect(on).not_to_be_visible()
    page.wait_for_timeout(600)  # twice at once is once: the space bar also presses a button
    page.keyboard.press("Space")
    expect(page.get_by_text("Space begins.")).not_to_be_visible()
    expect(on).to_be_visible()


@pytest.mark.long
def test_a_sloppy_one_is_refused_with_the_reason(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    address = "virtual:?subject=7&motion=static~small&speed=2"
    _studio, page = begin(start_studio, visit, address)
    page.get_by_label("Go on by itself").click()  # nor does it get to a refusal of step 3 by itself
    page.get_by_role("combobox", name="Step").click()
    page.get_by_role("option", name="5. Elbow: flexion").click()
    button(page, "Do this step again").click()
    expect(page.get_by_text("Step 5 of 32")).to_be_visible()
    button(page, "Begin").click()
    reason = page.get_by_text(re.compile(r"Swung by \d+°, 42° wanted: swing further\.")).first
    expect(reason).to_be_visible(timeout=120_000)
    expect(page.get_by_text("Not good enough.")).to_be_visible()
    expect(page.get_by_text("Place and axis of this joint then lean on")).to_be_visible()
    button(page, "Use it all the same").click()
    expect(page.get_by_text("used all the same")).to_be_visible()


@pytest.mark.long
def test_a_device_lost_in_the_middle_begins_the_step_anew(
    start_studio: Start, visit: Callable[..., Page]
) -> None:
    port = free_port()
    slowly = ("--subject", "7", "--motion", "static", "--speed", "0.2")
    with glove(port, *slowly) as first:
        studio, page = begin(start_studio, visit, f"tcp:127.0.0.1:{port}")
        expect(page.get_by_text("Step 2 of 32")).to_be_visible(timeout=120_000)
        expect(button(page, "Begin")).not_to_be_visible()  # it is counted: a step not begun goes on
        first.kill()
        expect(page.get_by_text("This step begins anew once it is back.")).to_be_visible()
    with glove(port, "--subject", "7", "--motion", "static"):
        expect(page.get_by_text("Step 3 of 32")).to_be_visible(timeout=120_000)
    assert labels(studio)[:2] == ["fit", "static"]


@pytest.mark.long
def test_the_whole_course_runs_by_itself(start_studio: Start, visit: Callable[..., Page]) -> None:
    studio, page = begin(start_studio, visit, "virtual:?subject=7&imperfections=typical&speed=2")
    refusals, ends = 0, time.monotonic() + WHOLE_S
    over = page.get_by_text(re.compile(r"^(Calibrated|No calibration|Computing the calibration …)"))
    refused = page.get_by_text("Not good enough.")
    while not over.first.is_visible():
        assert time.monotonic() < ends
        if refused.is_visible():
            refusals += 1
            assert refusals <= REFUSALS, page.locator("body").inner_text()
            button(page, "Repeat").first.click()
            expect(refused).not_to_be_visible()
        page.wait_for_timeout(500)
    done = labels(studio)
    assert len(set(done)) == 31  # the rest before and after the turn is called the same
    assert done.count("static") >= 28
    expect(page.get_by_text(re.compile(r"^Calibrated")).first).to_be_visible(timeout=300_000)
    button(page, "Close").click()
    expect(button(page, "Begin: Hand")).to_be_visible()
