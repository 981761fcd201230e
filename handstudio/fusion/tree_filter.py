"""The tree filter: one error-state filter over all sensors of a layout and the joints between them.

What neighbours say of each other holds headings together without a compass: both sensors beside a
joint feel one acceleration at its centre (the thesis's 4.29), a hinge has one axis, a joint of two
axes keeps them square. Gravity comes in once, at the root, where the least is accelerated;
compasses come in as far as they see the undisturbed field. `tree_kernel` computes; here is what it
is told.

There is no look-ahead: a reading corrects its own instant once the next one has told how the rates
change, and what comes out is carried on to the newest by the gyroscopes.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Literal

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.fusion.filter import ALIGNED_SD, Fused
from handstudio.fusion.mechanism import Mechanism, bare
from handstudio.fusion.tree_parts import FRESH, HEEDED, PLACED, SATURATED, Beliefs, Joints, Memory
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_PLACED_TILT = float(np.deg2rad(0.7))
"""Of an attitude found at rest [rad]: what 10 mg left in an accelerometer tilt it."""

_PLACED_BIAS = float(np.deg2rad(0.05))
_UNPLACED_BIAS = float(np.deg2rad(1.0))


@dataclass(frozen=True, slots=True, eq=False)
class TreeState:
    """State of all sensors, in the order of the layout.

    Attributes:
        period_s: Nominal time between samples.
        q: Orientation in the world that all share (headings agree).
        cov: Covariance of each one's error, a rotation in the world [rad²].
        edge: Covariance of each with its parent: rows are its own.
        bias: Of the gyroscopes [rad/s].
        bias_cov: And its covariance.
        bias_own: Covariance of the bias (rows) with the error.
        gyr1, gyr2, acc1, mag1: Readings of the instant before, and rates of the one before that.
        past: As the kernel keeps it.
        scalar: And this.
        turn: By how much the axes of the joint before a sensor are found to be off, in the sensor.
        root: Slow means of the force at a root, in the world, its variance, and since when.
        slow: Variance of that (negative: not told yet); how far its compass is off, and variance;
            two of the kernel's.
    """

    period_s: float
    q: Float[Array, "s 4"]
    cov: Float[Array, "s 3 3"]
    edge: Float[Array, "s 3 3"]
    bias: Float[Array, "s 3"]
    bias_cov: Float[Array, "s 3 3"]
    bias_own: Float[Array, "s 3 3"]
    gyr1: Float[Array, "s 3"]
    gyr2: Float[Array, "s 3"]
    acc1: Float[Array, "s 3"]
    mag1: Float[Array, "s 3"]
    past: Float[Array, "s 9"]
    scalar: Float[Array, " 2"]
    turn: Float[Array, "s 3"]
    slow: Float[Array, "s 5"]
    root: Float[Array, "s 8"]


@dataclass(frozen=True, slots=True, eq=False)
class Tape:
    """What a smoother needs of every step; the arrays are the kernel's.

    Attributes:
        q_after: Orientations of the instant before, corrected.
        sure: Precision before that correction, of each sensor given its parent [1/rad²].
        follow: How each one's error then followed its parent's.
        spread: Variance that the step to this instant added [rad²].
    """

    q_after: Float[Array, "n s 4"]
    sure: Float[Array, "n s 3 3"]
    follow: Float[Array, "n s 3 3"]
    spread: Float[Array, "n s"]


def blank_tape(instants: int, sensors: int) -> Tape:
    """Room for so many instants."""
    return Tape(
        np.zeros((instants, sensors, 4)),
        np.zeros((instants, sensors, 3, 3)),
        np.zeros((instants, sensors, 3, 3)),
        np.zeros((instants, sensors)),
    )


_ARRAYS = tuple(field.name for field in fields(TreeState))[1:]
_SHAPES = {
    "q": (4,),
    "cov": (3, 3),
    "edge": (3, 3),
    "bias_cov": (3, 3),
    "bias_own": (3, 3),
    "past": (9,),
    "slow": (5,),
    "root": (8,),
}


class _Packed(msgspec.Struct):
    kind: Literal["tree"]
    period_s: float
    sensors: int
    arrays: dict[str, bytes]


class TreeFilter(msgspec.Struct, frozen=True, tag="tree"):
    """What the filter believes of sensors and of people; chosen on people kept for development.

    An error that lasts for a while counts as one piece of knowledge in that time, however often it
    is sampled: ``noise`` is its standard deviation, ``lasts`` how long it stays.

    Attributes:
        gyr_noise: White noise of a gyroscope [rad/sqrt(s)].
        acc_noise: Of an acceleration at a joint's centre, seen from both sides [m/s²].
        acc_share: And more, as a share of what it differs from gravity.
        joint_lasts_s: How long such errors last.
        root_noise: By how much the root's mean force is not gravity [m/s²] ...
        root_share: ... and more, as a share of how far single ones are from that mean ...
        root_lasts_s: ... over so long.
        axis_noise: How far a joint does not keep its axes [rad] ...
        axis_lasts_s: ... and for how long.
        axis_walk: How its axes wander in the sensor [rad/sqrt(s)].
        mag_noise: Of a heading by compass [rad] ...
        mag_lasts_s: ... and how long it stays.
        mag_off: How far a compass is off, to begin with [rad] ...
        mag_walk: ... and how that wanders [rad/sqrt(s)].
        long_s: How long what is learnt of axes and compasses counts as one piece of knowledge.
        use_magnetometer: Off: headings from the opening and from the joints alone.
        bias_walk: How a gyroscope's bias wanders [rad/s/sqrt(s)].
        rest_rate: A sensor that turns slower than this [rad/s] ...
        rest_s: ... for so long is at rest.
        rest_noise: Of a bias read at rest [rad/s sqrt(s)].
        jump: A rate that changes faster is no hand's [rad/s²].
        gate: What is so many standard deviations off counts less.
    """

    gyr_noise: float = float(np.deg2rad(0.1))
    acc_noise: float = 0.25
    acc_share: float = 0.1
    joint_lasts_s: float = 0.05
    root_noise: float = 0.05
    root_share: float = 0.03
    root_lasts_s: float = 1.0
    axis_lasts_s: float = 0.5
    mag_noise: float = float(np.deg2rad(3.0))
    mag_lasts_s: float = 0.5
    use_magnetometer: bool = True
    bias_walk: float = float(np.deg2rad(0.008))
    rest_rate: float = float(np.deg2rad(1.5))
    rest_s: float = 1.5
    rest_noise: float = float(np.deg2rad(0.02))
    jump: float = 2000.0
    gate: float = 3.0
    axis_noise: float = float(np.deg2rad(1.5))
    axis_walk: float = float(np.deg2rad(0.1))
    mag_off: float = float(np.deg2rad(6.0))
    mag_walk: float = float(np.deg2rad(0.03))
    long_s: float = 20.0

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> TreeState:
        """State before the first sample: nothing is known."""
        zeros = np.zeros((sensors, 3))
        none, eye = np.zeros((sensors, 3, 3)), np.tile(np.eye(3), (sensors, 1, 1))
        return TreeState(
            1.0 / rate_hz,
            np.tile(so3.IDENTITY, (sensors, 1)),
            eye * _UNKNOWN_HEADING**2,
            none,
            zeros,
            eye * _UNPLACED_BIAS**2,
            none,
            zeros,
            zeros,
            zeros,
            zeros,
            np.zeros((sensors, 9)),
            np.zeros(2),
            zeros,
            np.tile([_UNTOLD, 0.0, self.mag_off**2, 0.0, 0.0], (sensors, 1)),
            np.zeros((sensors, 8)),
        )

    def restart(self, state: TreeState) -> TreeState:
        """Forget attitudes, keep biases; what was shown last is held until a reading comes."""
        fresh = self.begin(len(state.q), 1.0 / state.period_s)
        return replace(
            fresh,
            q=state.q,
            bias=state.bias,
            bias_cov=np.clip(state.bias_cov, 0.0, None) * np.eye(3),
        )

    def place(
        self,
        state: TreeState,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
        heading_sd_rad: float = ALIGNED_SD,
    ) -> TreeState:
        """Set a sensor's attitude and bias, as found at rest; it then knows nothing of others."""
        new = {name: getattr(state, name).copy() for name in _ARRAYS}
        new["q"][sensor], new["bias"][sensor] = q_world_sensor, gyr_bias
        sd = [_PLACED_TILT, _PLACED_TILT, heading_sd_rad]
        new["cov"][sensor] = np.diag(np.square(sd))
        new["edge"][sensor] = 0.0
        new["bias_cov"][sensor] = np.eye(3) * _PLACED_BIAS**2
        new["bias_own"][sensor] = 0.0
        new["past"][sensor, 8] = PLACED
        new["root"][sensor] = 0.0
        return TreeState(state.period_s, **new)

    def turned(self, state: TreeState, turns: Float[Array, "s 4"]) -> TreeState:
        """The state with sensors turned in the world."""
        turn = so3.to_matrix(turns)
        back = np.swapaxes(turn, -1, -2)
        return replace(
            state,
            q=so3.multiply(turns, state.q),
            cov=turn @ state.cov @ back,
            bias_own=state.bias_own @ back,
            root=np.zeros_like(state.root),
            edge=np.zeros_like(state.edge),  # neighbours are where they were not
        )

    def rejoined(self, state: TreeState) -> TreeState:
        """The state on other joints: how far axes are off is forgotten, orientations stay."""
        slow = state.slow.copy()
        slow[:, 0] = _UNTOLD
        return replace(state, slow=slow, turn=np.zeros_like(state.turn))

    def run(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], TreeState]:
        """Fuse consecutive samples."""
        fused = self.fused(state, samples, stretch, heeded, mechanism)
        return fused.q_world_sensor, fused.state

    def fused(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> Fused[TreeState]:
        """Fuse consecutive samples, and tell how sure it is."""
        return self.recorded(state, samples, stretch, heeded, mechanism, rows=0)[0]

    def recorded(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
        *,
        rows: int | None = None,
    ) -> tuple[Fused[TreeState], Tape]:
        """As `fused`, with what a smoother needs of every step (``rows`` 0: nothing)."""
        from handstudio.fusion.tree_kernel import run  # noqa: PLC0415 - numba takes a second

        n, s = samples.gyr.shape[:2]
        joints = bare(s) if mechanism is None else mechanism
        fresh = samples.fresh & np.isfinite(samples.mag).all(axis=-1) & self.use_magnetometer
        flags = (heeded * HEEDED + (heeded & fresh) * FRESH + samples.saturated * SATURATED).astype(
            np.int64
        )
        new = Memory(*(np.array(getattr(state, name)) for name in _ARRAYS))
        _first_doubt(new.slow, joints)
        out, sd = np.empty((n, s, 4)), np.empty((n, s, 2))
        tape = blank_tape(n if rows is None else rows, s)
        run(
            self._beliefs,
            _as_arrays(joints),
            new,
            _finite(samples.gyr, heeded),
            _finite(samples.acc, heeded),
            _finite(samples.mag, heeded & fresh),
            flags,
            stretch * state.period_s,
            out,
            sd,
            (tape.q_after, tape.sure, tape.follow, tape.spread),
        )
        return Fused(out, sd, TreeState(state.period_s, *new)), tape

    def pack(self, state: TreeState) -> bytes:
        """Serialise a state, to the last bit."""
        arrays = {name: getattr(state, name).tobytes() for name in _ARRAYS}
        return msgspec.msgpack.encode(_Packed("tree", state.period_s, len(state.q), arrays))

    def unpack(self, packed: bytes) -> TreeState:
        """Inverse of `pack`."""
        try:
            got = msgspec.msgpack.decode(packed, type=_Packed)
            arrays = {name: _array(got, name) for name in _ARRAYS}
        except (msgspec.MsgspecError, KeyError, ValueError) as error:
            raise SetupError(
                "The saved filter state is not one of {filter} ({reason}).",
                "Process the take again from its start: handstudio process --from-start.",
                filter="tree",
                reason=error,
            ) from error
        return TreeState(got.period_s, **arrays)

    @property
    def _beliefs(self) -> Beliefs:
        known = {
            name: getattr(self, name) for name in Beliefs._fields if not name.startswith("unknown")
        }
        return Beliefs(**known, unknown_tilt=_UNKNOWN_TILT, unknown_heading=_UNKNOWN_HEADING)


_UNTOLD = -1.0
"""In place of how well axes are known, until the first run tells it by the mechanism."""

_UNKNOWN_TILT = float(np.deg2rad(10.0))
_UNKNOWN_HEADING = float(np.deg2rad(20.0))


def _finite(signal: Array, use: Array) -> Array:
    return np.ascontiguousarray(np.where(use[..., None], signal, 0.0))


def _first_doubt(slow: Array, mechanism: Mechanism) -> None:
    """Axes are known as calibrated until the filter has learnt better."""
    slow[:, 0] = np.where(slow[:, 0] < 0.0, mechanism.axis_sd_rad**2, slow[:, 0])


def _array(got: _Packed, name: str) -> Array:
    shape = (2,) if name == "scalar" else (got.sensors, *_SHAPES.get(name, (3,)))
    return np.frombuffer(got.arrays[name]).reshape(shape).copy()


@lru_cache(maxsize=16)  # asked for with every chunk of a stream
def _as_arrays(mechanism: Mechanism) -> Joints:
    """What the kernel is told of the joints: their axes in both sensors."""
    x, y, z = np.eye(3)
    return Joints(
        mechanism.order,
        mechanism.parent,
        mechanism.axes,
        mechanism.t_parent_joint,
        mechanism.t_sensor_joint,
        so3.rotate(mechanism.q_parent_joint, x),
        so3.rotate(mechanism.q_parent_joint, y),
        so3.rotate(mechanism.q_parent_joint, z),
        so3.rotate(mechanism.q_sensor_joint, x),
        so3.rotate(mechanism.q_sensor_joint, y),
        so3.rotate(mechanism.q_sensor_joint, z),
        mechanism.axis_sd_rad,
        mechanism.lever_sd_m,
        mechanism.heading_rad,
        _ends(mechanism.range_rad),
        mechanism.gyr_share,
        mechanism.mean_rates,
    )


def _ends(range_rad: Float[Array, "s 2 2"]) -> Float[Array, "s 2 3"]:
    """Ends of the turns as the kernel compares them; where nothing is known none is beyond."""
    known = np.asarray(np.isfinite(range_rad).all(axis=-1))
    ends = np.where(known[..., None], range_rad, 0.0)
    middle, half = 0.5 * (ends[..., 0] + ends[..., 1]), 0.5 * (ends[..., 1] - ends[..., 0])
    never = np.where(known, np.cos(half), _NEVER)
    return np.stack([np.cos(middle), np.sin(middle), never], axis=-1)


_NEVER = -2.0
