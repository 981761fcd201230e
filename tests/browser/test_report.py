"""Reports as they are opened: from disk, without a network; and made on the page."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from app.report.make import report_of, report_path, save_report
from app.report.pdf import find_browser, save_pdf
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take

from .conftest import Start
from .page import button, choose

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = simulate(tmp_path_factory.mktemp("sessions"), rehearse(seed=5), seconds=9.0)
    return save_report(report_of(open_take(path)).html, report_path(path, "en"))


@pytest.fixture
def page(browser: Browser, report: Path) -> Iterator[Page]:
    """The report in a browser that has no network; errors and requests fail the test."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.on("request", lambda asked: wrong.append(asked.url) if asked.url[:5] != "file:" else None)
    page.goto(report.as_uri())
    yield page
    context.close()
    assert wrong == []


def drawn(page: Page) -> tuple[int, int]:
    """How many pixels of the hand are drawn, and a number that differs with the picture."""
    count, total = page.evaluate(
        """() => {
          const hand = document.getElementById("hand");
          const all = hand.getContext("2d").getImageData(0, 0, hand.width, hand.height).data;
          let count = 0, total = 0;
          for (let i = 3; i < all.length; i += 4) if (all[i]) { count++; total += i % 99991; }
          return [count, total];
        }"""
    )
    return int(count), int(total)


def test_a_report_opens_offline_and_its_hand_moves(page: Page) -> None:
    expect(page.get_by_role("heading", name="Active range of motion")).to_be_visible()
    before = drawn(page)
    assert before[0] > 2000
    clock = page.locator("#clock")
    began = clock.inner_text()
    page.get_by_role("button", name="Play").click()
    expect(clock).not_to_have_text(began)
    page.wait_for_timeout(800)
    page.get_by_role("button", name="Pause").click()
    assert drawn(page)[1] != before[1]
    page.locator("#at").fill("0")
    expect(clock).to_have_text("0.00 s")
    lines = page.locator("line.now")
    at, begin = (float(lines.first.get_attribute(name) or "nan") for name in ("x1", "data-x0"))
    assert at == begin


def test_its_hand_is_turned_by_dragging(page: Page) -> None:
    hand = page.locator("#hand")
    box = hand.bounding_box()
    assert box is not None
    before = drawn(page)
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 420, box["y"] + 230, steps=4)
    page.mouse.up()
    assert drawn(page)[1] != before[1]


def test_nothing_of_it_is_wider_than_the_page(page: Page) -> None:
    for width in (1440, 800):
        page.set_viewport_size({"width": width, "height": 900})
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= width


def test_it_is_printed_on_paper(report: Path, tmp_path: Path) -> None:
    if find_browser() is None:
        pytest.skip("no Chromium, Chrome or Edge on the path to print with")
    printed = save_pdf(report, tmp_path / "report.pdf").read_bytes()
    assert printed.startswith(b"%PDF-")
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 12


def test_a_take_is_measured_and_reported_on_the_page(
    start_studio: Start, visit: Callable[..., Page], tmp_path: Path
) -> None:
    sessions = tmp_path / "library"
    simulate(sessions, rehearse(seed=6), seconds=6.0, name="one")
    page = visit(start_studio(sessions=sessions), 1440, 900)
    page.get_by_role("tab", name="Review").click()
    choose(page, "^one · ")
    for other in ("VQF", "Nothing"):  # a hand beside it comes, and goes
        page.get_by_role("combobox", name="Compare with").click()
        page.get_by_role("option", name=re.compile(other)).first.click()
        expect(page.get_by_text("pale and dashed: VQF").first).to_be_visible(visible=other == "VQF")
    button(page, "Measure this part").click()
    expect(page.get_by_role("cell", name="Index PIP flexion")).to_be_visible()
    button(page, "All measures").click()
    expect(page.get_by_text("Active range of motion")).to_be_visible()
    button(page, "Close").click()
    with page.expect_download() as waiting:
        button(page, "Report").click()
    assert waiting.value.suggested_filename == "one.report.en.html"
    html = Path(waiting.value.path()).read_text(encoding="utf-8")
    assert "Report of a hand" in html
