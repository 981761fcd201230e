"""The open take smoothed, and beside another motion of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app import intents
from app.shown import comparison
from app.shown.comparison import SMOOTHED, compared, setup_of
from app.shown.review import Review, compared_with, panned, zoomed
from app.state import State
from app.studio import Studio
from app.views.comparison import choices, compared_ghost
from app.views.page import caption_of, curves_of
from handstudio.errors import HandstudioError
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.maths import so3
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.setup import FILTERS

from .conftest import TICK_S, after, done


@pytest.fixture
def kept(studio: Studio) -> Take:
    path: Path = simulate(studio.state.sessions, rehearse(seed=3), seconds=4.0)
    studio.refresh_takes()
    return open_take(path)


def _asked(studio: Studio, take: Take, *asked: intents.Intent) -> State:
    after(studio, intents.OpenTake(take.path))
    studio.tick(TICK_S)
    after(studio, *asked)
    return studio.tick(TICK_S)


def test_a_smoothed_take_stays_where_it_was(studio: Studio, kept: Take) -> None:
    state = _asked(studio, kept, intents.Seek(2.0), intents.MarkIn(), intents.Smooth(on=True))
    review = state.review
    assert review is not None
    assert review.smooth
    assert review.setup.smooth
    assert isinstance(review.setup.filter, TreeFilter)
    assert (review.at_s, review.in_s) == (2.0, 2.0)
    assert "smoothed" in caption_of(state)
    again = after(studio, intents.Smooth(on=False)).review
    assert again is not None
    assert again.setup == kept.header.setup
    np.testing.assert_array_equal(again.motion.q_world_sensor, process(kept).q_world_sensor)


SLOW = ("filter2", "filter3")  # as the thesis has them, a sample at a time
NAMES = [name for name in (*FILTERS, SMOOTHED) if name not in SLOW]
NAMES += [pytest.param(name, marks=pytest.mark.long) for name in SLOW]


@pytest.mark.parametrize("name", NAMES)
def test_a_second_hand_is_shown_with_its_curves_and_by_how_much_they_differ(
    studio: Studio, kept: Take, name: str
) -> None:
    state = _asked(studio, kept, intents.Compare(name))
    curves, ghost = curves_of(state), compared_ghost(state)
    assert curves is not None
    assert curves.second is not None
    assert curves.rms is not None
    assert curves.second.shape == curves.values.shape
    assert ghost is not None
    assert not ghost.beside
    assert choices()[name] in ghost.words
    assert choices()[name] in caption_of(state)
    if kept.header.setup.filter == FILTERS.get(name):
        assert (curves.rms == 0.0).all(), "with itself"
    assert after(studio, intents.Compare("")).review.comparison is None  # type: ignore[union-attr]


def test_the_figure_is_the_root_of_the_mean_square_of_what_is_seen(review: Review) -> None:
    turned = so3.multiply(so3.about_z(np.deg2rad(2.0)), review.motion.q_world_sensor)
    bent = replace(review.motion, q_world_sensor=np.array(review.motion.q_world_sensor))
    bent.q_world_sensor[400:, 0] = turned[400:, 0]  # the forearm's alone, from four seconds on
    other = compared_with(replace(review, compare="vqf"), review.setup, bent)
    assert other.seen.rms is not None
    assert 0.5 < np.nanmax(other.seen.rms) < 2.0
    early = panned(zoomed(other, 4.0), -9.0)
    assert early.to_s < 4.0
    assert early.seen.rms is not None
    assert np.nanmax(early.seen.rms) == 0.0


def test_the_second_hand_is_at_the_time_of_the_first(review: Review) -> None:
    late = review.motion[3:]
    second = compared("vqf", review.setup, late)
    np.testing.assert_array_equal(second.at(1.0).time_us, late.time_us[100:101])
    np.testing.assert_array_equal(second.at(1e9).time_us, late.time_us[-1:])


def test_what_cannot_be_computed_is_told_and_asked_for_no_more(
    studio: Studio, kept: Take, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails() -> None:
        raise HandstudioError("No.", "Do without.")

    _asked(studio, kept)
    monkeypatch.setattr(studio.jobs, "process", lambda _path, _setup=None: done(fails))
    studio.send(intents.Smooth(on=True))
    studio.send(intents.Compare("raw"))
    state = studio.tick(TICK_S)
    assert any("No." in message.text for message in state.messages)
    assert state.review is not None
    assert not state.review.smooth
    assert state.review.compare == ""


def test_parameters_of_the_takes_own_filter_are_kept(review: Review) -> None:
    own = review.setup
    assert setup_of("vqf", own) == own
    assert setup_of(SMOOTHED, own).smooth
    with pytest.raises(HandstudioError, match="no filter"):
        comparison.setup_of("none", own)
