"""A recorded course, prepared for what is computed from it: attitudes, smooth signals, swings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitudes import attitudes_between_rests, unbiased
from handstudio.hand.skeleton import JOINTS, ULNAR
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

SMOOTHING_S = 0.09
"""Stretch that one local polynomial of fourth order is laid through: passes 5 Hz by 99 %."""

_SETTLING_S, _END_S = 0.25, 0.05  # of a labelled rest: boards swing on from the movement before
_BEFORE_S, _AFTER_S = 1.0, 0.3  # of the rest around a swing, which holds its attitude


@dataclass(frozen=True, slots=True)
class Swing:
    """One joint's exercise: the label, and its window with some rest around it."""

    name: str
    joint: str
    turn: str
    window: slice
    moving: slice


@dataclass(frozen=True, slots=True, eq=False)
class Swings:
    """A course as arrays; sensors in the order of the layout.

    Attributes:
        layout: Of the glove.
        rate_hz: Of the samples, which are evenly spaced.
        q_world_sensor: Attitudes.
        gyr: Without bias, smooth [rad/s].
        dgyr: Its derivative [rad/s²].
        acc: Specific force, smooth alike [m/s²].
        swings: In order.
        flat: The flat hand.
        alive: Sensors that answered.
    """

    layout: Layout
    rate_hz: float
    q_world_sensor: Float[Array, "n s 4"]
    gyr: Float[Array, "n s 3"]
    dgyr: Float[Array, "n s 3"]
    acc: Float[Array, "n s 3"]
    swings: tuple[Swing, ...]
    flat: slice
    alive: tuple[int, ...]

    def of_joint(self, joint: str, flexion: bool | None = None) -> list[Swing]:
        """The swings of a joint; only its flexion, or only others, if asked for."""
        mine = [swing for swing in self.swings if swing.joint == joint]
        if flexion is None:
            return mine
        return [swing for swing in mine if (swing.turn == "flexion") == flexion]

    def drivers(self, joint: str) -> tuple[int | None, int | None]:
        """Sensors on parent and child of a joint; None: no sensor there answers."""
        parent, child = {j.name: (j.parent, j.child) for j in JOINTS}[joint]
        first = self.first
        return None if parent is None else first.get(parent), first.get(child)

    @property
    def first(self) -> dict[str, int]:
        """The sensor that defines each segment, of those that answer; a rigid palm has but one."""
        first = self.layout.drivers_among(self.alive)
        if self.layout.hand_type == 1 and "hand" in first:
            first[ULNAR] = first["hand"]
        return first

    def at(self, part: slice) -> Swings:
        """Its signals at some instants; windows and flat hand still count in the whole."""
        signals = ("q_world_sensor", "gyr", "dgyr", "acc")
        return replace(self, **{name: getattr(self, name)[part] for name in signals})

    def q_flat(self, sensor: int) -> Float[Array, " 4"]:
        """Attitude of a sensor in the middle of the flat hand."""
        middle = (self.flat.start + self.flat.stop) // 2
        at: Array = self.q_world_sensor[middle, sensor]
        return at


def prepared(
    layout: Layout,
    rate_hz: float,
    gyr: Float[Array, "n s 3"],
    acc: Float[Array, "n s 3"],
    *,
    labels: Sequence[tuple[float, float, str]],
    heading: Float[Array, " s"],
    alive: Sequence[int],
) -> Swings:
    """Prepare a course.

    Args:
        layout: Of the glove.
        rate_hz: Of the samples, evenly spaced from 0 s on.
        gyr: Freed of the sensors' errors as far as they are known [rad/s].
        acc: Likewise [m/s²].
        labels: Begin and end [s] and name of every stretch; one at least is a rest or flat hand.
        heading: Of every sensor's ``attitude(acc)`` at the first rest [rad].
        alive: Sensors that answered.
    """
    rests = [_inner(a, b, rate_hz, len(gyr)) for a, b, name in labels if name in _STILL]
    free = unbiased(gyr, rests)
    time_s = np.arange(len(gyr)) / rate_hz
    q = attitudes_between_rests(time_s, free, acc, rests, heading)
    flats = [_inner(a, b, rate_hz, len(gyr)) for a, b, name in labels if name == "flat_hand"]
    swung = [x for x in labels if ":" in x[2] and is_there(layout, x[2])]
    return Swings(
        layout=layout,
        rate_hz=rate_hz,
        q_world_sensor=q,
        gyr=smooth(free, rate_hz),
        dgyr=smooth(free, rate_hz, 1),
        acc=smooth(acc, rate_hz),
        swings=tuple(_swing(a, b, name, rate_hz, len(gyr)) for a, b, name in swung),
        flat=flats[-1] if flats else rests[0],
        alive=tuple(alive),
    )


def is_there(layout: Layout, label: str) -> bool:
    """Whether what a label names can be done: a palm that is not hinged has no joint to fold at."""
    return layout.hand_type == 3 or label.partition(":")[0] != "ulnar_cmc"


