"""A turn of the whole rig between rests: blocks of what sensors read, and what they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.averages import blocks_of, valid_mean
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.samples import ImuSamples

LEAST_TURN = float(np.deg2rad(30.0))
"""How far the rig should be turned [rad]; below half of it there is no alignment."""

_STEEPEST = np.deg2rad(45.0)  # of the axis
_BLOCK_S, _MOST_BLOCKS, _REST_S = 0.01, 400, 3.0
_COARSER = 10  # times as long are the blocks of a rest


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Blocks of samples of the sensors that answered, in their own axes."""

    time_s: Float[Array, " n"]
    gyr: Float[Array, "n s 3"]  # less the bias
    acc: Float[Array, "n s 3"]
    weight: Float[Array, "n s"]  # 0: the sensor did not answer, or was at its limit
    turning: slice
    acc_rest: Float[Array, "s 3"]
    q_level_sensor: Float[Array, "s 4"]

    def in_body(self, q_body_level: Float[Array, "s 4"]) -> Float[Array, "n s 6"]:
        """Angular velocities and specific forces in the axes of the rig at rest."""
        q = so3.multiply(q_body_level, self.q_level_sensor)
        return np.concatenate([so3.rotate(q, self.gyr), so3.rotate(q, self.acc)], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Common:
    """What the sensors share, in the axes of the rig at rest."""

    shared: Float[Array, "n 6"]  # angular velocity, specific force
    slope: Float[Array, "n 6"]  # of them, a second
    gravity: Float[Array, "n 3"]  # the force's part that is gravity
    axis: Float[Array, " 3"]  # at the peak
    turned: Float[Array, " n"]  # about it [rad]

    @property
    def turn(self) -> float:
        """How far the rig was turned [rad]."""
        return float(np.ptp(self.turned))

    @property
    def axis_tilt(self) -> float:
        """How far the axis was from level [rad]."""
        return float(np.arcsin(np.clip(abs(self.axis[2]), 0.0, 1.0)))


def signals_of(parts: Sequence[ImuSamples]) -> Signals:
    """Rest, turn and, where there is one, the rest after it, in blocks, one after the other."""
    before, turning = parts[0], parts[1]
    step_s = float(np.median(np.diff(turning.time_us))) * 1e-6
    size = max(1, round(_BLOCK_S / step_s), -(-len(turning) // _MOST_BLOCKS))
    rest = round(_REST_S / step_s)
    cut = [before[-rest:], turning, *(part[:rest] for part in parts[2:])]
    sizes = [max(1, min(_COARSER * size, len(before) // 5)), size, _COARSER * size]
    blocks = [blocks_of(part, of) for part, of in zip(cut, sizes, strict=False)]
    time_s, gyr, acc, weight = (np.concatenate(whole) for whole in zip(*blocks, strict=True))
    # a long block tells as much as the short ones in it
    weight = (
        weight * np.sqrt(np.repeat(sizes[: len(cut)], [len(b[0]) for b in blocks]) / size)[:, None]
    )
    acc_rest = valid_mean(before.acc, before.valid)
    return Signals(
        time_s=time_s,
        gyr=gyr - valid_mean(before.gyr, before.valid),
        acc=acc,
        weight=weight,
        turning=slice(len(blocks[0][0]), len(blocks[0][0]) + len(blocks[1][0])),
        acc_rest=acc_rest,
        q_level_sensor=attitude(acc_rest),
    )


def common_of(signals: Signals, shared: Float[Array, "n 6"]) -> Common:
    """What follows from the shared angular velocity and specific force."""
    time_s, rate = signals.time_s, shared[:, :3]
    steps = np.diff(time_s)[:, None] * 0.5 * (rate[1:] + rate[:-1])
    q_rest_body = [so3.IDENTITY]
    for step in so3.exp(steps):
        q_rest_body.append(so3.multiply(q_rest_body[-1], step))
    up = shared[: signals.turning.start, 3:].mean(axis=0)
    peak = rate[signals.turning][np.argmax(np.linalg.norm(rate[signals.turning], axis=-1))]
    axis = peak / max(float(np.linalg.norm(peak)), 1e-9)
    return Common(
        shared=shared,
        slope=np.gradient(shared, time_s, axis=0),
        gravity=so3.rotate(so3.conjugate(np.array(q_rest_body)), up),
        axis=axis,
        turned=np.concatenate([[0.0], np.cumsum(steps @ axis)]),
    )


def refuse_turn(common: Common) -> None:
    """Refuse what cannot be used at all.

    Raises:
        CalibrationError: the rig was hardly turned, or about too steep an axis.
    """
    if common.turn < 0.5 * LEAST_TURN:
        raise CalibrationError(
            "The rig was turned by {found:.0f} deg; at least {least:.0f} are needed.",
            "Lift the forearm about the elbow by 50 degrees, the hand stiff, and lay it back.",
            found=float(np.rad2deg(common.turn)),
            least=float(np.rad2deg(0.5 * LEAST_TURN)),
        )
    if common.axis_tilt > _STEEPEST:
        raise CalibrationError(
            "The rig was turned about an axis {found:.0f} deg from level; limit {limit:.0f}.",
            "Lift the forearm straight up about the elbow instead of swinging it sideways.",
            found=float(np.rad2deg(common.axis_tilt)),
            limit=float(np.rad2deg(_STEEPEST)),
        )
