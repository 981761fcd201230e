"""The published filters against their equations, written out."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.maths import so3
from handstudio.trackers.late_euler import euler_of, from_euler, rate_matrix
from handstudio.trackers.late_methods import (
    Published,
    gyro_alone,
    method_one,
    method_two,
    tracker_alone,
)
from handstudio.trackers.late_ud import covariance_of, factors_of, measured, stepped
from handstudio.trackers.track import Track

LIKE = Published()


def test_angles_are_turns_about_z_then_y_then_x() -> None:
    angles = np.array([0.4, -0.3, 0.2])
    axes = np.eye(3)
    turns = [so3.from_axis_angle(axes[i], a) for i, a in zip((2, 1, 0), angles, strict=True)]
    product = so3.multiply(so3.multiply(turns[0], turns[1]), turns[2])
    np.testing.assert_allclose(from_euler(angles), product, atol=1e-12)
    np.testing.assert_allclose(euler_of(product), angles, atol=1e-12)


def test_the_rate_matrix_is_the_derivative_of_the_angles() -> None:
    angles, omega, dt = np.array([0.4, -0.7, 1.2]), np.array([0.3, -0.8, 0.5]), 1e-6
    after = so3.multiply(from_euler(angles), so3.exp(omega * dt))
    expected = (euler_of(after) - angles) / dt
    np.testing.assert_allclose(rate_matrix(angles) @ omega[::-1], expected, atol=1e-5)


def test_factors_are_those_of_a_kalman_filter() -> None:
    rng = np.random.default_rng(3)
    root = rng.normal(size=(6, 6))
    p, f, q = root @ root.T, rng.normal(size=(6, 6)), rng.uniform(0.1, 1.0, 6)
    h, r = rng.normal(size=6), 0.3
    u, d = factors_of(p)
    np.testing.assert_allclose(covariance_of(u, d), p, atol=1e-12)
    u, d = stepped(u, d, f, q)
    p = f @ p @ f.T + np.diag(q)
    np.testing.assert_allclose(covariance_of(u, d), p, rtol=1e-10)
    u, d, gain = measured(u, d, h, r)
    k = p @ h / (h @ p @ h + r)
    np.testing.assert_allclose(gain, k, rtol=1e-10)
    np.testing.assert_allclose(covariance_of(u, d), p - np.outer(k, h @ p), atol=1e-10)
    np.testing.assert_array_equal(np.diag(u), 1.0)


def test_method_one_is_its_equations() -> None:
    track, time_us, gyr, _ = _motion(40)
    np.testing.assert_allclose(
        method_one(track, time_us, gyr, LIKE), _plain(track, time_us, gyr, 1), atol=1e-10
    )


def test_method_two_is_its_equations() -> None:
    track, time_us, gyr, _ = _motion(40)
    np.testing.assert_allclose(
        method_two(track, time_us, gyr, LIKE), _plain(track, time_us, gyr, 2), atol=1e-10
    )


@pytest.mark.parametrize("method", [method_one, method_two])
def test_a_steady_turn_is_predicted_over_the_delay(method) -> None:
    track, time_us, gyr, truth = _motion(300)
    late = np.abs(tracker_alone(track, time_us, LIKE, filtered=False) - truth)[-100:].max()
    assert late > 0.04
    assert np.abs(method(track, time_us, gyr, LIKE) - truth)[-100:].max() < 0.1 * late


def test_a_lost_sample_is_the_one_before_as_published_or_skipped() -> None:
    track, time_us, gyr, truth = _motion(300)
    lost = track.q_room_terminal.copy()
    lost[100:103] = np.nan
    track = Track("head", track.time_us, track.t_room_terminal, lost, track.quality)
    repeated = np.abs(method_one(track, time_us, gyr, LIKE) - truth)[200:220].max()
    skipped = np.abs(method_one(track, time_us, gyr, Published(repeat_lost=False)) - truth)
    assert skipped[200:220].max() < 0.5 * repeated


def test_rates_alone_follow_a_known_motion() -> None:
    _, time_us, gyr, truth = _motion(300)
    assert np.abs(gyro_alone(truth[0], time_us, gyr) - truth).max() < 0.02


def _motion(count: int):
    """A steady turn about a fixed axis, told 0.1 s late at 50 Hz without noise."""
    time_us = np.arange(count) * 10_000
    omega = np.array([0.2, -0.3, 0.5])

    def attitude(seconds):
        return so3.exp(seconds[:, None] * omega)

    told = time_us[::2]
    q = attitude(told * 1e-6 - 0.1)
    track = Track("head", told, np.zeros((len(told), 3)), q, np.ones(len(told)))
    return track, time_us, np.tile(omega, (count, 1)), euler_of(attitude(time_us * 1e-6))


def _plain(track: Track, time_us, gyr, method: int):
    """Equations (1) to (17) with full covariances."""
    angles, rates = euler_of(track.q_room_terminal), gyr[:, ::-1]
    q = np.diag(np.repeat([LIKE.angle_step_sd**2, LIKE.rate_step_sd**2], 3))
    v1, v2 = np.repeat(LIKE.tracker_sd**2, 3), np.repeat(LIKE.gyr_sd**2, 3)
    r, p, out = np.concatenate([angles[0], np.zeros(3)]), np.diag(np.concatenate([v1, v2])), []

    def transition(dt):
        f = np.eye(6)
        f[:3, 3:] = dt * rate_matrix(r[:3])
        return f

    def update(y, h, noise):
        k = p @ h.T @ np.linalg.inv(h @ p @ h.T + np.diag(noise))
        return r + k @ (y - h @ r), p - k @ h @ p

    for n in range(len(time_us)):
        tracked = n % 2 == 0
        h_g = np.hstack([np.zeros((3, 3)), np.eye(3)])
        if method == 1:
            if n:
                f = transition(0.01)
                r, p = f @ r, f @ p @ f.T + q
            if n and tracked:
                h_p = np.hstack([np.eye(3), -LIKE.delay_s * rate_matrix(r[:3])])
                r, p = update(angles[n // 2], h_p, v1)
            r, p = update(rates[n], h_g, v2)
        elif tracked:
            if n:
                wide, f = transition(0.02), transition(0.01)
                r, p = f @ r, wide @ p @ wide.T + 2.0 * q
                h_p = np.hstack([np.eye(3), -LIKE.delay_s * rate_matrix(r[:3])])
                y, h = np.concatenate([angles[n // 2], rates[n]]), np.vstack([h_p, h_g])
                r, p = update(y, h, np.concatenate([v1, v2]))
            else:
                r, p = update(rates[n], h_g, v2)
        else:
            r[3:] = rates[max(0, n - 2) : n + 1].mean(axis=0)
            r = transition(0.01) @ r
        out.append(r[:3].copy())
    return np.array(out)