def joined(parts: Sequence[Swings]) -> Swings:
    """One course after the other, the glove having stayed on; flat hand and headings per part.

    Attitudes of every part are in that part's own world, turned about the vertical against the
    others': only what is relative within one instant counts.
    """
    first = parts[0]
    offsets = np.concatenate([[0], np.cumsum([len(part.gyr) for part in parts])])
    flats = [(i, p.flat) for i, p in enumerate(parts) if p.flat.stop > p.flat.start]
    which, flat = flats[-1]
    return Swings(
        layout=first.layout,
        rate_hz=first.rate_hz,
        q_world_sensor=np.concatenate([part.q_world_sensor for part in parts]),
        gyr=np.concatenate([part.gyr for part in parts]),
        dgyr=np.concatenate([part.dgyr for part in parts]),
        acc=np.concatenate([part.acc for part in parts]),
        swings=tuple(
            replace(
                swing,
                window=_shifted(swing.window, int(offset)),
                moving=_shifted(swing.moving, int(offset)),
            )
            for offset, part in zip(offsets[:-1], parts, strict=True)
            for swing in part.swings
        ),
        flat=_shifted(flat, int(offsets[which])),
        alive=tuple(s for s in first.alive if all(s in part.alive for part in parts)),
    )


def _shifted(part: slice, by: int) -> slice:
    return slice(part.start + by, part.stop + by)


def smooth(
    x: Float[Array, "n *b"], rate_hz: float, derivative: int = 0, stretch_s: float = SMOOTHING_S
) -> Float[Array, "n *b"]:
    """Low-passed, or its derivative, by local polynomials (Savitzky and Golay 1964)."""
    length = max(5, 2 * round(0.5 * stretch_s * rate_hz) + 1)
    from scipy.signal import savgol_filter  # noqa: PLC0415 - takes a second to load

    out: Array = savgol_filter(x, length, 4, deriv=derivative, delta=1.0 / rate_hz, axis=0)
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Pushed:
    """How the bone pushes boards on their skin; `settled` scales it.

    Attributes:
        tilt, tilt_rate, tilt_acc: Tilt in the board's axes, for one rad per m/s², and derivatives.
        further: Acceleration by staying behind, for one m per m/s².
    """

    tilt: Float[Array, "n s 3"]
    tilt_rate: Float[Array, "n s 3"]
    tilt_acc: Float[Array, "n s 3"]
    further: Float[Array, "n s 3"]

    def at(self, part: slice) -> Pushed:
        """At some instants."""
        return Pushed(
            self.tilt[part], self.tilt_rate[part], self.tilt_acc[part], self.further[part]
        )


def pushed(swings: Swings) -> Pushed:
    """What a course's accelerations do to boards."""
    moved = so3.rotate(swings.q_world_sensor, swings.acc) - [0.0, 0.0, STANDARD_GRAVITY]
    moved = so3.rotate(so3.conjugate(swings.q_world_sensor), moved)
    lean = np.stack([moved[..., 1], -moved[..., 0], np.zeros(moved.shape[:2])], axis=-1)
    tilt, rate, more = (smooth(lean, swings.rate_hz, k, _CALM_S) for k in (0, 1, 2))
    return Pushed(tilt, rate, more, -smooth(moved, swings.rate_hz, 2, _CALM_S))


def settled(
    swings: Swings, by: Pushed, tilting: Float[Array, " s"], lagging: Float[Array, " s"]
) -> Swings:
    """The same course as if boards stayed on the bone that is accelerated beneath them.

    A board is a mass on soft skin, far below its own frequency, so it tilts and stays behind as it
    is accelerated. What stays behind in a movement to and fro goes further than the bone: without
    this all arms come out long.

    Args:
        swings: As felt.
        by: What `pushed` makes of them.
        tilting: Tilt of every board for acceleration along it [rad per m/s²].
        lagging: By how much it stays behind [m per m/s²].
    """
    share = tilting[:, None]
    tilt = share * by.tilt
    turned = so3.exp(tilt)
    return replace(
        swings,
        q_world_sensor=so3.multiply(swings.q_world_sensor, so3.conjugate(turned)),
        gyr=so3.rotate(turned, swings.gyr - share * by.tilt_rate),
        dgyr=so3.rotate(turned, swings.dgyr - share * by.tilt_acc),
        acc=so3.rotate(turned, swings.acc - lagging[:, None] * by.further),
    )


def relative_turn(swings: Swings, joint: str) -> Float[Array, "n 3"] | None:
    """Rotation vector of a joint against the flat hand, in its parent sensor's frame [rad].

    The elbow's is in the world's. None where a sensor is missing.
    """
    parent, child = swings.drivers(joint)
    root = {j.name: j.parent is None for j in JOINTS}[joint]
    if child is None or (parent is None and not root):
        return None
    rel, flat = swings.q_world_sensor[:, child], swings.q_flat(child)
    if parent is not None:
        rel = so3.multiply(so3.conjugate(swings.q_world_sensor[:, parent]), rel)
        flat = so3.multiply(so3.conjugate(swings.q_flat(parent)), flat)
    return so3.log(so3.multiply(rel, so3.conjugate(flat)))


_CALM_S = 0.25  # of accelerations that are differentiated twice
_STILL = ("static", "flat_hand", "rest")


def _inner(start_s: float, end_s: float, rate_hz: float, count: int) -> slice:
    return slice(
        max(0, round((start_s + _SETTLING_S) * rate_hz)),
        min(count, round((end_s - _END_S) * rate_hz)),
    )


def _swing(start_s: float, end_s: float, name: str, rate_hz: float, count: int) -> Swing:
    joint, _, turn = name.partition(":")
    wide = slice(
        max(0, round((start_s - _BEFORE_S) * rate_hz)),
        min(count, round((end_s + _AFTER_S) * rate_hz)),
    )
    moving = slice(max(0, round(start_s * rate_hz)), min(count, round(end_s * rate_hz)))
    return Swing(name, joint, turn, wide, moving)
