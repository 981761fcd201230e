"""Raw: the thesis's reference without any correction, the gyroscope alone from a resting attitude.

Attitude at rest, or of the first sample, then nothing but the Euler rates (2.12), summed to first
order: ``angles_i = angles_(i-1) + E(angles_(i-1)) omega_i dt`` (2.13), singular at theta = +-90 deg
as published. `NEAREST_TO_SINGULAR` of `euler` bounds the step there and mends nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.fusion import euler
from handstudio.fusion.mechanism import Mechanism
from handstudio.fusion.steps import first, steps_of
from handstudio.samples import ImuSamples


@dataclass(frozen=True, slots=True)
class RawState:
    """State of all sensors."""

    period_s: float
    angles: Float[Array, "s 3"]  # phi, theta, psi [rad]; they run on past pi
    begun: Bool[Array, " s"]  # phi and theta were found
    headed: Bool[Array, " s"]  # psi was found, from a fresh reading of the compass
    gyr_bias: Float[Array, "s 3"]


class _Packed(msgspec.Struct):
    kind: Literal["raw"]
    period_s: float
    angles: list[tuple[float, float, float]]
    begun: list[bool]
    headed: list[bool]
    gyr_bias: list[tuple[float, float, float]]


class RawFilter(msgspec.Struct, frozen=True, tag="raw"):
    """It has no parameters."""

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> RawState:
        """State before the first sample."""
        nobody, zeros = np.zeros(sensors, dtype=bool), np.zeros((sensors, 3))
        return RawState(1.0 / rate_hz, zeros, nobody, nobody, zeros)

    def restart(self, state: RawState) -> RawState:
        """Forget attitudes, keep biases; what was shown last is held until a reading comes."""
        nobody = np.zeros_like(state.begun)
        return replace(state, begun=nobody, headed=nobody)

    def place(
        self,
        state: RawState,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
    ) -> RawState:
        """Set a sensor's attitude and bias, as found at rest."""
        angles, biases = state.angles.copy(), state.gyr_bias.copy()
        begun, headed = state.begun.copy(), state.headed.copy()
        angles[sensor], biases[sensor] = euler.from_quaternion(q_world_sensor), gyr_bias
        begun[sensor] = headed[sensor] = True
        return replace(state, angles=angles, begun=begun, headed=headed, gyr_bias=biases)

    def run(
        self,
        state: RawState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], RawState]:
        """Sum consecutive samples."""
        steps = steps_of(samples, stretch, heeded, state.period_s, state.gyr_bias)
        begins, heads = first(state.begun, steps.heeded), first(state.headed, steps.compass)
        found = np.stack([begins, begins, begins | heads], axis=1)
        finding = np.asarray(found.any(axis=(1, 2)))
        angles = state.angles.T
        out = np.empty(steps.turn.shape)
        for k, any_found in enumerate(finding):
            angles = angles + euler.rates(angles, steps.turn[k])
            if any_found:
                angles = np.where(found[k], steps.observed[k], angles)
            out[k] = angles
        state = replace(
            state,
            angles=angles.T.copy(),
            begun=state.begun | steps.heeded.any(axis=0),
            headed=state.headed | steps.compass.any(axis=0),
        )
        return euler.to_quaternion(np.moveaxis(out, 1, 0)), state

    def pack(self, state: RawState) -> bytes:
        """Serialise a state, to the last bit (msgpack keeps doubles as they are)."""
        return msgspec.msgpack.encode(
            _Packed(
                "raw",
                state.period_s,
                state.angles.tolist(),
                state.begun.tolist(),
                state.headed.tolist(),
                state.gyr_bias.tolist(),
            )
        )

    def unpack(self, packed: bytes) -> RawState:
        """Inverse of `pack`."""
        try:
            got = msgspec.msgpack.decode(packed, type=_Packed)
        except msgspec.MsgspecError as error:
            raise SetupError(
                "The saved filter state is not one of {filter} ({reason}).",
                "Process the take again from its start: handstudio process --from-start.",
                filter="raw",
                reason=error,
            ) from error
        return RawState(
            got.period_s,
            np.array(got.angles).reshape(-1, 3),
            np.array(got.begun, dtype=bool),
            np.array(got.headed, dtype=bool),
            np.array(got.gyr_bias).reshape(-1, 3),
        )
