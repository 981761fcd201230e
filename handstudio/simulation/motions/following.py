"""Postures whose pen has its tip where it should be: many instants at once.

A hand that writes has more joints than a pen's tip has directions. What is left is decided by
habit: every joint stays as near to its habitual turn as it is stiff, so that the posture is one
smooth function of the tip's place, and writing the same again is moving the same again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.angles import DEVIATION, joint_index
from handstudio.hand.skeleton import FINGERS, SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.motions.pen import HOLDING, WRITING_JOINTS, HeldPen, writing_channels
from handstudio.simulation.placing import Placed, Placer, limits, placer
from handstudio.simulation.solving import settled
from handstudio.simulation.subject import Subject

# How far joints readily depart from habit while somebody writes [deg], flexion, deviation,
# rotation: the forearm rests, so mostly fingers and wrist. Ours.
_READY_DEG = {
    "elbow": (0.3, 1.2, 2.0),
    "wrist": (8.0, 6.0),
    "thumb_cmc": (6.0, 6.0, 4.0),
    "thumb_mcp": (8.0, 3.0),
    "thumb_ip": (8.0,),
    **{f"{finger}_mcp": (8.0, 4.0) for finger in FINGERS[1:]},
    **{f"{finger}_{joint}": (8.0,) for finger in FINGERS[1:] for joint in ("pip", "dip")},
}
_PEN_TILTS_DEG = 15.0
_COUPLED_DEG = 3.0  # how far a last joint strays from what the one before makes it do
_GLIDES_M = 0.0005  # and the hand's outer side from the height it rests at
_NEAR_RAD, _STRAIN = (
    np.deg2rad(6.0),
    4.0,
)  # from the end of a range of motion; there, against habits
_GLIDING = ("little_intermediate", "little_distal")
# Ever more exactly: at once takes long. Against habits the last is exact: what remains is under a
# micrometre.
_EXACT_M = (1e-3, 1e-4, 2e-5)
_NEARLY, _WITHIN = 1e-3, 1e-7  # rad


def following(
    subject: Subject, pen: HeldPen, tip: Float[Array, "n 3"], swing: Float[Array, " n"]
) -> Float[Array, "n c"]:
    """Postures that hold the pen with its tip at these places.

    Args:
        subject: Whose hand it is.
        pen: As that person holds it.
        tip: In the forearm's frame at the start [m].
        swing: Where the forearm would like to be: about the vertical, from the habit [rad].
    """
    task = _task(placer(subject), pen, tip, swing)
    found = task.usual()
    for exact_m in _EXACT_M:
        task = replace(task, exact_m=exact_m)
        found = settled(task.sloped, found, _WITHIN if exact_m == _EXACT_M[-1] else _NEARLY)
    return task.postures(found)


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """Unknown are turns, and the pen's rotation vector from its habitual attitude, swung along."""

    place: Placer
    pen: HeldPen
    active: list[int]
    habit: Float[Array, "n c"]
    tip: Float[Array, "n 3"]
    arms: Float[Array, "n 3 3"]  # from the tip to the skin that holds it, habitually
    resting: Float[Array, " p"]  # heights of what glides
    leaning: Float[Array, "r x"]  # what habit makes of departures from it
    limits: tuple[Float[Array, " a"], Float[Array, " a"]]
    exact_m: float = _EXACT_M[0]

    def postures(self, x: Array) -> Array:
        """Unknowns as postures."""
        out = self.habit.copy()
        out[:, self.active] = x[:, : len(self.active)]
        return out

    def sloped(self, x: Array, rows: Array) -> tuple[Array, Array]:
        """Residuals in units of what each may be off, and their slopes, of some instants."""
        some = replace(self, habit=self.habit[rows], tip=self.tip[rows], arms=self.arms[rows])
        return some.weighed(x)

    def weighed(self, x: Array) -> tuple[Array, Array]:
        """The same, of all instants."""
        placed, tilt = self.place.placed(self.postures(x)), x[:, len(self.active) :]
        away = x - self.usual()
        habit = np.broadcast_to(self.leaning, (len(x), *self.leaning.shape))
        parts = [
            self.touching(placed, tilt),
            self.gliding(placed),
            self.straining(x),
            (away @ self.leaning.T, habit),
        ]
        return (
            np.concatenate([residuals for residuals, _ in parts], axis=1),
            np.concatenate([slopes for _, slopes in parts], axis=1),
        )

    def usual(self) -> Array:
        """The unknowns of habit."""
        return np.concatenate([self.habit[:, self.active], np.zeros((len(self.habit), 3))], axis=1)

    def touching(self, placed: Placed, tilt: Array) -> tuple[Array, Array]:
        """How far three points of skin are from where the pen would have them."""
        holding = [SEGMENTS.index(name) for name in HOLDING]
        skin = placed.points(holding, self.pen.pads)
        arms = so3.rotate(so3.exp(tilt)[:, None], self.arms)
        apart = skin - self.tip[:, None] - arms
        slopes = np.concatenate(
            [
                placed.slopes(skin, holding, self.active),
                _crossing(arms) @ _turned_by(tilt)[:, None],
            ],
            axis=-1,
        )
        n = len(tilt)
        return apart.reshape(n, 9) / self.exact_m, slopes.reshape(n, 9, -1) / self.exact_m

    def gliding(self, placed: Placed) -> tuple[Array, Array]:
        """How far the hand's outer side has left the desk."""
        segments, far = _gliding(self.place.subject)
        points = placed.points(segments, far)
        moved = placed.slopes(points, segments, self.active)[:, :, 2]
        slopes = np.concatenate([moved, np.zeros((*moved.shape[:2], 3))], axis=-1)
        return (points[..., 2] - self.resting) / _GLIDES_M, slopes / _GLIDES_M

    def straining(self, x: Array) -> tuple[Array, Array]:
        """How near joints are to the ends of their range; smooth where it sets in."""
        c = len(self.active)
        least, most = self.limits
        above = np.maximum(x[:, :c] - (most - _NEAR_RAD), 0.0) / _NEAR_RAD
        below = np.minimum(x[:, :c] - (least + _NEAR_RAD), 0.0) / _NEAR_RAD
        slopes = np.zeros((len(x), c, c + 3))
        np.einsum("nii->ni", slopes[..., :c])[:] = 2.0 * _STRAIN * (above + below) / _NEAR_RAD
        return _STRAIN * (above**2 + below**2), slopes


