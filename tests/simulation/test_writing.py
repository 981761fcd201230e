"""What a pen writes, from the true segments alone, against what was to be written."""

from itertools import pairwise

import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.maths import so3
from handstudio.recording.strokes import kanji_strokes
from handstudio.simulation.motions.actor import Actor, Material
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.pen import HeldPen, held_pen
from handstudio.simulation.motions.writing import HEIGHT_M
from handstudio.simulation.placing import TURNS, limits
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import DEVELOPMENT, REPORTING, subject
from handstudio.simulation.things import Things, things_held
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World

EVERY_US = 4000


def box(character: str) -> list[np.ndarray]:
    """Two strokes without any package: an L with a corner, and a bar across."""
    if character not in "xyz":
        return kanji_strokes(character)
    corner = np.array([[0.2, 0.8], [0.2, 0.2], [0.8, 0.2]])
    return [corner, np.array([[0.1, 0.5], [0.9, 0.5]])]


def written(text: str, number: int = 3, side: str = "right", world: World | None = None, seed=1):
    """The motion, when, and where segments and the pen truly were."""
    world = World() if world is None else world
    someone = subject(number, side)
    trajectory = perform(f'writing:"{text}"', Actor(someone, seed, Material(box), world=world))
    time_us = np.arange(0, int(trajectory.duration_s * 1e6), EVERY_US)
    _, segments = hand_at(someone, trajectory, time_us * 1e-6, world)
    truth = things_held(trajectory, time_us, segments.q, segments.t)
    return trajectory, time_us * 1e-6, segments, truth


def pen_of(trajectory: Trajectory) -> HeldPen:
    (pen,) = (span.held for span in trajectory.spans if span.held is not None)
    return pen


def on_paper(truth: Things, world: World) -> np.ndarray:
    """The trace as the writer sees it [m]."""
    trace = so3.rotate(so3.conjugate(world.q_world_start), truth.t_world_held)
    return trace[truth.pen_down, :2]


def asked(text: str) -> np.ndarray:
    """The strokes as one cloud [m], in squares side by side."""
    strokes = [s + np.array([1.1 * i, 0.0]) for i, c in enumerate(text) for s in kanji_strokes(c)]
    return HEIGHT_M * np.concatenate(strokes)


def aligned(trace: np.ndarray, cloud: np.ndarray) -> tuple[np.ndarray, float]:
    """Distances of a trace to the nearest of a cloud after the best similarity, and its scale."""
    moved, scale = trace - trace.mean(0) + cloud.mean(0), 1.0
    for _ in range(30):
        apart = np.linalg.norm(moved[:, None] - cloud[None], axis=-1)
        nearest = cloud[apart.argmin(axis=1)]
        a, b = moved - moved.mean(0), nearest - nearest.mean(0)
        u, s, vt = np.linalg.svd(b.T @ a)
        turn = u @ vt
        factor = float(s.sum() / np.sum(a**2))
        moved, scale = factor * a @ turn.T + nearest.mean(0), scale * factor
    return np.linalg.norm(moved - nearest, axis=-1), scale


@pytest.fixture(scope="module")
def four():
    return written("同志社大")


@pytest.mark.long
def test_four_characters_are_legible(four):
    """Every point of the trace lies on a stroke that was asked for, and none was left out."""
    truth, cloud = four[3], asked("同志社大")
    trace = on_paper(truth, World())
    off, scale = aligned(trace[::4], cloud)
    assert np.sqrt(np.mean(off**2)) < 0.0005
    assert scale == pytest.approx(1.0, abs=0.02)
    missing, _ = aligned(cloud, trace[::4])
    assert np.sqrt(np.mean(missing**2)) < 0.0005
    assert np.ptp(trace[:, 0]) == pytest.approx(np.ptp(cloud[:, 0]), abs=0.001)


def test_the_pen_touches_the_paper_in_strokes_and_leaves_it_between(four):
    trajectory, _, _, truth = four
    pen = pen_of(trajectory)
    height = truth.t_world_held[:, 2] - pen.desk_m
    assert np.nanmin(height) > -0.00002
    assert 0.004 < np.nanmax(height) < 0.009
    starts = np.count_nonzero(np.diff(truth.pen_down.astype(int)) == 1)
    assert starts == sum(len(kanji_strokes(c)) for c in "同志社大")
    still_down = height[truth.pen_down]
    assert np.percentile(np.abs(still_down), 80) < 0.00001  # the rest is coming and going


def test_a_pen_runs_at_a_human_pace(four):
    _, time_s, _, truth = four
    speed = np.linalg.norm(np.gradient(truth.t_world_held, time_s, axis=0), axis=-1)
    assert 0.03 < np.nanmean(speed[truth.pen_down]) < 0.08
    assert np.nanmax(speed[truth.pen_down]) < 0.30


