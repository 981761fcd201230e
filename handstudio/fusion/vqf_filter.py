"""VQF, one sensor at a time, by its authors' package: the interim filter and lasting reference.

D. Laidig and T. Seel, VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection, Information Fusion 91 (2023) 187. Its earth frame is ENU (y along
the horizontal magnetic field); ours has x there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import msgspec
import numpy as np
from jaxtyping import Bool, Float
from vqf import VQF

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.fusion.mechanism import Mechanism
from handstudio.maths import so3
from handstudio.samples import ImuSamples

SensorState: TypeAlias = Mapping[str, Any]
"""VQF's own state, as its package gives and takes it."""

_Q_WORLD_ENU = so3.about_z(-np.pi / 2)


@dataclass(frozen=True, slots=True)
class VqfState:
    """State of all sensors."""

    period_s: float
    magnetometer_period_s: float  # VQF weighs a fresh reading by the time it stands for
    sensors: tuple[SensorState, ...]
    gyr_bias: Float[Array, "s 3"]  # found at rest, taken off before VQF, which clips at 2 deg/s
    q_enu_sensor: Float[Array, "s 4"]  # the newest output, held while a sensor is silent


class _Packed(msgspec.Struct):
    kind: Literal["vqf"]
    period_s: float
    magnetometer_period_s: float
    sensors: list[dict[str, Any]]
    gyr_bias: list[list[float]]
    q_enu_sensor: list[list[float]]


class VqfFilter(msgspec.Struct, frozen=True, tag="vqf"):
    """Parameters of VQF, with its authors' defaults.

    Attributes:
        tau_acc_s: Time constant of the inclination correction [s].
        tau_mag_s: Time constant of the heading correction [s].
        use_magnetometer: Off: heading from the gyroscopes alone.
    """

    tau_acc_s: float = 3.0
    tau_mag_s: float = 9.0
    use_magnetometer: bool = True

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> VqfState:
        """State before the first sample."""
        period = 1.0 / rate_hz
        magnetometer_period = 1.0 / min(rate_hz, magnetometer_rate_hz or rate_hz)
        fresh = self._instance(period, magnetometer_period).state
        return VqfState(
            period,
            magnetometer_period,
            (fresh,) * sensors,
            np.zeros((sensors, 3)),
            np.tile(so3.IDENTITY, (sensors, 1)),
        )

    def restart(self, state: VqfState) -> VqfState:
        """Forget attitudes, keep biases."""
        fresh = self._instance_of(state).state
        return replace(state, sensors=(fresh,) * len(state.sensors))

    def place(
        self,
        state: VqfState,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
    ) -> VqfState:
        """Set a sensor's attitude and bias, as found at rest."""
        q_enu_sensor = so3.multiply(so3.conjugate(_Q_WORLD_ENU), q_world_sensor)
        placed = dict(self._instance_of(state).state)
        placed["gyrQuat"] = q_enu_sensor.tolist()
        placed["kMagInit"] = 0.0  # else the first compass reading would replace this heading
        sensors = list(state.sensors)
        sensors[sensor] = placed
        biases, newest = state.gyr_bias.copy(), state.q_enu_sensor.copy()
        biases[sensor], newest[sensor] = gyr_bias, q_enu_sensor
        return replace(state, sensors=tuple(sensors), gyr_bias=biases, q_enu_sensor=newest)

    def run(
        self,
        state: VqfState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], VqfState]:
        """Fuse consecutive samples, sensor by sensor."""
        # VQF's period is fixed; a stretched step turns the gyroscope's reading into the same angle
        gyr = (samples.gyr - state.gyr_bias) * stretch[:, None, None]
        fresh = samples.fresh & self.use_magnetometer & np.isfinite(samples.mag).all(axis=-1)
        out = np.empty((*gyr.shape[:2], 4))
        after = []
        vqf = self._instance_of(state)
        for i, sensor in enumerate(state.sensors):
            vqf.state = sensor
            use = heeded[:, i]
            inputs = (gyr[use, i], samples.acc[use, i], samples.mag[use, i], fresh[use, i])
            _hold(out[:, i], use, _advance(vqf, *inputs), state.q_enu_sensor[i])
            after.append(vqf.state if use.any() else sensor)
        newest = out[-1].copy() if len(out) else state.q_enu_sensor
        state = replace(state, sensors=tuple(after), q_enu_sensor=newest)
        return so3.multiply(_Q_WORLD_ENU, out), state

    def pack(self, state: VqfState) -> bytes:
        """Serialise a state, to the last bit (msgpack keeps doubles as they are)."""
        return msgspec.msgpack.encode(
            _Packed(
                "vqf",
                state.period_s,
                state.magnetometer_period_s,
                [dict(sensor) for sensor in state.sensors],
                state.gyr_bias.tolist(),
                state.q_enu_sensor.tolist(),
            )
        )

    def unpack(self, packed: bytes) -> VqfState:
        """Inverse of `pack`."""
        try:
            got = msgspec.msgpack.decode(packed, type=_Packed)
        except msgspec.MsgspecError as error:
            raise SetupError(
                "The saved filter state is not one of VQF ({reason}).",
                "Process the take again from its start: handstudio process --from-start.",
                reason=error,
            ) from error
        return VqfState(
            got.period_s,
            got.magnetometer_period_s,
            tuple(got.sensors),
            np.array(got.gyr_bias).reshape(-1, 3),
            np.array(got.q_enu_sensor).reshape(-1, 4),
        )

    def _instance_of(self, state: VqfState) -> VQF:
        return self._instance(state.period_s, state.magnetometer_period_s)

    def _instance(self, period_s: float, magnetometer_period_s: float) -> VQF:
        return VQF(
            period_s, magTs=magnetometer_period_s, tauAcc=self.tau_acc_s, tauMag=self.tau_mag_s
        )


def _hold(out: Array, use: Array, fused: Array, held: Array) -> None:
    """Write fused orientations where the sensor was used; elsewhere the last one before."""
    if use.all():
        out[:] = fused
        return
    known = np.concatenate([held[None], fused])
    out[:] = known[np.cumsum(use)]


def _advance(vqf: VQF, gyr: Array, acc: Array, mag: Array, fresh: Array) -> Array:
    """Run VQF over one sensor's readings; orientation in ENU after each."""
    gyr, acc, mag = (np.ascontiguousarray(signal) for signal in (gyr, acc, mag))
    if len(gyr) == 0:
        return np.empty((0, 4))
    if fresh.all():
        return np.asarray(vqf.updateBatch(gyr, acc, mag)["quat9D"])
    if not fresh.any() and vqf.getDelta() == 0.0:  # never had a compass: 9D and 6D are one
        return np.asarray(vqf.updateBatch(gyr, acc)["quat6D"])
    out = np.empty((len(gyr), 4))
    for i in range(len(gyr)):
        if fresh[i]:
            vqf.update(gyr[i], acc[i], mag[i])
        else:
            vqf.update(gyr[i], acc[i])
        out[i] = vqf.getQuat9D()
    return out
