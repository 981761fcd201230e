"""The quick start is found where it is, with and without labels, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.calibration.heading import align
from handstudio.calibration.quick_start import candidates, labelled, quick_start
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import Span
from handstudio.simulation.worn import begin, sense, wear

NAMES = glove().names


def performed(motion: str, rate_hz: int = 100) -> tuple[ImuSamples, tuple[Span, ...]]:
    someone = subject(2)
    way = perform(motion, Actor(someone, 2))
    worn = wear(someone, glove(), parse("typical"), 2)
    time_us = 7_000_000 + np.arange(round(way.duration_s * rate_hz)) * (1_000_000 // rate_hz)
    sensed, _ = sense(worn, begin(worn), way, time_us - 7_000_000, rate_hz)
    samples = sensed.samples
    clocked = ImuSamples(time_us, *(getattr(samples, n) for n in ImuSamples.__slots__[1:]))
    return clocked, tuple(way.spans)


def turn_of(spans: tuple[Span, ...]) -> Span:
    return next(span for span in spans if span.name == "heading_rotation")


@pytest.mark.parametrize("before", ["", "tryout+", "open_close+", "elbow:rotation+"])
def test_it_is_found_without_labels_after_any_preamble(before):
    samples, spans = performed(f"{before}quick_start+open_close")
    _, place = quick_start(samples, NAMES)
    turn = turn_of(spans)
    assert place.turning[0] / 100 == pytest.approx(turn.start_s, abs=0.3)
    assert place.turning[1] / 100 == pytest.approx(turn.end_s, abs=0.3)
    assert place.after is not None


@pytest.mark.parametrize("rate_hz", [100, 500])
def test_found_and_labelled_give_the_same_headings(rate_hz):
    samples, spans = performed("quick_start", rate_hz)
    found, _ = quick_start(samples, NAMES)
    labels = [(span.start_s, span.end_s, span.name) for span in spans]
    by_label, place = quick_start(samples, NAMES, labels=labels)
    assert place.before == (0, 2 * rate_hz)
    off = np.array(found.psi_cor) - np.array(by_label.psi_cor)
    assert np.rad2deg(np.abs(off).max()) < 0.1
    parts = samples[: 2 * rate_hz], samples[2 * rate_hz : 4 * rate_hz], samples[4 * rate_hz :]
    assert by_label == align(*parts, NAMES)


def test_labels_without_rests_take_what_stands_before_the_turn():
    samples, spans = performed("quick_start")
    turn = turn_of(spans)
    (place,) = labelled(samples, [(turn.start_s, turn.end_s, turn.name)])
    assert (place.before, place.after) == ((0, 200), None)


def test_restless_hands_are_found_too():
    samples, _ = performed("quick_start~restless")
    found, _ = quick_start(samples, NAMES)
    assert np.rad2deg(found.turn) > 30.0


@pytest.mark.parametrize("motion", ["rest:10", "open_close", "index_pip:flexion"])
def test_a_recording_without_one_is_refused(motion):
    samples, _ = performed(motion)
    with pytest.raises(CalibrationError, match="No quick start"):
        quick_start(samples, NAMES)


def test_a_label_on_the_wrong_place_is_said():
    samples, _ = performed("rest:6")
    with pytest.raises(CalibrationError, match="turned by"):
        quick_start(samples, NAMES, labels=[(2.0, 4.0, "heading_rotation")])


def test_no_samples_hold_no_quick_start():
    samples, _ = performed("rest:1")
    assert not list(candidates(samples[:0]))
    with pytest.raises(CalibrationError, match="No quick start"):
        quick_start(samples[:0], NAMES)