def test_three_fingertips_hold_it_without_slipping(four):
    trajectory, time_s, segments, truth = four
    pen = pen_of(trajectory)
    held = np.isfinite(truth.t_world_held[:, 0])
    skin = pen.skin(segments.q[held], segments.t[held])
    contacts = so3.rotate(truth.q_world_held[held][:, None], pen.contacts)
    slip = np.linalg.norm(skin - contacts - truth.t_world_held[held][:, None], axis=-1)
    assert slip.max() < 5e-6
    np.testing.assert_allclose(np.hypot(*pen.contacts.T[:2]), pen.radius_m, atol=5e-5)
    assert (np.abs(pen.contacts[:, 2] - 0.030) < 0.010).all()
    whole = next(span for span in trajectory.spans if span.held is pen)
    np.testing.assert_array_equal(held, (whole.start_s <= time_s) & (time_s <= whole.end_s))


def test_joints_stay_in_their_range_and_do_not_jump(four):
    trajectory, time_s, _, _ = four
    least, most = limits(subject(3))
    posture, rate, acceleration = trajectory.derivatives(time_s)
    assert (posture >= least - 1e-9).all()
    assert (posture <= most + 1e-9).all()
    assert np.rad2deg(np.abs(rate[:, :TURNS]).max()) < 400.0
    assert np.rad2deg(np.abs(acceleration[:, :TURNS]).max()) < 8000.0


def test_four_characters_take_no_other_place_of_the_elbow(four):
    trajectory, time_s, _, _ = four
    np.testing.assert_array_equal(trajectory.posture(time_s)[:, TURNS:], 0.0)


def test_characters_are_named_in_their_order(four):
    spans = four[0].spans
    assert [span.name for span in spans] == [*"同志社大", "writing:同志社大"]
    assert all(a.end_s <= b.start_s for a, b in pairwise(spans[:4]))


@pytest.mark.long
def test_a_left_hand_writes_the_same_text():
    *_, truth = written("大", 5, "left")
    off, _ = aligned(on_paper(truth, World())[::4], asked("大"))
    assert np.sqrt(np.mean(off**2)) < 0.0005


@pytest.mark.long
def test_a_long_text_moves_the_elbow_along_and_to_the_next_line():
    """Wherever the forearm points: the text lies on the paper, not in the world's axes."""
    world = World(heading_rad=-1.1)
    trajectory, _, _, truth = written("xyzxyzxyzx", world=world)
    trace = on_paper(truth, world)
    low = trace[:, 1] < trace[:, 1].max() - 1.2 * HEIGHT_M
    assert low.any()
    assert np.ptp(trace[~low, 0]) == pytest.approx(7.8 * HEIGHT_M, abs=0.002)
    assert trace[low, 0].min() == pytest.approx(trace[~low, 0].min(), abs=0.002)
    elbow = trajectory.posture(np.arange(0.0, trajectory.duration_s, 0.1))[:, TURNS:]
    assert 0.1 < np.ptp(elbow, axis=0).max() < 0.2


@pytest.mark.long
def test_a_space_is_room():
    *_, together = written("xy")
    *_, apart = written("x y")
    wider = np.ptp(on_paper(apart, World())[:, 0]) - np.ptp(on_paper(together, World())[:, 0])
    assert wider == pytest.approx(0.5 * HEIGHT_M, abs=0.001)


@pytest.mark.long
def test_a_seed_is_a_performance():
    first, again, other = (written("x", seed=seed)[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.coefficients, again.coefficients)
    np.testing.assert_array_equal(first.breaks_s, again.breaks_s)
    assert other.duration_s != first.duration_s


def test_a_person_holds_a_pen_the_same_way_every_time():
    first, again = held_pen(subject(7)), held_pen(subject(7))
    np.testing.assert_array_equal(first.contacts, again.contacts)
    np.testing.assert_array_equal(first.posture, again.posture)


@pytest.mark.parametrize("text", ["", "  "])
def test_writing_nothing_is_refused(text):
    with pytest.raises(SetupError, match="nothing to write"):
        perform(f'writing:"{text}"', Actor(subject(3), material=Material(box)))


def test_writing_what_nobody_knows_is_refused():
    with pytest.raises(SetupError, match="How to write"):
        perform("writing:\U0001f600", Actor(subject(3), material=Material(box)))


def test_without_strokes_it_says_what_to_install():
    with pytest.raises(SetupError, match="No strokes are at hand for '大'"):
        perform("writing:大", Actor(subject(3)))


@pytest.mark.long
@pytest.mark.parametrize("number", [0, *DEVELOPMENT, *REPORTING])
def test_everybody_can_write(number):
    side = ("right", "left")[number % 2]  # which hand someone writes with is nothing to the other
    trajectory, time_s, segments, truth = written("同志社大", number, side)
    pen, (least, most) = pen_of(trajectory), limits(subject(number, side))
    off, _ = aligned(on_paper(truth, World())[::4], asked("同志社大"))
    assert np.sqrt(np.mean(off**2)) < 0.0005
    held = np.isfinite(truth.t_world_held[:, 0])
    contacts = so3.rotate(truth.q_world_held[held][:, None], pen.contacts)
    slip = pen.skin(segments.q[held], segments.t[held]) - contacts
    assert np.abs(slip - truth.t_world_held[held][:, None]).max() < 5e-6
    posture, _, acceleration = trajectory.derivatives(time_s)
    assert (posture[held] >= least - 1e-9).all()
    assert (posture[held] <= most + 1e-9).all()
    assert np.rad2deg(np.abs(acceleration[:, :TURNS]).max()) < 10000.0
