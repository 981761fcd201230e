"""The thesis's correction of sensor outputs (equations 4.10 to 4.17, after Xue et al.).

What it is: a one-pole low-pass, of about 10 Hz at 100 samples a second. It takes some noise off,
lags by ``1/lambda`` (about 15 ms) and removes no bias: the rate and the bias of the model are not
separately observable, so what is read is split between them in a fixed ratio, ``q_omega / K²``,
which is more than a million to one. Take the bias from a rest. It is here as the reference it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

_DEG = math.pi / 180.0
_G = STANDARD_GRAVITY


class SteadyGain(NamedTuple):
    """Gain of the continuous filter [1/s]: for the signal and for its bias."""

    signal: float  # K1
    bias: float  # K2

    @property
    def decay(self) -> float:
        """``lambda = K1 + K2`` [1/s]; the corner is ``lambda / (2 pi)`` [Hz]."""
        return self.signal + self.bias

    @property
    def share(self) -> float:
        """Share of what is read that counts as signal, ``K1 / lambda``."""
        return self.signal / self.decay


def steady_gain(q: float, white: float, walk: float, rate_hz: float) -> SteadyGain:
    """Where the Kalman filter of (4.14) settles, ``K = K_inf / dt``.

    The two states cannot be told apart, so their covariance grows without end and has no steady
    Riccati solution; the covariance of their sum has one, and the gain needs no more:
    ``s = w + s V / (s + V)`` with ``w = (q + K²) dt`` and ``V = Q² / dt``, split as q to K².

    Args:
        q: Density of the signal's walk, [(rad/s)²/s] or [(m/s²)²/s].
        white: Q, density of the white noise (two-sided).
        walk: K, density of the bias's walk.
        rate_hz: Sampling rate.
    """
    dt = 1.0 / rate_hz
    w, v = (q + walk**2) * dt, white**2 / dt
    s = 0.5 * (w + math.sqrt(w * w + 4.0 * w * v))
    decay = s / (s + v) / dt
    return SteadyGain(decay * q / (q + walk**2), decay * walk**2 / (q + walk**2))


@dataclass(frozen=True, slots=True, eq=False)
class CorrectionState:
    """State of all sensors. The estimate is ``X = level K / lambda`` at all times: one number an
    axis is all of it. The six of a sensor: gyroscope x y z, accelerometer x y z."""

    period_s: float
    level: Float[Array, "s 6"]  # H X [rad/s], [m/s²]
    waited: Float[Array, "s 2"]  # exp(-lambda t), t since the last reading that was used
    begun: Bool[Array, " s"]


class _Packed(msgspec.Struct):
    kind: Literal["correction"]
    period_s: float
    level: list[tuple[float, float, float, float, float, float]]
    waited: list[tuple[float, float]]
    begun: list[bool]


class CorrectionFilter(msgspec.Struct, frozen=True, tag="correction"):
    """Parameters, one set for all sensors: the thesis's choice, and the means of its table 4.1.

    Attributes:
        q_omega: How freely the angular velocity may change [(rad/s)²/s].
        q_a: How freely the specific force may change [(m/s²)²/s].
        gyr_white: Q of the gyroscope [rad/sqrt(s)].
        gyr_walk: K of the gyroscope [rad/s^1.5].
        acc_white: Q of the accelerometer [m/s^1.5].
        acc_walk: K of the accelerometer [m/s^2.5].

    Raises:
        SetupError: one of them is no density.
    """

    q_omega: float = 0.5 * _DEG**2
    q_a: float = 1e-4 * _G**2
    gyr_white: float = 6.47e-3 * _DEG
    gyr_walk: float = 2.51e-4 * _DEG
    acc_white: float = 1.144e-4 * _G
    acc_walk: float = 4.68e-6 * _G

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            may_be_none = name.endswith("walk")
            if not (math.isfinite(value) and (value > 0.0 or (may_be_none and value == 0.0))):
                raise SetupError(
                    "{name} of the correction cannot be {value}.",
                    "Choose a number above 0; only a walk may be 0.",
                    name=name,
                    value=value,
                )

    def gains(self, rate_hz: float) -> tuple[SteadyGain, SteadyGain]:
        """Of gyroscope and accelerometer."""
        return (
            steady_gain(self.q_omega, self.gyr_white, self.gyr_walk, rate_hz),
            steady_gain(self.q_a, self.acc_white, self.acc_walk, rate_hz),
        )

    def begin(self, sensors: int, rate_hz: float = 100.0) -> CorrectionState:
        """State before the first sample: each sensor settles at once on its first reading."""
        level, waited = np.zeros((sensors, 6)), np.ones((sensors, 2))
        return CorrectionState(1.0 / rate_hz, level, waited, np.zeros(sensors, dtype=bool))

    def restart(self, state: CorrectionState) -> CorrectionState:
        """Forget all signals (the device was away for long)."""
        return self.begin(len(state.begun), 1.0 / state.period_s)

    def run(
        self, state: CorrectionState, samples: ImuSamples, stretch: Float[Array, " n"]
    ) -> tuple[ImuSamples, CorrectionState]:
        """Correct consecutive samples: ``X += K (1 - exp(-lambda dt)) / lambda (z - H X)``.

        Args:
            state: Where the last run ended.
            samples: No instant missing between them.
            stretch: Length of the step that leads to each sample, in nominal sample periods.

        Returns:
            The samples, gyroscope and accelerometer corrected, and the state to go on from.
            Readings of a sensor that did not answer, or that are no numbers, stay as they are and
            change nothing. Cutting ``samples`` anywhere changes no digit.
        """
        gains = self.gains(1.0 / state.period_s)
        read = np.concatenate([samples.gyr, samples.acc], axis=-1)
        used = samples.valid & np.isfinite(read).all(axis=-1)
        decay = np.exp(-np.multiply.outer(stretch * state.period_s, [one.decay for one in gains]))
        kept, waited = _kept(state.waited, decay, used)
        known = np.maximum.accumulate(np.concatenate([state.begun[None], used]), axis=0)
        kept = np.where(known[:-1, :, None], kept, 0.0)
        gain = np.repeat(np.where(used[..., None], 1.0 - kept, 0.0), 3, axis=-1)
        level, out = _followed(state.level, np.where(used[..., None], read, 0.0), gain)
        shares = np.repeat([one.share for one in gains], 3)
        corrected = np.where(used[..., None], shares * out, read)
        state = replace(state, level=level, waited=waited, begun=known[-1])
        return replace(samples, gyr=corrected[..., :3], acc=corrected[..., 3:]), state

    def pack(self, state: CorrectionState) -> bytes:
        """Serialise a state, to the last bit (msgpack keeps doubles as they are)."""
        arrays = (state.level.tolist(), state.waited.tolist(), state.begun.tolist())
        return msgspec.msgpack.encode(_Packed("correction", state.period_s, *arrays))

    def unpack(self, packed: bytes) -> CorrectionState:
        """Inverse of `pack`.

        Raises:
            SetupError: these bytes are not a state of this filter.
        """
        try:
            got = msgspec.msgpack.decode(packed, type=_Packed)
        except msgspec.MsgspecError as error:
            raise SetupError(
                "The saved filter state is not one of {filter} ({reason}).",
                "Process the take again from its start: handstudio process --from-start.",
                filter="correction",
                reason=error,
            ) from error
        return CorrectionState(
            got.period_s,
            np.array(got.level).reshape(-1, 6),
            np.array(got.waited).reshape(-1, 2),
            np.array(got.begun, dtype=bool),
        )


def _kept(
    waited: Float[Array, "s 2"], decay: Float[Array, "n 2"], used: Bool[Array, "n s"]
) -> tuple[Float[Array, "n s 2"], Float[Array, "s 2"]]:
    """How much of a level is left when each reading comes: the steps missed count too."""
    shape = (*used.shape, 2)
    if used.all() and (waited == 1.0).all():
        return np.broadcast_to(decay[:, None], shape), waited
    kept = np.empty(shape)
    for k, now in enumerate(used):
        kept[k] = waited * decay[k]
        waited = np.where(now[:, None], 1.0, kept[k])
    return kept, waited


def _followed(
    level: Float[Array, "s 6"], read: Float[Array, "n s 6"], gain: Float[Array, "n s 6"]
) -> tuple[Float[Array, "s 6"], Float[Array, "n s 6"]]:
    # a loop, not a recursive filter: steps differ in length, and it rounds the same however cut
    out = np.empty_like(read)
    for k in range(len(read)):
        level = level + gain[k] * (read[k] - level)
        out[k] = level
    return level, out
