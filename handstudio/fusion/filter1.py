"""Filter 1 of the thesis: every sensor's own Kalman filter on Euler angles (4.3.1, table 4.3).

The update is that of `raw`; what is observed at every step is the attitude that accelerometer and
compass would tell at rest (2.9 to 2.11), the acceleration of a moving hand taken for gravity. The
thesis names neither process nor observation noise: the numbers are ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.fusion import euler
from handstudio.fusion.mechanism import Mechanism
from handstudio.fusion.steps import Steps, first, steps_of
from handstudio.samples import ImuSamples

_PLACED = float(np.deg2rad(1.0)) ** 2
"""Variance of an angle found at rest [rad²]: 10 mg left in an accelerometer are 0.6 deg. Ours."""

_UNKNOWN = 1e6
"""Variance of a heading before the first reading [rad²]: the reading is then all that counts."""


@dataclass(frozen=True, slots=True)
class Filter1State:
    """State of all sensors."""

    period_s: float
    magnetometer_period_s: float  # a fresh reading speaks for so much time
    angles: Float[Array, "s 3"]  # phi, theta, psi [rad]; they run on past pi
    covariance: Float[Array, "s 3 3"]  # [rad²]
    begun: Bool[Array, " s"]
    gyr_bias: Float[Array, "s 3"]


_Row: TypeAlias = tuple[float, float, float]


class _Packed(msgspec.Struct):
    kind: Literal["filter1"]
    period_s: float
    magnetometer_period_s: float
    angles: list[_Row]
    covariance: list[tuple[_Row, _Row, _Row]]
    begun: list[bool]
    gyr_bias: list[_Row]


class Filter1(msgspec.Struct, frozen=True, tag="filter1"):
    """Noise of the filter; all of it ours, the thesis gives none. Not tuned on any result.

    All are densities, so that the rate of sampling does not alter the filter: a step of dt adds
    ``(gyr_noise gyr_factor)² dt`` to the variance of each angle, an observation has
    ``noise² / dt``. Ratios are time constants: about 4 s for inclination as for heading.

    Attributes:
        gyr_noise: White noise of the gyroscope [rad/sqrt(s)], the middle of the thesis's table 4.1
            (6.2e-3 to 6.9e-3 deg/sqrt(s)).
        gyr_factor: What a moving sensor errs beyond that: a scale off by 1 % at 100 deg/s, which
            holds for a quarter of a second, is 0.7 deg/sqrt(s), a hundred times the noise.
        inclination_noise: Of the attitude by accelerometer [rad sqrt(s)]. A hand's own
            acceleration of 0.1 g, which holds for a tenth of a second, is 2.5 deg sqrt(s); the
            accelerometer's own noise (1.15e-4 g sqrt(s), table 4.1) is 0.007 and does not count.
        heading_noise: Of the attitude by compass [rad sqrt(s)]: the inclination's error enters
            with the tangent of the field's dip (48.5 deg), and that is nearly all of it.
    """

    gyr_noise: float = float(np.deg2rad(6.5e-3))
    gyr_factor: float = 100.0
    inclination_noise: float = float(np.deg2rad(2.5))
    heading_noise: float = float(np.deg2rad(2.8))

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> Filter1State:
        """State before the first sample."""
        return Filter1State(
            1.0 / rate_hz,
            1.0 / min(rate_hz, magnetometer_rate_hz or rate_hz),
            np.zeros((sensors, 3)),
            np.zeros((sensors, 3, 3)),
            np.zeros(sensors, dtype=bool),
            np.zeros((sensors, 3)),
        )

    def restart(self, state: Filter1State) -> Filter1State:
        """Forget attitudes, keep biases; what was shown last is held until a reading comes."""
        return replace(state, begun=np.zeros_like(state.begun))

    def place(
        self,
        state: Filter1State,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
    ) -> Filter1State:
        """Set a sensor's attitude and bias, as found at rest."""
        angles, covariance = state.angles.copy(), state.covariance.copy()
        begun, biases = state.begun.copy(), state.gyr_bias.copy()
        angles[sensor], biases[sensor] = euler.from_quaternion(q_world_sensor), gyr_bias
        covariance[sensor] = _PLACED * np.eye(3)
        begun[sensor] = True
        return replace(state, angles=angles, covariance=covariance, begun=begun, gyr_bias=biases)

    def run(
        self,
        state: Filter1State,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], Filter1State]:
        """Fuse consecutive samples."""
        steps = steps_of(samples, stretch, heeded, state.period_s, state.gyr_bias)
        begins = first(state.begun, heeded)
        goes_on = heeded & ~begins
        turn = np.where(goes_on[:, None], steps.turn, 0.0)
        spread = np.where(goes_on, self._process_density * steps.duration_s[:, None], 0.0)
        variance = self._variance(state, steps)
        trust = np.where(goes_on[:, None], variance, np.inf)
        angles = np.ascontiguousarray(state.angles.T)
        covariance = np.ascontiguousarray(np.moveaxis(state.covariance, 0, -1))
        out = np.empty(turn.shape)
        for k, any_begins in enumerate(np.asarray(begins.any(axis=1))):
            angles, covariance = _predict(angles, covariance, turn[k], spread[k])
            _correct(angles, covariance, steps.observed[k], trust[k])
            if any_begins:
                angles = np.where(begins[k], steps.observed[k], angles)
                known = np.where(np.isfinite(variance[k]), variance[k], _UNKNOWN)
                covariance = np.where(begins[k], np.eye(3)[..., None] * known, covariance)
            out[k] = angles
        state = replace(
            state,
            angles=angles.T.copy(),
            covariance=np.moveaxis(covariance, -1, 0).copy(),
            begun=state.begun | heeded.any(axis=0),
        )
        return euler.to_quaternion(np.moveaxis(out, 1, 0)), state

    def pack(self, state: Filter1State) -> bytes:
        """Serialise a state, to the last bit (msgpack keeps doubles as they are)."""
        return msgspec.msgpack.encode(
            _Packed(
                "filter1",
                state.period_s,
                state.magnetometer_period_s,
                state.angles.tolist(),
                state.covariance.tolist(),
                state.begun.tolist(),
                state.gyr_bias.tolist(),
            )
        )

    def unpack(self, packed: bytes) -> Filter1State:
        """Inverse of `pack`."""
        try:
            got = msgspec.msgpack.decode(packed, type=_Packed)
        except msgspec.MsgspecError as error:
            raise SetupError(
                "The saved filter state is not one of {filter} ({reason}).",
                "Process the take again from its start: handstudio process --from-start.",
                filter="filter1",
                reason=error,
            ) from error
        return Filter1State(
            got.period_s,
            got.magnetometer_period_s,
            np.array(got.angles).reshape(-1, 3),
            np.array(got.covariance).reshape(-1, 3, 3),
            np.array(got.begun, dtype=bool),
            np.array(got.gyr_bias).reshape(-1, 3),
        )

    @property
    def _process_density(self) -> float:
        return (self.gyr_noise * self.gyr_factor) ** 2

    def _variance(self, state: Filter1State, steps: Steps) -> Float[Array, "n 3 s"]:
        """Variance of each observed angle [rad²]; infinite where it is not observed."""
        inclination = self.inclination_noise**2 / state.period_s
        heading = self.heading_noise**2 / state.magnetometer_period_s
        variance = np.full(steps.observed.shape, inclination)
        variance[:, 2] = np.where(steps.compass, heading, np.inf)
        return variance


def _predict(angles: Array, covariance: Array, turn: Array, spread: Array) -> tuple[Array, Array]:
    """One step of the angles (2.13), and ``F P F' + Q`` with F the derivative of that step."""
    step, slopes = euler.rates_and_slopes(angles, turn)
    by_phi, by_theta = slopes[:, 0, None], slopes[:, 1, None]
    half = covariance + by_phi * covariance[None, 0] + by_theta * covariance[None, 1]
    whole = half + half[:, 0, None] * slopes[None, :, 0] + half[:, 1, None] * slopes[None, :, 1]
    whole.reshape(9, -1)[::4] += spread
    return angles + step, whole


def _correct(angles: Array, covariance: Array, observed: Array, variance: Array) -> None:
    """Correct both in place, angle by angle: their observations err independently.

    An infinite variance makes a gain of zero, to the last bit.
    """
    gap = euler.difference(observed, angles)
    for i in range(3):
        gain = covariance[:, i] / (covariance[i, i] + variance[i])
        move = gain * gap[i]
        angles += move
        gap -= move
        covariance -= gain[:, None] * covariance[None, i].copy()
