import numpy as np
import pytest

from handstudio.simulation.trajectory import (
    CHANNELS,
    Span,
    Trajectory,
    held,
    joined,
    labelled,
    layered,
    scaled,
    stretched,
    through_points,
    through_stops,
    turned_to,
    way,
)

KEYS_S = np.array([0.0, 0.4, 1.1, 1.5, 2.3])
MAKERS = {"stops": through_stops, "points": through_points}

makers = pytest.mark.parametrize("maker", MAKERS)


def postures() -> np.ndarray:
    out = np.random.default_rng(1).normal(size=(len(KEYS_S), CHANNELS))
    out[-1] = out[0]
    return out


def wandering(maker: str = "stops", periodic: bool = False) -> Trajectory:
    if periodic:
        return through_stops(KEYS_S, postures(), periodic=True)
    return MAKERS[maker](KEYS_S, postures())


def instants(trajectory: Trajectory) -> np.ndarray:
    """Everywhere but within 10 ms of a break, where a stencil would straddle it."""
    time_s = np.arange(0.0, trajectory.duration_s, 0.037)
    near = np.abs(time_s[:, None] - trajectory.breaks_s).min(axis=1) < 0.01
    return time_s[~near]


def is_smooth(trajectory: Trajectory) -> None:
    """Rates and accelerations are the derivatives, and nothing jumps at a break."""
    h, time_s = 1e-3, instants(trajectory)
    b2, b, at, a, a2 = (trajectory.derivatives(time_s + k * h) for k in (-2, -1, 0, 1, 2))
    for order in (0, 1):
        slope = (b2[order] - 8 * b[order] + 8 * a[order] - a2[order]) / (12 * h)
        np.testing.assert_allclose(at[order + 1], slope, atol=1e-7 * np.abs(slope).max())
    inner = trajectory.breaks_s[1:-1]
    before, after = (trajectory.derivatives(inner + e) for e in (-1e-9, 1e-9))
    for left, right, scale in zip(before, after, (1e-6, 1e-5, 1e-4), strict=True):
        np.testing.assert_allclose(left, right, atol=scale * max(1.0, np.abs(at[2]).max()))


@makers
def test_postures_are_met_and_ends_are_at_rest(maker):
    value, rate, acceleration = wandering(maker).derivatives(KEYS_S)
    np.testing.assert_allclose(value, postures(), atol=1e-12)
    np.testing.assert_allclose(rate[[0, -1]], 0.0, atol=1e-10)
    np.testing.assert_allclose(acceleration[[0, -1]], 0.0, atol=1e-9)
    stops = np.abs(rate[1:-1]).max() < 1e-9
    assert stops == (maker == "stops")


@makers
def test_rates_and_accelerations_are_the_derivatives(maker):
    is_smooth(wandering(maker))


def test_a_motion_names_joint_turns_and_the_elbow():
    trajectory = wandering()
    value, rate, _ = trajectory.derivatives(np.array([0.7]))
    motion = trajectory.at(np.array([0.7]))
    assert motion.turns.shape == (1, (CHANNELS - 3) // 3, 3)
    np.testing.assert_array_equal(motion.turns[0, 1], value[0, 3:6])
    np.testing.assert_array_equal(motion.elbow[1][0], rate[0, -3:])


def test_a_periodic_motion_repeats_without_a_seam():
    trajectory = wandering(periodic=True)
    time_s = np.array([-0.3, 0.0, 0.2, 2.2999999, 2.3, 2.3000001, 9.0])
    once, later = trajectory.at(time_s), trajectory.at(time_s + 10 * trajectory.duration_s)
    np.testing.assert_allclose(once.turns, later.turns, atol=1e-12)
    np.testing.assert_allclose(once.accelerations, later.accelerations, atol=1e-9)
    np.testing.assert_allclose(once.turns[3:6].reshape(3, -1)[2], trajectory.start[:-3], atol=1e-5)


def test_a_motion_that_is_not_periodic_stays_where_it_began_and_ended():
    value, rate, _ = wandering().derivatives(np.array([-5.0, 99.0]))
    np.testing.assert_allclose(value, postures()[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(rate, 0.0, atol=1e-10)


@pytest.mark.parametrize("time_s", [[0.1, 0.5], [0.0, 0.0], [0.0, 1.0, 0.5]])
def test_breaks_out_of_order_are_refused(time_s):
    with pytest.raises(ValueError, match="Breaks"):
        Trajectory(np.array(time_s), np.zeros((6, len(time_s) - 1, CHANNELS)))


def test_a_periodic_motion_that_does_not_close_is_refused():
    away = np.zeros((2, CHANNELS))
    away[1, 3] = 0.1
    with pytest.raises(ValueError, match="end in the pose"):
        through_stops(np.array([0.0, 1.0]), away, periodic=True)


def test_a_way_goes_on_as_it_was_and_comes_to_rest():
    began = wandering("points").derivatives(np.array([0.7]))
    going = way(tuple(x[0] for x in began), postures()[2])
    for told, got in zip(began, going.derivatives(np.array([0.0])), strict=True):
        np.testing.assert_allclose(got, told, atol=1e-12)
    value, rate, acceleration = going.derivatives(np.array([going.duration_s]))
    np.testing.assert_allclose(value[0], postures()[2], atol=1e-9)
    np.testing.assert_allclose(rate, 0.0, atol=1e-8)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-7)
    is_smooth(going)


def test_what_is_joined_follows_smoothly_with_its_names():
    parts = [labelled(wandering("points"), "a"), labelled(held(postures()[2], 1.0), "b")]
    both = joined(parts)
    is_smooth(both)
    a, b = both.spans
    assert (a, b.name) == (Span(0.0, 2.3, "a"), "b")
    assert b.start_s > 2.3  # there is a way between
    assert b.end_s == pytest.approx(both.duration_s)
    np.testing.assert_allclose(both.posture(np.array([b.start_s]))[0], postures()[2], atol=1e-9)


def test_layers_add_what_the_second_does():
    part, over = wandering("points"), stretched(wandering("stops"), 1.7)
    both, time_s = layered(part, over), np.linspace(-0.2, 5.0, 300)
    expected = part.posture(time_s) + over.posture(time_s) - over.start
    np.testing.assert_allclose(both.posture(time_s), expected, atol=1e-10)
    is_smooth(both)


def test_stretching_keeps_the_way_and_scaling_its_start():
    part, time_s = labelled(wandering("points"), "a"), np.linspace(0.0, 2.3, 50)
    np.testing.assert_allclose(
        stretched(part, 3.0).posture(3.0 * time_s), part.posture(time_s), atol=1e-10
    )
    assert stretched(part, 3.0).spans[0].end_s == pytest.approx(6.9)
    away = scaled(part, 0.25).posture(time_s) - part.start
    np.testing.assert_allclose(away, 0.25 * (part.posture(time_s) - part.start), atol=1e-12)


def test_leaving_off_for_another_motion_makes_no_jump():
    before, then = wandering("points"), scaled(wandering("points"), 0.5)
    after = turned_to(before, 0.7, then)
    at = np.array([0.7])
    for was, got in zip(before.derivatives(at), after.derivatives(at), strict=True):
        np.testing.assert_allclose(got, was, atol=1e-9)
    begins_s = after.begins_s + after.duration_s - then.duration_s
    time_s = np.linspace(0.0, then.duration_s, 40)
    np.testing.assert_allclose(after.posture(begins_s + time_s), then.posture(time_s), atol=1e-9)
