import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.recording import strokes as strokes_module
from handstudio.recording.strokes import kanji_strokes

COUNTS = {"同": 6, "志": 7, "社": 7, "大": 3, "あ": 3, "ア": 2, "A": 3, "O": 1, "7": 2}


@pytest.mark.parametrize("character", COUNTS)
def test_characters_have_their_strokes(character):
    strokes = kanji_strokes(character)
    assert len(strokes) == COUNTS[character]
    every = np.concatenate(strokes)
    assert -0.01 < every.min() < every.max() < 1.01
    assert np.ptp(every[:, 1]) > 0.5


def test_strokes_go_the_way_they_are_written_right_and_up():
    across, down_left, down_right = kanji_strokes("大")
    assert across[-1, 0] - across[0, 0] > 0.5
    for stroke, sign in ((down_left, -1.0), (down_right, 1.0)):
        way = stroke[-1] - stroke[0]
        assert sign * way[0] > 0.2
        assert way[1] < -0.3


def test_samples_are_even():
    for stroke in kanji_strokes("社"):
        steps = np.linalg.norm(np.diff(stroke, axis=0), axis=-1)
        assert np.median(steps) == pytest.approx(0.01, rel=0.2)
        assert steps.max() < 0.02


def test_what_nobody_wrote_down_is_refused():
    with pytest.raises(SetupError, match="How to write '\U0001f600' is not known"):
        kanji_strokes("\U0001f600")


def test_without_the_extra_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(strokes_module, "find_spec", lambda name: None)
    with pytest.raises(SetupError, match=r"handstudio\[writing\]"):
        kanji_strokes("大")
