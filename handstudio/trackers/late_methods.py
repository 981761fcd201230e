"""Attitude from a late tracker and gyroscopes as published, to compare with.

S. Emura and S. Tachi, *Sensor Fusion based Measurement of Human Head Motion*, 1993. The state is
``(gamma, beta, alpha | z, y, x)``, ZYX angles [rad] and rates of the body [rad/s]. Numbers in
brackets are the paper's equations.

What the paper leaves open, and what is chosen here:

- The process noise is of one interval of the gyroscopes; a step of another length has its variance
  in proportion.
- What arrives at one instant shares one step of time; the tracker is taken in first.
- (7) and (11) carry a ``H'`` too much; (16) is used.
- Method II steps its state with every gyroscope sample, and its covariance over the whole interval
  when the tracker arrives. Its three samples are the newest three.
- The state begins at the first tracker sample, with rates of zero, as uncertain as a measurement.
- Differences of angles are taken the shorter way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.trackers.late_euler import euler_of, rate_matrix, shorter
from handstudio.trackers.late_ud import factors_of, measured, stepped
from handstudio.trackers.track import Track

_ZYX = [2, 1, 0]
_MEAN_OF = 3


@dataclass(frozen=True, slots=True)
class Published:
    """The paper's parameters.

    Attributes:
        delay_s: d: how long after its pose a tracker sample arrives [s].
        step_s: Interval of the gyroscopes, which ``angle_step_sd`` and ``rate_step_sd`` are of [s].
        angle_step_sd, rate_step_sd: w1 [rad] and w2 [rad/s]: what the model misses in a step.
        tracker_sd: v1: of a tracker's angle, with what the head may do within the delay [rad].
        gyr_sd: v2: of a rate [rad/s].
        repeat_lost: Take a lost tracker sample as the one before, as the paper does; otherwise it
            is skipped.
    """

    delay_s: float = 0.1
    step_s: float = 0.01
    angle_step_sd: float = 0.01
    rate_step_sd: float = 0.15
    tracker_sd: float = 0.0268
    gyr_sd: float = 0.15
    repeat_lost: bool = True


def method_one(
    track: Track, time_us: Int64[Array, " n"], gyr: Float[Array, "n 3"], like: Published
) -> Float[Array, "n 3"]:
    """Method I, (4) to (11): a Kalman update whenever either arrives.

    Args:
        track: When poses were told, and the poses; attitudes in the gyroscopes' axes.
        time_us: Of the gyroscope samples [µs].
        gyr: About x, y and z [rad/s].
        like: Parameters.

    Returns:
        Azimuth, elevation and roll [rad] at every gyroscope sample; NaN before the first pose.
    """
    told, rates, filter = _told(track, time_us, like), gyr[:, _ZYX], _Kalman(like)
    out = np.full((len(time_us), 3), np.nan)
    for k, now_us in enumerate(time_us.tolist()):
        filter.step(now_us)
        if k in told:
            filter.see_tracker(told[k], now_us)
        if filter.begun:
            filter.see(3, rates[k], like.gyr_sd)
            out[k] = filter.r[:3]
    return out


def method_two(
    track: Track, time_us: Int64[Array, " n"], gyr: Float[Array, "n 3"], like: Published
) -> Float[Array, "n 3"]:
    """Method II, (12) to (17): an update with both when the tracker arrives, rates added between.

    Arguments and result as those of `method_one`.
    """
    told, rates, filter = _told(track, time_us, like), gyr[:, _ZYX], _Kalman(like)
    out = np.full((len(time_us), 3), np.nan)
    for k, now_us in enumerate(time_us.tolist()):
        if k in told:
            filter.step(now_us)
            filter.see_tracker(told[k], now_us)
            filter.see(3, rates[k], like.gyr_sd)
        elif filter.begun:
            filter.r[3:] = rates[max(0, k + 1 - _MEAN_OF) : k + 1].mean(axis=0)
            filter.step_state(now_us)
        out[k] = filter.r[:3]
    return out


def tracker_alone(
    track: Track, time_us: Int64[Array, " n"], like: Published, filtered: bool = True
) -> Float[Array, "n 3"]:
    """The row "Kalman": (4) to (8) with the tracker only; or the raw poses, each held."""
    told, filter = _told(track, time_us, like), _Kalman(like)
    out = np.full((len(time_us), 3), np.nan)
    for k, now_us in enumerate(time_us.tolist()):
        if filtered and filter.begun:
            filter.step(now_us)
        if k in told and filtered:
            filter.see_tracker(told[k], now_us)
        elif k in told:
            filter.r[:3] = told[k]
        out[k] = filter.r[:3]
    return out


def gyro_alone(
    begin: Float[Array, "3"], time_us: Int64[Array, " n"], gyr: Float[Array, "n 3"]
) -> Float[Array, "n 3"]:
    """Rates added up from a known attitude: azimuth, elevation and roll [rad]."""
    out = [begin]
    for dt, rate in zip(np.diff(time_us) * 1e-6, gyr[1:, _ZYX], strict=True):
        out.append(out[-1] + dt * rate_matrix(out[-1]) @ rate)
    return np.array(out)


class _Kalman:
    """State and covariance, the latter in its UD factors."""

    def __init__(self, like: Published) -> None:
        self.like = like
        self.r = np.full(6, np.nan)
        self.begun = False
        self._state_us = self._covariance_us = 0
        sd = [like.tracker_sd] * 3 + [like.gyr_sd] * 3
        self._u, self._d = factors_of(np.diag(np.square(sd)))

    def step_state(self, now_us: int) -> None:
        """(4) and (13)."""
        dt, self._state_us = 1e-6 * (now_us - self._state_us), now_us
        self.r[:3] += dt * rate_matrix(self.r[:3]) @ self.r[3:]

    def step(self, now_us: int) -> None:
        """(4) and (5), (13) and (14): to now."""
        if not self.begun:
            return
        dt, self._covariance_us = 1e-6 * (now_us - self._covariance_us), now_us
        f = np.eye(6)
        f[:3, 3:] = dt * rate_matrix(self.r[:3])
        self.step_state(now_us)
        like = self.like
        sd = np.repeat([like.angle_step_sd, like.rate_step_sd], 3)
        self._u, self._d = stepped(self._u, self._d, f, dt / like.step_s * sd**2)

    def see_tracker(self, angles: Array, now_us: int) -> None:
        """(6) to (8) with ``H = (I | -d F')``, or begin."""
        if not self.begun:
            self.r, self.begun = np.concatenate([angles, np.zeros(3)]), True
            self._state_us = self._covariance_us = now_us
            return
        self.see(0, angles, self.like.tracker_sd, -self.like.delay_s * rate_matrix(self.r[:3]))

    def see(self, first: int, values: Array, sd: float, rates: Array | None = None) -> None:
        """Three numbers one by one: those of the state from ``first`` on, and a part of rates."""
        h = np.zeros((3, 6))
        h[:, first : first + 3] = np.eye(3)
        if rates is not None:
            h[:, 3:] = rates
        expected = h @ self.r  # before any of them
        innovation = shorter(values - expected) if first == 0 else values - expected
        correction = np.zeros(6)
        for row, off in zip(h, innovation, strict=True):
            self._u, self._d, gain = measured(self._u, self._d, row, sd**2)
            correction = correction + gain * (off - row @ correction)
        self.r = self.r + correction


def _told(track: Track, time_us: Int64[Array, " n"], like: Published) -> dict[int, Array]:
    """Angles by the number of the gyroscope sample at which, or next after which, they came."""
    at = np.searchsorted(time_us, track.time_us)
    angles = euler_of(track.q_room_terminal)
    found: dict[int, Array] = {}
    for before, now in pairwise([-1, *range(len(at))]):
        lost = not np.isfinite(angles[now]).all()
        if lost and like.repeat_lost and before >= 0:
            angles[now] = angles[before]
            lost = not np.isfinite(angles[now]).all()
        if not lost and at[now] < len(time_us):
            found[int(at[now])] = angles[now]
    return found
