"""What a person does on the page, and sees of it."""

from __future__ import annotations

import io
import re
from contextlib import suppress

import numpy as np
import PIL.Image
from playwright.sync_api import Locator, Page, expect

from app.views.recording import clock_of

CENTRE = {"x": 340, "y": 240, "width": 650, "height": 390}  # between notices and transport


# A picture by the processor alone takes a second: one is drawn when it is looked at, no more.
DRAW_ONE = """new Promise(done => {
  window.drawn = true;
  requestAnimationFrame(() => requestAnimationFrame(() => { window.drawn = false; done(); }));
})"""


def look(page: Page) -> np.ndarray:
    """The centre of the page as pixels; its scene is drawn for that, and stands still else."""
    page.evaluate(DRAW_ONE)
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


def press_until(page: Page, name: str, seen: Locator) -> None:
    """Press a button; again, as a person does, where it was drawn anew beneath the pointer."""
    for _ in range(3):
        button(page, name).click()
        with suppress(AssertionError):
            expect(seen).to_be_visible(timeout=10_000)
            return
    expect(seen).to_be_visible()


def begin_recording(page: Page) -> None:
    """Press Record; the first time, say whose hand it is."""
    save, stop = button(page, "Save and record"), button(page, "Stop").first
    button(page, "Record").click()
    expect(save.or_(stop).first).to_be_visible()
    if save.is_visible():
        save.click()
    expect(stop).to_be_visible()
    ends = page.get_by_text("Space or R ends it").filter(visible=True)
    expect(ends).to_be_visible()  # the count is over


def end_recording(page: Page) -> None:
    """Press Stop; the take opens."""
    button(page, "Stop").first.click()
    expect(page.get_by_text("Replay ·")).to_be_visible()


def record(page: Page, seconds: float) -> None:
    begin_recording(page)
    page.wait_for_timeout(seconds * 1000)
    end_recording(page)


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


def choose(page: Page, name: str) -> None:
    """Pick a take in the list."""
    page.get_by_role("combobox", name="Take").click()
    page.get_by_role("option", name=re.compile(name)).first.click()


def field(page: Page, label: str) -> Locator:
    """The text field beside a label."""
    row = page.locator(f'label:text-is("{label}"):visible').locator("xpath=../../..")
    return row.locator("input, textarea").first
