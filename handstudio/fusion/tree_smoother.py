"""The smoother: what the tree filter knew at every step, with what came after taken in.

Rauch, Tung and Striebel's backward pass. From one instant to the next errors stay but for what the
step adds, ``x_k+1 = x_k + n``, ``n`` of variance Q, so the smoothed error of the instant before is

    x_k = x_k|k + (1 - Q S) d,      d = x_k+1 - x_k+1|k

with S the inverse of the covariance before the correction, which the filter's tree gives as a sum
over sensors: nothing of the size of the whole hand is ever inverted. Covariances go back with it
(`tree_earlier`). Biases stay as the filter had them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import no_type_check

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion.filter import ALIGNED_SD, Fused
from handstudio.fusion.mechanism import Mechanism
from handstudio.fusion.tree_filter import Tape, TreeFilter, TreeState
from handstudio.samples import ImuSamples


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Steps that follow one another.

    Attributes:
        q_world_sensor: What the filter gave out after each ...
        sd_rad: ... and how sure it was.
        tape: What it kept of each.
        shown: Whether its instants are in the motion; over missing ones it only steps.
    """

    q_world_sensor: Float[Array, "n s 4"]
    sd_rad: Float[Array, "n s 2"]
    tape: Tape
    shown: bool


class Taping:
    """A tree filter that keeps what a smoother needs, for as long as nobody takes it.

    It stands in a setup for the filter it tapes; a None among the stretches is a new beginning.
    """

    def __init__(self, filter: TreeFilter) -> None:
        self._filter = filter
        self.stretches: list[Stretch | None] = []

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> TreeState:
        """As the filter."""
        return self._filter.begin(sensors, rate_hz, magnetometer_rate_hz)

    def place(
        self,
        state: TreeState,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
        heading_sd_rad: float = ALIGNED_SD,
    ) -> TreeState:
        """As the filter."""
        return self._filter.place(state, sensor, q_world_sensor, gyr_bias, heading_sd_rad)

    def turned(self, state: TreeState, turns: Float[Array, "s 4"]) -> TreeState:
        """As the filter."""
        return self._filter.turned(state, turns)

    def rejoined(self, state: TreeState) -> TreeState:
        """As the filter."""
        return self._filter.rejoined(state)

    def pack(self, state: TreeState) -> bytes:
        """As the filter."""
        return self._filter.pack(state)

    def unpack(self, packed: bytes) -> TreeState:
        """As the filter."""
        return self._filter.unpack(packed)

    def restart(self, state: TreeState) -> TreeState:
        """As the filter does; nothing is carried back over it."""
        self.stretches.append(None)
        return self._filter.restart(state)

    def run(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], TreeState]:
        """Steps over missing instants."""
        fused = self._taped(state, samples, stretch, heeded, mechanism, shown=False)
        return fused.q_world_sensor, fused.state

    def fused(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> Fused[TreeState]:
        """Steps whose instants are in the motion."""
        return self._taped(state, samples, stretch, heeded, mechanism, shown=True)

    def _taped(
        self,
        state: TreeState,
        samples: ImuSamples,
        stretch: Array,
        heeded: Array,
        mechanism: Mechanism | None,
        *,
        shown: bool,
    ) -> Fused[TreeState]:
        fused, tape = self._filter.recorded(state, samples, stretch, heeded, mechanism)
        self.stretches.append(Stretch(fused.q_world_sensor, fused.sd_rad, tape, shown))
        return fused


def smoothed(
    stretches: Sequence[Stretch | None], mechanism: Mechanism
) -> tuple[Float[Array, "n s 4"], Float[Array, "n s 2"]]:
    """Orientations of all shown instants, the future up to the last of them taken in.

    Returns:
        Orientations, and how sure they are, as `Fused` has it.
    """
    parts, unbroken = list[tuple[Array, Array]](), list[Stretch]()
    for stretch in (*stretches, None):
        if stretch is not None:
            unbroken.append(stretch)
        elif unbroken:
            parts.append(_backwards(unbroken, mechanism))
            unbroken = []
    if not parts:
        return np.empty((0, mechanism.sensors, 4)), np.empty((0, mechanism.sensors, 2))
    q, sd = zip(*parts, strict=True)
    return np.concatenate(q), np.concatenate(sd)


def _backwards(stretches: list[Stretch], mechanism: Mechanism) -> tuple[Array, Array]:
    out = np.concatenate([s.q_world_sensor for s in stretches])
    tapes = [np.concatenate([getattr(s.tape, name) for s in stretches]) for name in Tape.__slots__]
    shown = np.concatenate([np.full(len(s.q_world_sensor), s.shown) for s in stretches])
    q, sd = out.copy(), np.concatenate([s.sd_rad for s in stretches])
    _kernel()(mechanism.order, mechanism.parent, out, *tapes, q, sd)
    return q[shown], sd[shown]


@no_type_check
def _kernel():
    """The loop, compiled when it is first asked for."""
    from handstudio.fusion.tree_backward import backward  # noqa: PLC0415 - numba takes a second

    return backward
