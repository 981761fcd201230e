"""What every filter promises.

A filter is frozen parameters; its state is a value that goes in and comes out. The order of the
sensors is the layout's. Orientations are ``q_world_sensor``: z up, x along the horizontal
magnetic field.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Generic, Protocol, TypeGuard, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion.mechanism import Mechanism
from handstudio.samples import ImuSamples

State = TypeVar("State")

ALIGNED_SD = float(np.deg2rad(0.5))
"""Of headings that a turn of the whole rig has aligned [rad]."""

COMPASS_SD = float(np.deg2rad(4.5))
"""Of headings by compasses (the thesis, 4.2.5) [rad]."""

UNKNOWN_SD = float(np.deg2rad(104.0))
"""Of a heading that nothing tells [rad]: any direction is as likely."""


@runtime_checkable
class Filter(Protocol[State]):
    """A fusion filter over all sensors of a layout."""

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> State:
        """State before the first sample: attitude from whatever the first sample says.

        ``magnetometer_rate_hz`` is how often fresh readings come; None: with every sample.
        """
        ...

    def restart(self, state: State) -> State:
        """Forget all attitudes (the device was away for long), keep what is known of sensors."""
        ...

    def place(
        self,
        state: State,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
    ) -> State:
        """Set a sensor's attitude and gyroscope bias [rad/s], as found at rest."""
        ...

    def run(
        self,
        state: State,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], State]:
        """Fuse consecutive samples.

        Args:
            state: Where the last run ended.
            samples: No instant missing between them.
            stretch: Length of the step that leads to each sample, in nominal sample periods.
            heeded: Where a sensor's reading is used; elsewhere its orientation is held.
            mechanism: What joins the sensors; None: nothing, and filters of single sensors do
                not ask.

        Returns:
            Orientation after each sample, and the state to go on from. Cutting ``samples``
            anywhere changes no digit.
        """
        ...

    def pack(self, state: State) -> bytes:
        """Serialise a state, to the last bit."""
        ...

    def unpack(self, packed: bytes) -> State:
        """Inverse of `pack`.

        Raises:
            SetupError: these bytes are not a state of this filter.
        """
        ...


@runtime_checkable
class WholeFilter(Filter[State], Protocol[State]):
    """A filter that sees the sensors together: in one world, and knowing how sure it is.

    What others leave to a turn afterwards (4.22) must be right within it: its states and results
    are in the world that `Mechanism.heading_rad` turns all sensors into.
    """

    def place(
        self,
        state: State,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
        heading_sd_rad: float = ALIGNED_SD,
    ) -> State:
        """As every filter; and how well its heading agrees with those of the others."""
        ...

    def fused(
        self,
        state: State,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> Fused[State]:
        """As `run`, and how sure it is."""
        ...

    def turned(self, state: State, turns: Float[Array, "s 4"]) -> State:
        """The state with sensors turned in the world: ``q_world_sensor = turns q_world_sensor``."""
        ...

    def rejoined(self, state: State) -> State:
        """The state on another mechanism: what was learnt of the old joints is forgotten."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Fused(Generic[State]):
    """What comes out of a filter that knows how sure it is.

    Attributes:
        q_world_sensor: Orientation after each sample.
        sd_rad: Standard deviation about any axis [rad]: of an orientation, and of that relative to
            the sensor before its joint.
        state: To go on from.
    """

    q_world_sensor: Float[Array, "n s 4"]
    sd_rad: Float[Array, "n s 2"]
    state: State


def sees_all(filter: Filter[Any]) -> TypeGuard[WholeFilter[Any]]:
    """Whether a filter is one over all sensors together."""
    return _is_whole(type(filter))


@cache  # to look through a protocol costs as much as to fuse a sample
def _is_whole(kind: type) -> bool:
    return issubclass(kind, WholeFilter)
