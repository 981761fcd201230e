"""Moving through a take."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.shown import review as reviewing
from app.shown.review import Review
from handstudio.errors import TakeError
from handstudio.pipeline import empty
from handstudio.recording.take import Take


def test_a_take_opens_at_its_beginning_and_paused(review: Review) -> None:
    assert review.at_s == 0.0
    assert not review.playing
    assert review.index == 0
    assert review.duration_s == pytest.approx(8.0, abs=0.05)
    assert len(review.seen.time_s) == len(review.seen.values)


def test_playing_takes_as_long_as_it_took(review: Review) -> None:
    playing = reviewing.toggled(review)
    for _ in range(60):
        playing = reviewing.advanced(playing, 1 / 60)
    assert playing.at_s == pytest.approx(1.0)
    twice = reviewing.advanced(replace(playing, speed=2.0), 0.5)
    assert twice.at_s == pytest.approx(2.0)


def test_it_stops_at_the_end_and_begins_again(review: Review) -> None:
    ended = reviewing.advanced(reviewing.toggled(review), 1e9)
    assert not ended.playing
    assert ended.index == len(review.time_s) - 1
    again = reviewing.toggled(ended)
    assert again.playing
    assert again.at_s == 0.0


def test_seeking_stays_within_the_take_and_pauses(review: Review) -> None:
    playing = reviewing.toggled(review)
    assert reviewing.sought(playing, -5.0).at_s == 0.0
    beyond = reviewing.sought(playing, 1e9)
    assert beyond.at_s == review.duration_s
    assert not beyond.playing


def test_stepping_there_and_back_is_no_step_at_any_instant(review: Review) -> None:
    for index in range(0, len(review.time_s) - 1, 7):
        here = reviewing.sought(review, float(review.time_s[index]))
        assert here.index == index
        assert reviewing.stepped(here, 1).index == index + 1
        assert reviewing.stepped(reviewing.stepped(here, 1), -1).at_s == here.at_s


def test_the_instant_shown_is_the_one_of_its_time(review: Review) -> None:
    here = reviewing.sought(review, 3.0)
    np.testing.assert_array_equal(
        here.instant.q_world_sensor[0], review.motion.q_world_sensor[here.index]
    )


def test_a_take_in_which_nothing_was_received_says_so(take: Take) -> None:
    with pytest.raises(TakeError, match="no instant"):
        reviewing.opened(take, empty(20))


def test_only_the_part_that_counts_is_played(review: Review) -> None:
    part = reviewing.marked_in(reviewing.sought(review, 2.0))
    part = reviewing.marked_out(reviewing.sought(part, 3.0))
    playing = reviewing.toggled(part)
    assert playing.at_s == 2.0, "from its begin, whose end we stand on"
    ended = reviewing.advanced(playing, 5.0)
    assert ended.at_s == 3.0
    assert not ended.playing
    looping = reviewing.advanced(replace(playing, loop=True), 5.0)
    assert looping.at_s == 2.0
    assert looping.playing
    assert reviewing.whole(part).end_s == review.duration_s


def test_a_part_never_ends_before_it_begins(review: Review) -> None:
    part = reviewing.marked_out(reviewing.sought(review, 2.0))
    part = reviewing.marked_in(reviewing.sought(part, 3.0))
    assert part.in_s == 3.0
    assert part.end_s == review.duration_s
    part = reviewing.marked_out(reviewing.sought(part, 1.0))
    assert part.in_s == 0.0
    assert part.end_s == 1.0
