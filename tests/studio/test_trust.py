"""What is trusted now, in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app.shown.review import Review
from app.studio import Studio
from app.views import health as health_view
from app.views.trust import UNSURE_DEG, distrusted, surest_words
from handstudio.pipeline import Doubt, Motion

from .conftest import TICK_S, StillCapture


def _now(review: Review, sd_deg: float, **doubts: Doubt) -> Motion:
    """One instant, every sensor as sure as that, and some in doubt."""
    motion = review.motion[-1:]
    doubt = np.zeros_like(motion.doubt)
    for name, why in doubts.items():
        doubt[0, review.setup.layout.names.index(name)] = why
    sd = np.full(motion.sd_rad.shape, np.deg2rad(sd_deg), dtype=np.float32)
    return replace(motion, doubt=doubt, sd_rad=sd)


def test_each_reason_is_told_of_its_sensor_and_segment(review: Review) -> None:
    now = _now(
        review, 1.0, SN5=Doubt.SILENT | Doubt.UNPLACED, SN16=Doubt.SATURATED, SN20=Doubt.UNPLACED
    )
    now.sd_rad[0, 10, 1] = np.deg2rad(UNSURE_DEG + 1.0)
    told = {one.sensor: (one.segment, one.why) for one in distrusted(review.setup, now)}
    assert told == {
        "SN5": ("Little proximal", "not answering"),
        "SN11": ("Hand", "standard deviation 4.0°"),
        "SN16": ("Index middle phalanx", "at its limit"),
        "SN20": ("Thumb distal", "waits for half a second of rest"),
    }


def test_where_all_is_trusted_the_worst_figure_is_told(review: Review) -> None:
    now = _now(review, 1.25)
    assert distrusted(review.setup, now) == []
    assert "up to 1.2°" in surest_words(now) or "up to 1.3°" in surest_words(now)


def test_a_filter_that_does_not_tell_is_no_reason_for_doubt(review: Review) -> None:
    now = _now(review, np.inf)
    assert distrusted(review.setup, now) == []
    assert "does not tell" in surest_words(now)


def test_an_instant_after_a_gap_is_trusted(review: Review) -> None:
    assert distrusted(review.setup, _now(review, 1.0, SN1=Doubt.AFTER_GAP)) == []


def test_the_sheet_lists_them(streaming: Studio, capture: StillCapture, review: Review) -> None:
    capture.newest = replace(capture.newest, motion=_now(review, 1.0, SN5=Doubt.SATURATED))
    sheet = health_view.as_html(streaming.tick(TICK_S))
    assert "Little proximal" in sheet
    capture.newest = replace(capture.newest, motion=_now(review, 1.0))
    assert "Little proximal" not in health_view.as_html(streaming.tick(TICK_S))
