"""The last seconds of the live hand."""

from __future__ import annotations

import numpy as np
import pytest

from app.shown.channels import plots_of, values_of
from app.shown.live import SPAN_S, extended
from app.shown.review import Review


@pytest.mark.parametrize("piece", [1, 3, 17, 500])
def test_chunking_changes_nothing(review: Review, piece: int) -> None:
    whole = extended(None, review.setup, [review.motion])
    pieces = None
    for start in range(0, len(review.motion), piece):
        pieces = extended(pieces, review.setup, [review.motion[start : start + piece]])
    assert pieces is not None
    np.testing.assert_array_equal(whole.time_s, pieces.time_s)
    np.testing.assert_array_equal(whole.values, pieces.values)


def test_it_holds_the_last_seconds_only(review: Review) -> None:
    motion = review.motion
    history = None
    for turn in range(4):  # the same eight seconds, one after the other
        later = type(motion)(
            motion.time_us + turn * 8_000_000,
            motion.q_world_sensor,
            motion.q_world_start,
            motion.doubt,
            motion.sd_rad,
        )
        history = extended(history, review.setup, [later])
    assert history is not None
    assert history.time_s[-1] - history.time_s[0] <= SPAN_S
    assert history.time_s[-1] - history.time_s[0] > 0.9 * SPAN_S


def test_curves_and_values_belong_together(review: Review) -> None:
    plots = plots_of(review.setup.layout)
    count = sum(len(plot.curves) for plot in plots)
    assert values_of(review.setup, review.motion[:5]).shape == (5, count)
    assert {curve.label for curve in plots[0].curves} == {
        "thumb",
        "index",
        "middle",
        "ring",
        "little",
    }