def _task(place: Placer, pen: HeldPen, tip: Array, swing: Array) -> _Task:
    active = writing_channels()
    habit = np.tile(pen.posture, (len(tip), 1))
    habit[:, DEVIATION] += swing
    arms = so3.rotate(so3.about_z(swing)[:, None], pen.contacts @ pen.attitude.T)
    resting = place.placed(pen.posture[None]).points(*_gliding(place.subject))[0, :, 2]
    leaning = _leaning(place.subject, active)
    least, most = limits(place.subject)
    ends = (least[active], most[active])
    return _Task(place, pen, active, habit, tip, arms, resting, leaning, ends)


def _gliding(subject: Subject) -> tuple[list[int], Array]:
    segments = [SEGMENTS.index(name) for name in _GLIDING]
    return segments, subject.skeleton.t_far_end[segments]


def _leaning(subject: Subject, active: list[int]) -> Array:
    """A row each for joints, the pen and coupled joints; columns are unknowns."""
    ready = [_READY_DEG[name][turn] for name, turns in WRITING_JOINTS for turn in range(turns)]
    rows = [np.diag(1.0 / np.deg2rad(ready + [_PEN_TILTS_DEG] * 3))]
    for finger, ratio in zip(FINGERS[1:], subject.dip_per_pip, strict=True):
        pip, dip = (3 * joint_index(f"{finger}_{joint}") for joint in ("pip", "dip"))
        if dip in active:
            row = np.zeros((1, len(active) + 3))
            row[0, active.index(dip)], row[0, active.index(pip)] = 1.0, -ratio
            rows.append(row / np.deg2rad(_COUPLED_DEG))
    return np.concatenate(rows)


def _crossing(v: Array) -> Array:
    """Matrices of the cross product with vectors."""
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _turned_by(rotation: Array) -> Array:
    """How rotation vectors turn, in the outer frame, as they change: the left Jacobian of SO(3)."""
    angle = np.linalg.norm(rotation, axis=-1)[:, None, None]
    k = _crossing(rotation)
    near = angle < 1e-4
    safe = np.where(near, 1.0, angle)
    first = np.where(near, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(near, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    turned: Array = np.eye(3) + first * k + second * (k @ k)
    return turned
