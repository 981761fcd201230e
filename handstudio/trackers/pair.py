"""Two terminals beside a joint: the lower one in the frame of the upper one, and both at rest.

Upper and lower are the seed's words: the upper terminal sits on the phalanx nearer to the hand. All
places are in the frame of the upper terminal unless a name says otherwise. The seed's segment
frames (0084 to 0090) are the transmitter's at rest, moved along: the room's axes then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.findings import seen_at
from handstudio.trackers.poses import mean_attitude, seen_from
from handstudio.trackers.track import Track

LEAST_FRAMES = 30
"""Fewer tell of noise only."""

LEAST_REST = 5


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A joint bent, seen by the terminals on both its sides.

    Attributes:
        time_us: Instants at which both were seen.
        q_upper_lower: Attitude of the lower terminal in the upper one's frame.
        t_upper_lower: Its place [m].
        q_room_upper: Attitude of the upper terminal itself, in the tracker's frame.
        t_room_upper: Its place [m].
        rest_q_upper_lower: The first of these while the finger was held straight.
        rest_t_upper_lower: The place then [m].
        rest_q_room_upper: The attitude then: what turns the room's axes into the terminal's.
    """

    time_us: Int64[Array, " n"]
    q_upper_lower: Float[Array, "n 4"]
    t_upper_lower: Float[Array, "n 3"]
    q_room_upper: Float[Array, "n 4"]
    t_room_upper: Float[Array, "n 3"]
    rest_q_upper_lower: Float[Array, "4"]
    rest_t_upper_lower: Float[Array, "3"]
    rest_q_room_upper: Float[Array, "4"]

    def __len__(self) -> int:
        return len(self.time_us)

    @property
    def turn(self) -> Float[Array, "n 3"]:
        """Rotation vectors [rad] of the lower segment against rest, in the upper one's frame."""
        back = so3.conjugate(self.rest_q_upper_lower)
        return so3.log(so3.multiply(self.q_upper_lower, back))

    def of(self, used: Bool[Array, " n"]) -> Pair:
        """Some instants of it."""
        return replace(
            self,
            time_us=self.time_us[used],
            q_upper_lower=self.q_upper_lower[used],
            t_upper_lower=self.t_upper_lower[used],
            q_room_upper=self.q_room_upper[used],
            t_room_upper=self.t_room_upper[used],
        )

    def swapped(self) -> Pair:
        """The same with the terminals' parts exchanged: what was upper is lower."""
        q_lower_upper = so3.conjugate(self.q_upper_lower)
        rest = so3.conjugate(self.rest_q_upper_lower)
        return Pair(
            self.time_us,
            q_lower_upper,
            -so3.rotate(q_lower_upper, self.t_upper_lower),
            so3.multiply(self.q_room_upper, self.q_upper_lower),
            self.t_room_upper + so3.rotate(self.q_room_upper, self.t_upper_lower),
            rest,
            -so3.rotate(rest, self.rest_t_upper_lower),
            so3.multiply(self.rest_q_room_upper, self.rest_q_upper_lower),
        )


def pair_of(
    upper: Track,
    lower: Track,
    rest: Bool[Array, " n"],
    moving: Bool[Array, " n"],
    doubted: Bool[Array, " n"] | None = None,
) -> Pair:
    """Two tracks of one stream as a pair: instants at which both were seen.

    Args:
        upper: The terminal nearer to the hand.
        lower: The one beyond the joint; the same instants.
        rest: While the finger was held straight.
        moving: While it was bent.
        doubted: Instants that are not to be used.

    Raises:
        TrackError: the tracks are not of one stream, or too little of them can be used.
    """
    if len(upper.time_us) != len(lower.time_us) or np.any(upper.time_us != lower.time_us):
        raise TrackError(
            "{upper} and {lower} have different instants.",
            "Take both from one file or stream, or bring them onto one clock first.",
            upper=upper.name,
            lower=lower.name,
        )
    seen = seen_at(upper) & seen_at(lower)
    if doubted is not None:
        seen = seen & ~doubted
    at_rest, used = rest & seen, moving & seen
    _enough(at_rest, used)
    q, t = seen_from(
        upper.q_room_terminal,
        upper.t_room_terminal,
        lower.q_room_terminal,
        lower.t_room_terminal,
    )
    return Pair(
        upper.time_us[used],
        q[used],
        t[used],
        upper.q_room_terminal[used],
        upper.t_room_terminal[used],
        mean_attitude(q[at_rest]),
        np.asarray(np.median(t[at_rest], axis=0)),
        mean_attitude(upper.q_room_terminal[at_rest]),
    )


def joined(takes: Sequence[Pair]) -> Pair:
    """Takes of the same terminals, never taken off, as one (the seed joins five, 0108).

    Rest is that of all; each was held straight anew, and never quite the same.
    """
    names = ("q_upper_lower", "t_upper_lower", "q_room_upper", "t_room_upper")
    together = {name: np.concatenate([getattr(take, name) for take in takes]) for name in names}
    last, times = 0, []
    for take in takes:
        times.append(take.time_us - take.time_us[0] + last)
        last = int(times[-1][-1]) + 1_000_000
    return Pair(
        np.concatenate(times),
        **together,
        rest_q_upper_lower=mean_attitude(np.stack([take.rest_q_upper_lower for take in takes])),
        rest_t_upper_lower=np.mean([take.rest_t_upper_lower for take in takes], axis=0),
        rest_q_room_upper=mean_attitude(np.stack([take.rest_q_room_upper for take in takes])),
    )


def _enough(at_rest: Array, used: Array) -> None:
    if np.count_nonzero(at_rest) < LEAST_REST:
        raise TrackError(
            "Both terminals are seen in {count} frames while the finger is straight; {least} are "
            "needed.",
            "Hold the finger straight for 3 s first, both terminals in sight.",
            count=int(np.count_nonzero(at_rest)),
            least=LEAST_REST,
        )
    if np.count_nonzero(used) < LEAST_FRAMES:
        raise TrackError(
            "Both terminals are seen in {count} frames while the finger is bent; {least} are "
            "needed.",
            "Bend it for 20 s, both terminals in sight.",
            count=int(np.count_nonzero(used)),
            least=LEAST_FRAMES,
        )
