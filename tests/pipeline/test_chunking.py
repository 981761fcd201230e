"""Cut anywhere, put away and resumed anywhere: the same motion, to the last bit."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio import pipeline
from handstudio.calibration.correction import CorrectionFilter
from handstudio.pipeline import Doubt, Motion
from handstudio.samples import Event, Gap, ImuSamples, Why
from handstudio.setup import Setup


@dataclass(frozen=True, repr=False)
class Case:
    """Events, and what is made of them all at once."""

    setup: Setup
    events: list[Event]
    motion: Motion
    packed: bytes  # the state after them


@pytest.fixture(scope="module")
def case(performance) -> Case:
    """All that can go wrong within seven seconds, and a device that begins anew."""
    samples = performance.samples
    valid, saturated = samples.valid.copy(), samples.saturated.copy()
    valid[:30, 3] = False  # answers late, so it is placed later than the others
    valid[220:232, 2] = False
    valid[240:300, 1] = False  # for long
    saturated[150:153, 1] = True
    samples = replace(samples, valid=valid, saturated=saturated)
    events: list[Event] = [
        samples[:20],
        Gap(Why.LOST, 1),
        samples[21:130],  # a rest does not reach over even the shortest gap
        Gap(Why.LOST, 12),
        samples[142:310],
        Gap(Why.LOST, 90),  # too long to be bridged; rest comes after it
        samples[400:520],
        Gap(Why.RESTART, 0, 2_345_678),
        anew(samples[520:], first_us=777),
    ]
    return whole(performance.setup, events)


@pytest.fixture(scope="module")
def corrected(case) -> Case:
    """The same with the thesis's filter of outputs before fusion."""
    return whole(msgspec.structs.replace(case.setup, correction=CorrectionFilter()), case.events)


def whole(setup: Setup, events: list[Event]) -> Case:
    motion, state = pipeline.run(setup, pipeline.begin(setup), events)
    return Case(setup, events, motion, pipeline.pack(setup, state))


def anew(samples: ImuSamples, first_us: int) -> ImuSamples:
    return replace(samples, time_us=samples.time_us - samples.time_us[0] + first_us)


def pieces(events: list[Event], cuts: list[int]) -> list[list[Event]]:
    """The events cut between instants, counted over all of them; gaps go with what follows."""
    out: list[list[Event]] = [[]]
    seen = 0
    for event in events:
        if isinstance(event, Gap):
            out[-1].append(event)
            continue
        inside = [cut - seen for cut in cuts if seen <= cut <= seen + len(event)]
        for k, (start, end) in enumerate(pairwise([0, *inside, len(event)])):
            if k > 0:
                out.append([])
            if end > start:
                out[-1].append(event[start:end])
        seen += len(event)
    return out


def same(a: Motion, b: Motion) -> None:
    for name in Motion.__slots__:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)


def in_pieces(case: Case, cuts: list[int]) -> tuple[Motion, bytes]:
    """Run piece by piece, the state put away and resumed before each."""
    setup = case.setup
    packed, motions = pipeline.pack(setup, pipeline.begin(setup)), []
    for piece in pieces(case.events, cuts):
        state = pipeline.unpack(setup, packed)
        assert pipeline.pack(setup, state) == packed
        motion, state = pipeline.run(setup, state, piece)
        motions.append(motion)
        packed = pipeline.pack(setup, state)
    return pipeline.join(motions), packed


def test_the_events_are_eventful(case):
    motion = case.motion
    assert len(motion) == sum(len(e) for e in case.events if isinstance(e, ImuSamples))
    for doubt in Doubt:
        assert (motion.doubt & doubt).any(), doubt
        assert not (motion.doubt & doubt).all(), doubt
    placed = (motion.doubt & Doubt.UNPLACED) == 0
    assert np.argmax(placed, axis=0).tolist() == [69, 69, 69, 78]
    assert placed[-1].all()


@settings(max_examples=40)
@given(cuts=st.lists(st.integers(0, 590), max_size=8).map(sorted))
def test_cutting_the_events_anywhere_changes_no_digit(case, cuts):
    motion, packed = in_pieces(case, cuts)
    same(motion, case.motion)
    assert packed == case.packed


@settings(max_examples=10)
@given(cuts=st.lists(st.integers(0, 590), max_size=8).map(sorted))
def test_nor_where_outputs_are_corrected_first(corrected, cuts):
    motion, packed = in_pieces(corrected, cuts)
    same(motion, corrected.motion)
    assert packed == corrected.packed


def test_one_instant_at_a_time_changes_no_digit(case):
    motion, packed = in_pieces(case, list(range(1, len(case.motion))))
    same(motion, case.motion)
    assert packed == case.packed


def test_whether_a_loss_was_announced_makes_no_difference(case):
    silent = [e for e in case.events if not (isinstance(e, Gap) and e.why is Why.LOST)]
    same(whole(case.setup, silent).motion, case.motion)


def test_nothing_in_nothing_out(case):
    motion, after = pipeline.run(case.setup, pipeline.unpack(case.setup, case.packed), [])
    assert len(motion) == 0
    assert motion.q_world_sensor.shape == (0, 4, 4)
    assert pipeline.pack(case.setup, after) == case.packed


def test_running_alters_neither_the_state_nor_the_events(case):
    setup, events = case.setup, case.events
    _, state = pipeline.run(setup, pipeline.begin(setup), events[:1])
    packed = pipeline.pack(setup, state)
    copies = deepcopy(events)
    pipeline.run(setup, state, events[1:])
    assert pipeline.pack(setup, state) == packed
    assert events == copies


def test_a_state_in_which_nobody_waits_for_a_rest_is_small(case):
    """It is saved with every take."""
    waiting = pipeline.run(case.setup, pipeline.begin(case.setup), case.events[:1])[1]
    assert len(waiting.recent) == 20
    assert len(pipeline.unpack(case.setup, case.packed).recent) == 0
