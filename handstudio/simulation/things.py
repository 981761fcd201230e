"""Where the things were that a hand held, and whether a pen wrote."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.simulation.graspable import HeldObject
from handstudio.simulation.holding import Held
from handstudio.simulation.motions.pen import HeldPen
from handstudio.simulation.trajectory import Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Things:
    """What a hand held at every instant.

    Attributes:
        q_world_held: Attitude of the thing; of a pen, z along it to its end. NaN: nothing is held.
        t_world_held: Place of its origin [m]: of a pen its tip, of other things their middle.
        pen_down: Whether it was a pen and wrote.
        told: Each thing once: from and to [s], name, shape and size [m].
    """

    q_world_held: Float[Array, "n 4"]
    t_world_held: Float[Array, "n 3"]
    pen_down: Bool[Array, " n"]
    told: tuple[dict[str, object], ...]


def things_held(
    trajectory: Trajectory,
    time_us: Int64[Array, " n"],
    q_world_segment: Float[Array, "n k 4"],
    t_world_joint: Float[Array, "n k 3"],
) -> Things:
    """Things in the hand, from the true segments at instants of a motion."""
    time_s = time_us * 1e-6 - trajectory.begins_s
    time_s = np.mod(time_s, trajectory.duration_s) if trajectory.periodic else time_s
    q, t = np.full((len(time_us), 4), np.nan), np.full((len(time_us), 3), np.nan)
    down, told = np.zeros(len(time_us), dtype=bool), []
    for span in trajectory.spans:
        if span.held is None:
            continue
        now = (span.start_s <= time_s) & (time_s <= span.end_s)
        q[now], t[now] = span.held.pose(q_world_segment[now], t_world_joint[now])
        if isinstance(span.held, HeldPen):
            down[now] = span.held.writes(t[now])
        told.append(
            {
                "start_s": float(span.start_s),
                "end_s": float(span.end_s),
                "name": span.name,
                **_shape(span.held),
            }
        )
    return Things(q, t, down, tuple(told))


def _shape(held: Held) -> dict[str, object]:
    match held:
        case HeldPen():
            sizes = {
                name: float(getattr(held, name)) for name in ("radius_m", "length_m", "desk_m")
            }
            return {"shape": "pen", **sizes}
        case HeldObject(shape=shape):
            return {"shape": type(shape).__name__.lower(), **asdict(shape)}  # type: ignore[call-overload]
        case _:
            return {}
