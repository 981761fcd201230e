"""Layouts: the glove, parts of it, trees of other names, and what does not fit together."""

from __future__ import annotations

import msgspec
import pytest

from handstudio.errors import LayoutError
from handstudio.hand.skeleton import SEGMENTS
from handstudio.layout import JointPlace, Layout, SensorPlace, glove, with_hand_type

FOREARM_AND_HAND = ("SN1", "SN11")


def layout(
    sensors: dict[str, str], *joints: tuple[str, str, str, int], side: str = "unknown"
) -> Layout:
    places = tuple(SensorPlace(name, segment) for name, segment in sensors.items())
    return Layout(side, places, tuple(JointPlace(*joint) for joint in joints))


# --- the glove --------------------------------------------------------------------------------


def test_the_glove_is_the_one_of_the_specification():
    places = {place.sensor: place.segment for place in glove().sensors}
    assert list(places) == [f"SN{n}" for n in range(1, 21)]
    assert [places[f"SN{n}"] for n in (1, 2, 3)] == ["forearm"] * 3
    assert (places["SN11"], places["SN4"]) == ("hand", "hand_ulnar")
    rows = {"little": (5, 6, 7), "ring": (8, 9, 10), "middle": (12, 13, 14), "index": (15, 16, 17)}
    for finger, numbers in rows.items():
        bones = [f"{finger}_{bone}" for bone in ("proximal", "intermediate", "distal")]
        assert [places[f"SN{n}"] for n in numbers] == bones
    thumb = ["thumb_metacarpal", "thumb_proximal", "thumb_distal"]
    assert [places[f"SN{n}"] for n in (18, 19, 20)] == thumb


@pytest.mark.parametrize("side", ["right", "left"])
def test_every_segment_of_the_gloves_hand_has_a_sensor(side):
    assert set(glove(side).drivers) == set(SEGMENTS)
    assert glove(side).is_hand
    assert glove(side).missing_for_hand == ""


def test_of_the_three_on_the_forearm_the_first_defines_it():
    assert glove().drivers["forearm"] == 0
    assert glove("right", ["SN11", "SN2", "SN1"]).drivers["forearm"] == 1


def test_fewer_sensors_keep_their_order_and_are_a_hand_while_its_stem_is_there():
    few = glove("left", ["SN15", "SN11", "SN1"])
    assert few.names == ("SN15", "SN11", "SN1")
    assert few.is_hand
    for missing, segment in (("SN1", "forearm"), ("SN11", "hand")):
        rest = [name for name in FOREARM_AND_HAND if name != missing]
        part = glove("right", [*rest, "SN15"])
        assert not part.is_hand
        assert f"No sensor on {segment}" in part.missing_for_hand


def test_without_a_side_there_is_no_hand_and_it_says_why():
    assert not glove("unknown").is_hand
    assert "which hand" in glove("unknown").missing_for_hand


def test_a_sensor_the_glove_does_not_have_is_refused():
    with pytest.raises(LayoutError, match=r"no sensor SN21, XY\.\n.*Correct the layout"):
        glove("right", ["SN1", "SN21", "XY"])


# --- other trees ------------------------------------------------------------------------------


def test_names_are_free():
    door = layout({"A": "frame", "B": "door"}, ("hinge", "frame", "door", 1))
    assert door.drivers == {"frame": 0, "door": 1}
    assert not door.is_hand
    assert door.missing_for_hand != ""


def test_one_sensor_needs_no_joints():
    assert layout({"IMU": "body"}).drivers == {"body": 0}


def test_a_hand_with_a_joint_no_hand_has_is_not_shown_as_one():
    sensors = {"A": "forearm", "B": "hand"}
    odd = layout(sensors, ("third_wrist", "forearm", "hand", 2), side="right")
    assert not odd.is_hand
    assert "not a hand's" in odd.missing_for_hand


def test_a_layout_survives_json():
    for one in (glove("left"), layout({"A": "x", "B": "y"}, ("j", "x", "y", 3))):
        assert msgspec.json.decode(msgspec.json.encode(one), type=Layout) == one


# --- what does not fit ------------------------------------------------------------------------

CHAIN = (("j", "a", "b", 1), ("k", "b", "c", 2))

FAULTS = {
    "The layout has no sensors": ({}, ()),
    "Joint j appears 2 times": ({"A": "a"}, (("j", "a", "b", 1), ("j", "b", "c", 1))),
    "Sensor or joint j appears 2 times": ({"j": "a"}, (("j", "a", "b", 1),)),
    "Child segment b appears 2 times": ({"A": "a"}, (("j", "a", "b", 1), ("k", "c", "b", 1))),
    "A sits on d, which no joint joins": ({"A": "d"}, CHAIN),
    "Joint j has 4 axes, not 1, 2 or 3": ({"A": "a"}, (("j", "a", "b", 4),)),
    "Joint j has 0 axes": ({"A": "a"}, (("j", "a", "b", 0),)),
    "form a loop": ({"A": "a"}, (*CHAIN, ("l", "c", "a", 1))),
    "around a form a loop": ({"A": "a"}, (("j", "a", "a", 1),)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_does_not_fit_together_is_refused_with_a_remedy(fault):
    sensors, joints = FAULTS[fault]
    with pytest.raises(LayoutError, match=fault) as caught:
        layout(sensors, *joints)
    assert "docs/import.md" in caught.value.remedy


def test_two_sensors_of_one_name_are_refused():
    with pytest.raises(LayoutError, match="Sensor A appears 2 times"):
        Layout("unknown", (SensorPlace("A", "x"), SensorPlace("A", "y")), ())


def test_a_side_that_is_none_is_refused_and_not_taken_for_unknown():
    with pytest.raises(LayoutError, match=r"side.*'rigth'.*\n.*left.*right.*unknown"):
        layout({"A": "forearm", "B": "hand"}, side="rigth")


# --- hand types -------------------------------------------------------------------------------


def test_a_glove_without_a_sensor_on_the_ulnar_block_is_a_hand_of_one_block():
    few = glove("right", [*FOREARM_AND_HAND, "SN8"])
    assert glove().hand_type == 3
    assert few.hand_type == 1
    assert "ring_mcp" in {joint.name for joint in few.instrumented_joints}
    with pytest.raises(LayoutError, match="type 2 needs a sensor on hand_ulnar"):
        glove("right", few.names, 2)


@pytest.mark.parametrize("hand_type", [1, 2, 3])
def test_a_glove_can_be_any_type_and_turned_back(hand_type):
    typed = glove(hand_type=hand_type)
    assert typed.hand_type == hand_type
    assert typed.is_hand
    assert with_hand_type(glove(), hand_type) == typed
    assert with_hand_type(typed, 3) == glove()
    assert msgspec.json.decode(msgspec.json.encode(typed), type=Layout) == typed
    assert typed.drivers["hand"] == typed.names.index("SN11")


def test_a_tree_of_its_own_keeps_its_type():
    sensors = {"A": "forearm", "B": "hand", "C": "ring_proximal"}
    own = layout(
        sensors,
        ("wrist", "forearm", "hand", 2),
        ("ring_mcp", "hand", "ring_proximal", 2),
        side="right",
    )
    assert own.is_hand
    assert own.hand_type == 1
    with pytest.raises(LayoutError, match="tree of its own: its hand type is 1, not 3"):
        with_hand_type(own, 3)
