"""Where a terminal of a tracker was: a coil, or a cluster of markers, by the tracker itself."""

from __future__ import annotations

from dataclasses import dataclass

from jaxtyping import Float, Int64

from handstudio.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Poses of one terminal in the tracker's own frame, the room.

    Attributes:
        name: Which terminal.
        time_us: When the pose was, or, where the tracker is late, when it was told [µs], on the
            clock of the stream.
        t_room_terminal: Where the terminal was [m]; NaN where unseen.
        q_room_terminal: How it was turned, scalar first; NaN where unseen.
        quality: How far the pose can be believed: 0 unseen to 1.
    """

    name: str
    time_us: Int64[Array, " n"]
    t_room_terminal: Float[Array, "n 3"]
    q_room_terminal: Float[Array, "n 4"]
    quality: Float[Array, " n"]

    def __getitem__(self, part: slice | Array) -> Track:
        return Track(
            self.name,
            self.time_us[part],
            self.t_room_terminal[part],
            self.q_room_terminal[part],
            self.quality[part],
        )
