"""What a hand holds for a while: where it is follows from where the segments are."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from jaxtyping import Float

from handstudio.arrays import Array


@runtime_checkable
class Held(Protocol):
    """A thing in a hand; as long as a `trajectory.Span` has it, it is held."""

    def pose(
        self, q_world_segment: Float[Array, "n k 4"], t_world_joint: Float[Array, "n k 3"]
    ) -> tuple[Float[Array, "n 4"], Float[Array, "n 3"]]:
        """Its attitude and the place of its origin in the world [m]."""
        ...
