"""The language of motions: what it means, and what it says to what it does not understand."""

import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.catalogue import FAMILIES, motions
from handstudio.simulation.motions.language import parse, perform
from handstudio.simulation.motions.naming import resolve
from handstudio.simulation.motions.trials import JOINT_TRIALS
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import Trajectory

SOMEONE = subject(2)


def done(text: str, seed: int = 1, place: str = "") -> Trajectory:
    return perform(text, Actor(SOMEONE, seed, place=place))


def said(text: str) -> list[list[tuple[str, str, tuple[str, ...], int]]]:
    return [
        [(one.motion.name, one.argument, one.manners, one.times) for one in layers]
        for layers in parse(text)
    ]


def test_no_two_motions_have_one_name():
    names = [motion.name for family in FAMILIES for motion in family]
    assert len(names) == len(set(names))


def test_a_phrase_is_parts_of_layers_in_manners():
    assert said("static + 2*open_close~slow~small & elbow_moving:up") == [
        [("static", "", (), 1)],
        [("open_close", "", ("slow", "small"), 2), ("elbow_moving", "up", (), 1)],
    ]


def test_a_label_of_a_take_is_one_name():
    assert said("index_mcp:flexion~slow") == [[("index_mcp:flexion", "", ("slow",), 1)]]


def test_what_stands_in_quotes_is_leftas_it_is():
    assert said('rest:"60+&~"+rest: 5 ') == [
        [("rest", "60+&~", (), 1)],
        [("rest", "5", (), 1)],
    ]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", r"not understood from here on: '\(its end\)'"),
        ("static+", r"not understood from here on: '\(its end\)'"),
        ("static static", "not understood from here on: 'static'"),
        ("static|tumble", "not understood from here on: '|tumble'"),
        ('rest:"60', "not understood from here on"),
        ("Static", "not understood from here on: 'Static'"),
        ("juggling", "There is no motion 'juggling'"),
        ("index_mcp:rotation", "There is no motion 'index_mcp:rotation'"),
        ("static:5", "The motion static takes nothing behind a colon, and got '5'"),
        ("static~neat", "Nothing can be done in the manner 'neat'"),
        ("0*static", "A motion cannot be repeated 0 times"),
        ("1001*static", "A motion cannot be repeated 1001 times"),
    ],
)
def test_what_is_no_phrase_is_refused_where_it_goes_wrong(text, what):
    with pytest.raises(SetupError) as told:
        parse(text)
    assert what.replace("\\", "") in told.value.what
    assert told.value.remedy


def test_parts_follow_one_another_with_a_way_between():
    part = done("static+index_mcp:flexion+static")
    names = [(span.name, round(span.start_s, 2)) for span in part.spans]
    begins = dict(names[1:3])
    assert [name for name, _ in names] == ["static", "static", "index_mcp:flexion", "static"]
    assert 2.4 <= begins["static"] < 3.5  # lifted in between
    rates = part.derivatives(np.arange(0.0, part.duration_s, 0.01))[1]
    assert np.rad2deg(np.abs(rates[200:240]).max()) < 200.0


def test_layers_add_up():
    swing, elbow = done("index_mcp:flexion"), done("elbow_moving:up")
    both = done("index_mcp:flexion&elbow_moving:up")
    assert both.duration_s == max(swing.duration_s, elbow.duration_s)
    time_s = np.arange(0.0, swing.duration_s, 0.01)
    np.testing.assert_allclose(
        both.posture(time_s)[:, :-3], swing.posture(time_s)[:, :-3], atol=1e-9
    )
    assert np.ptp(both.posture(time_s)[:, -1]) > 0.05
    assert {span.name for span in both.spans} == {"static", "index_mcp:flexion", "work"}


def test_doing_it_again_is_not_doing_it_the_same_way():
    twice = done("2*index_mcp:flexion")
    first, second = (s for s in twice.spans if s.name == "index_mcp:flexion")
    time_s = np.arange(0.0, 8.0, 0.01)
    one, other = (twice.posture(span.start_s + time_s) for span in (first, second))
    assert np.abs(one - other).max() > 0.05
    in_a_row = done("index_mcp:flexion+index_mcp:flexion")
    first, second = (s for s in in_a_row.spans if s.name == "index_mcp:flexion")
    one, other = (in_a_row.posture(span.start_s + time_s) for span in (first, second))
    assert np.abs(one - other).max() > 0.05


def test_being_asked_a_second_time_is_another_performance():
    first, second = (done("index_mcp:flexion", place=place) for place in ("asked 1", "asked 2"))
    assert not np.array_equal(first.coefficients, second.coefficients)


def test_what_is_done_before_does_not_change_what_is_done_after():
    """A part is made from its place in the phrase, not from what others drew."""
    short, long = done("static+open_close"), done("tumble+open_close")
    one, other = (part.coefficients[:, -20:] for part in (short, long))
    np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("index mp flexion", "index_mcp:flexion"),
        ("Index MCP flexion", "index_mcp:flexion"),
        ("flexion/extension of the index finger MP joint", "index_mcp:flexion"),
        ("the index finger PIP joint, flexion/extension", "index_pip:flexion"),
        ("Thumb CM abduction", "thumb_cmc:abduction"),
        ("middle MP abduction/adduction", "middle_mcp:abduction"),
        ("pinky DIP flexion", "little_dip:flexion"),
        ("ulnar cm flexion", "ulnar_cmc:flexion"),
        ("wrist extension", "wrist:flexion"),
        ("Quick start", "quick_start"),
        ("open-close", "open_close"),
        (" rest:20 ", "rest:20"),
        ("2*static+showcase~slow", "2*static+showcase~slow"),
    ],
)
def test_people_may_say_it_in_their_words(typed, name):
    assert resolve(typed) == name


@pytest.mark.parametrize("name", [trial.name for trial in JOINT_TRIALS])
def test_every_label_is_found_in_plain_words(name):
    plain = name.replace("_", " ").replace(":", " ")
    assert resolve(plain) == name
    assert resolve(plain.upper().replace("MCP", "MP").replace("CMC", "CM")) == name


def test_every_motion_is_its_own_name():
    for name in motions():
        assert resolve(name) == name
    assert len({frozenset(name.replace(":", "_").split("_")) for name in motions()}) == len(
        motions()
    )


def test_a_motion_that_nobody_knows_is_told_with_the_nearest():
    with pytest.raises(SetupError, match="There is no motion 'indx mcp flexion'") as told:
        resolve("indx mcp flexion")
    assert "index_mcp:flexion" in told.value.remedy
    with pytest.raises(SetupError, match="There is no motion 'frobnicate'"):
        resolve("frobnicate")
