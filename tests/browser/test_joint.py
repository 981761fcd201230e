"""A joint by trackers in a real browser: a virtual finger is guided, a wrong file ends in words."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from .conftest import Start
from .page import button, field

pytestmark = pytest.mark.browser


@pytest.mark.long
def test_a_virtual_finger_is_guided_to_a_verdict_and_a_wrong_file_is_said(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    studio = start_studio("--connect", "virtual:")
    page = visit(studio, 1440, 900)
    expect(page.get_by_text("Connected")).to_be_visible()
    page.get_by_role("tab", name="Calibrate").click()
    page.get_by_text("Joint by trackers", exact=True).first.click()
    expect(button(page, "Find the joint")).to_be_disabled()
    button(page, "Try a virtual finger").click()
    expect(page.get_by_text("Hold the finger straight.")).to_be_visible()
    expect(page.get_by_text("Now bend and stretch it, all the way.")).to_be_visible()
    expect(page.get_by_text("The joint can be used.")).to_be_visible(timeout=120_000)
    expect(page.get_by_role("img", name=re.compile("^Axis of every turn"))).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Frames by their axis"))).to_be_visible()
    expect(page.get_by_text("the pale ball is round its Index DIP")).to_be_attached()
    button(page, "Close").click()
    expect(page.get_by_text("The joint can be used.")).not_to_be_visible()

    wrong = tmp_path / "wrong.csv"
    wrong.write_text("a,b\n1,2\n", encoding="utf-8")
    path = page.get_by_text("or path", exact=True).filter(visible=True)
    expect(path).to_be_visible()
    field(page, "or path").fill(str(wrong))
    field(page, "or path").press("Enter")
    page.wait_for_timeout(500)
    button(page, "Use the path").click()
    expect(page.get_by_text("it has no column time_s")).to_be_visible()
    expect(button(page, "Find the joint")).to_be_disabled()
