"""A joint by trackers: a file or a virtual finger goes in, words and figures come out."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from app import intents
from app.state import State
from app.studio import Studio
from app.views import joint as view
from app.views.page import scene_of
from app.work.joint_work import (
    FINDABLE,
    Finger,
    JointAnswer,
    JointOrder,
    clusters_of,
    find_joint,
    off_truth_m,
    virtual_finger,
)
from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.methods import METHODS
from handstudio.trackers.study import study
from handstudio.trackers.track import Track

from .conftest import TICK_S, after

JOINT = "index_dip"
SHAPE = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.015, 0.0], [0.005, 0.005, 0.01]])


@pytest.fixture(scope="session")
def finger() -> Finger:
    return virtual_finger(JOINT, 7, lambda _share: None)


def table(upper: Track, lower: Track) -> str:
    """Both tracks as a file of poses."""
    head = ["time_s"]
    columns = [1e-6 * upper.time_us[:, None]]
    for name, track in (("up", upper), ("low", lower)):
        head += [f"{name}_{axis}_m" for axis in "xyz"] + [f"{name}_q{axis}" for axis in "wxyz"]
        columns += [track.t_room_terminal, track.q_room_terminal]
    rows = np.hstack(columns)
    lines = [",".join(f"{value:.7f}" for value in row) for row in rows]
    return "\n".join([",".join(head), *lines]) + "\n"


def trc(upper: Track, lower: Track) -> str:
    """Both tracks as four markers each, u1 to u4 and l1 to l4."""
    names = [f"{side}{k}" for side in "ul" for k in range(1, 5)]
    places = np.concatenate([_markers(upper), _markers(lower)], axis=1)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"120\t120\t{len(places)}\t8\tmm",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, 9) for axis in "XYZ"),
    ]
    for k, (at_us, row) in enumerate(zip(upper.time_us, places, strict=True)):
        cells = "\t".join(f"{1e3 * value:.4f}" for value in row.ravel())
        lines.append(f"{k + 1}\t{1e-6 * at_us:.5f}\t{cells}")
    return "\n".join(lines) + "\n"


def _markers(track: Track) -> Array:
    turned = so3.rotate(track.q_room_terminal[:, None], SHAPE)
    return np.asarray(0.5 + track.t_room_terminal[:, None] + turned)


def given(studio: Studio, name: str, content: str | None) -> State:
    """A file that was sent, once it was looked into."""
    sent = None if content is None else content.encode()
    state = after(studio, intents.GiveTracks(name, sent))
    ends = time.monotonic() + 20.0
    while state.joint.reading:
        assert time.monotonic() < ends
        time.sleep(0.005)
        state = studio.tick(TICK_S)
    return state


def found(studio: Studio, upper: str, lower: str, clusters: str = "") -> State:
    file = studio.state.joint.file
    assert file is not None
    order = JointOrder(file, upper, lower, JOINT, clusters)
    after(studio, intents.FindJoint(order))
    return studio.tick(TICK_S)


@pytest.fixture
def poses(studio: Studio, finger: Finger) -> State:
    return given(studio, "finger.csv", table(finger.upper, finger.lower))


def test_a_file_is_looked_into_and_its_terminals_are_offered(poses: State) -> None:
    assert poses.joint.file is not None
    assert view.terminals_of(poses.joint.file, "") == ("up", "low")
    assert "finger.csv: terminals up, low" in view.file_html(poses.joint)
    assert view.sheet_html(poses) == "", "nothing was asked for yet"


def test_the_verdict_has_figures_limits_centres_and_both_drawings(
    studio: Studio, poses: State
) -> None:
    state = found(studio, "up", "low")
    answer = state.joint.answer
    assert isinstance(answer, JointAnswer)
    assert answer.study.ok
    sheet = view.sheet_html(state)
    best = answer.study.found["rolling"]
    assert f"{1e3 * best.apart_m:.2f} mm apart (limit 3)" in sheet
    assert f"{1e3 * best.estimate.sd_m:.1f} mm (limit 2)" in sheet
    assert f"{1e3 * best.estimate.p_upper[2]:.1f} ±".replace("-", "−") in sheet
    assert sheet.count("<svg") == 2
    drawn = sheet.count('fill-opacity=".35"')
    assert drawn == len(answer.study.axis_cloud[::2])
    assert sheet.count("<rect") == np.count_nonzero(answer.study.class_counts)
    assert "No hand is shown" in sheet
    assert view.sheet_html(after(studio, intents.CloseJoint())) == ""


def test_markers_need_clusters_and_then_tell_the_same_joint(studio: Studio, finger: Finger) -> None:
    state = given(studio, "finger.trc", trc(finger.upper, finger.lower))
    clusters = "up=u1,u2,u3,u4; low = l1, l2, l3, l4;"
    assert view.terminals_of(state.joint.file, clusters) == ("up", "low")
    assert "write under clusters" in view.sheet_html(found(studio, "up", "low")).lower()
    answer = found(studio, "up", "low", clusters).joint.answer
    assert isinstance(answer, JointAnswer)
    straight = find_joint(_order(given(studio, "f.csv", table(finger.upper, finger.lower))), _quiet)
    ours, theirs = (each.study.found["rolling"].from_upper_m for each in (answer, straight))
    # a cluster's origin is the mean of its markers: both are the same place from the terminal's
    shift = so3.rotate(_rest_attitude(finger), SHAPE.mean(axis=0))
    np.testing.assert_allclose(ours + shift, theirs, atol=5e-4)


def _rest_attitude(finger: Finger) -> Array:
    return np.asarray(finger.upper.q_room_terminal[:300].mean(axis=0))


def _order(state: State) -> JointOrder:
    assert state.joint.file is not None
    return JointOrder(state.joint.file, "up", "low", JOINT)


def _quiet(_share: float) -> None:
    pass


# --- what is wrong is said ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", "x,y\n1,2\n", "a.csv: it has no column time_s"),
        ("a.csv", "", "a.csv"),
        ("a.pdf", "%PDF", "a.pdf: files of trackers end in"),
        ("a.trc", "nonsense", "a.trc: cannot be read"),
        ("/no/such/file.csv", None, "there is no such file"),
    ],
)
def test_a_wrong_file_is_said_where_it_was_given(
    studio: Studio, name: str, content: str | None, words: str
) -> None:
    state = given(studio, name, content)
    assert state.joint.file is None
    assert words in view.file_html(state.joint)
    assert "handstudio-" not in view.file_html(state.joint), "where it was put is nobody's matter"


@pytest.mark.parametrize(("upper", "lower"), [("up", "up"), ("up", "other"), ("", "")])
def test_one_terminal_is_no_joint(studio: Studio, poses: State, upper: str, lower: str) -> None:
    sheet = view.sheet_html(found(studio, upper, lower))
    assert "No joint was found: Index DIP" in sheet
    assert "A joint lies between two." in sheet
    assert "up, low" in sheet


def test_a_file_with_one_terminal_says_so(studio: Studio, finger: Finger) -> None:
    lines = table(finger.upper, finger.lower).splitlines()
    state = given(studio, "one.csv", "\n".join(",".join(each.split(",")[:8]) for each in lines))
    assert view.terminals_of(state.joint.file, "") == ("up",)
    assert "one.csv has the terminals up;" in view.sheet_html(found(studio, "up", "up"))


def _frozen(track: Track) -> Track:
    still = np.zeros(len(track.time_us), dtype=int)
    return Track(
        track.name,
        track.time_us,
        track.t_room_terminal[still],
        track.q_room_terminal[still],
        track.quality,
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda up, low: (low, up), "They seem swapped"),
        (lambda up, low: (up, _frozen(low)), "No joint was found"),
    ],
)
def test_swapped_and_frozen_terminals_end_in_words(
    studio: Studio,
    finger: Finger,
    change: Callable[[Track, Track], tuple[Track, Track]],
    words: str,
) -> None:
    # the transmitter is on the palm: of both terminals the lower one turns further
    given(studio, "bad.csv", table(*change(finger.upper, finger.lower)))
    state = found(studio, "up", "low")
    assert words in view.sheet_html(state)
    assert state.joint.working is False


def test_clusters_are_read_as_they_are_typed() -> None:
    assert clusters_of(" a = x,y , z;b=u,v,w; ") == {"a": ("x", "y", "z"), "b": ("u", "v", "w")}
    with pytest.raises(TrackError, match="names no markers"):
        clusters_of("a=x,y,z; b")


# --- a virtual finger -----------------------------------------------------------------------------


def test_a_virtual_finger_goes_through_the_course_live(studio: Studio, finger: Finger) -> None:
    state = after(studio, intents.TryVirtualFinger(JOINT, "rolling"))
    seen = []
    for _ in range(30 * 2):
        state = studio.tick(0.5)
        seen.append(view.sheet_html(state))
        if state.joint.answer is not None:
            break
    first = next(i for i, sheet in enumerate(seen) if "Hold the finger straight." in sheet)
    bent = next(i for i, sheet in enumerate(seen) if "Now bend and stretch it" in sheet)
    assert 5 <= bent - first <= 7, "three seconds"
    answer = state.joint.answer
    assert isinstance(answer, JointAnswer)
    assert 0.5 * (len(seen) - bent) == pytest.approx(20.0, abs=1.0)
    assert answer.off_m is not None
    assert answer.off_m < 0.004
    assert f"true centre is {1e3 * answer.off_m:.1f} mm from there" in seen[-1]


def test_how_far_it_is_from_the_truth_is_a_distance(finger: Finger) -> None:
    found = study(finger.upper, finger.lower, methods=(METHODS["rolling"],))
    here = off_truth_m(found, finger)
    assert here is not None
    away = Finger(JOINT, finger.upper, finger.lower, finger.t_room_centre + np.array([0, 0, 0.1]))
    there = off_truth_m(found, away)
    assert there is not None
    assert there == pytest.approx(0.1, abs=0.015)


def test_leaving_it_in_the_middle_leaves_nothing(studio: Studio) -> None:
    after(studio, intents.TryVirtualFinger(JOINT, "rolling"))
    for _ in range(4):
        studio.tick(0.5)
    state = after(studio, intents.CloseJoint())
    assert view.sheet_html(state) == ""
    for _ in range(60):
        state = studio.tick(0.5)
    assert state.joint.answer is None


@pytest.mark.parametrize("joint", FINDABLE)
def test_every_joint_on_offer_has_a_name_of_its_own(joint: str) -> None:
    assert view.joint_names()[view.joint_name(joint)] == joint
    assert len(view.joint_names()) == len(FINDABLE) == 14


def test_the_halo_is_round_the_joint_of_the_hand_and_as_large_as_the_doubt(
    streaming: Studio, finger: Finger
) -> None:
    given(streaming, "finger.csv", table(finger.upper, finger.lower))
    state = found(streaming, "up", "low")
    hand = scene_of(state)
    assert hand is not None
    halo = view.halo_of(state, hand)
    assert halo is not None
    assert isinstance(state.joint.answer, JointAnswer)
    sd = state.joint.answer.study.found["rolling"].estimate.sd_m
    assert halo.words == f"Index DIP ± {1e3 * sd:.1f} mm"
    assert sd < halo.radius_m < sd + 0.02
    assert "is not known" in view.sheet_html(state)
    assert view.halo_of(state, None) is None
    during = after(streaming, intents.BeginCourse("quick_start"))
    assert during.guided is not None
    assert view.sheet_html(during) == "", "its sheet stands in the same place"
    assert view.halo_of(after(streaming, intents.CloseJoint()), hand) is None
