"""Sensors on skin: they slide and rock as joints bend, and wobble after impacts.

A sensor's frame moves in its segment's as a frame does, with exact derivatives, so that what is
true of a sensor stays exact. What moves it is a rotation vector about a pivot on the bone beneath
it, and a shift. All sizes but the rocking are ours: that skin over a joint stretches by
centimetres, that the forearm's lags behind the radius, and that loose tissue rings at ten to some
tens of Hz is known, how much a board on a glove makes of it is not.

- *Slide*: skin is drawn towards a bent joint, so a board slides back with the joint before it and
  forth with the one behind. The skin of the forearm stays behind when the radius turns: not at all
  at the wrist, by 60 % at the elbow. (That sensors on forearms miss much of its rotation, and that
  the hand tells it better, is shown in J. Biomech. Eng. 144 (2022) 071007; the shares are ours.)
- *Rock*: tendons and knuckles rise under the board and pitch it. Both boards beside a joint, and
  the joints beyond them, let the angle of a PIP err by 3.6 degrees RMS over half and full
  fists; markers on the skin err by less than 4 against computed tomography (C. D. Metcalf et al.,
  Ann. Biomed. Eng. 2020, doi 10.1007/s10439-020-02476-2).
- *Wobble*: the board is a mass on a spring, driven by the acceleration of the bone beneath it; it
  tilts as it shifts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from handstudio.arrays import Array
from handstudio.hand.angles import FLEXION, ROTATION
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.maths import so3
from handstudio.simulation.imperfections.noise import generator
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.mounting import Mounting
from handstudio.simulation.moving import Moving, along, cross, planes_first, rotate, vectors_last
from handstudio.simulation.trajectory import JointMotion

SLIDE_M_RAD = 0.0015  # with each of the two joints next to the board; sd a third
LAG_AT_ELBOW = 0.6  # of the forearm's rotation; sd a fifth
ROCK_RAD_RAD = np.deg2rad(1.2) / np.deg2rad(45.0)  # sd: 1.2 deg for 45 deg of a joint
WOBBLE_HZ = {"forearm": 12.0}  # softer there than anywhere else
WOBBLE_ELSEWHERE_HZ = 18.0  # sd a tenth
DAMPING = 0.25
ACROSS_SKIN = 0.3  # of the wobble along it
TILT_RAD_M = 1.0 / 0.03  # a board rocks about a point so far beneath it
SLIP_DEG, SLIP_M = 1.5, 0.001  # sd, about and along every axis
SLIP_LASTS_S = 1.0
SLIP_BETWEEN_S = (10.0, 40.0)


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """How the sensors of a glove move on their segments.

    Attributes:
        on: Index of every sensor's segment.
        pivots: Where on the bone a sensor turns [m].
        q: Attitude of every sensor at the flat hand, at rest.
        arms: Its place from the pivot [m].
        turns: Which turn of which joint moves a sensor: three for each.
        shifts: Shift with each of them [m/rad].
        tilts: Rotation with each of them [rad/rad].
        poles: Of every sensor's wobble: ``-damping + i frequency`` [rad/s].
        give: How much of the bone's acceleration drives it along the segment's axes; 0: none.
        slip_shift: Shift of the board once it has slipped [m].
        slip_tilt: And its rotation vector [rad].
        slip_start_s: When it slips.
    """

    on: tuple[int, ...]
    pivots: Float[Array, "s 3"]
    q: Float[Array, "s 4"]
    arms: Float[Array, "s 3"]
    turns: tuple[tuple[tuple[int, int], ...], ...]
    shifts: Float[Array, "3 s 3"]
    tilts: Float[Array, "3 s 3"]
    poles: Complex[Array, " s"]
    give: Float[Array, "s 3"]
    slip_shift: Float[Array, "s 3"]
    slip_tilt: Float[Array, "s 3"]
    slip_start_s: float

    @property
    def is_rigid(self) -> bool:
        """Whether nothing moves."""
        parts = (self.shifts, self.tilts, self.give, self.slip_shift, self.slip_tilt)
        return not any(part.any() for part in parts)


@dataclass(frozen=True, slots=True, eq=False)
class Wobble:
    """Where the boards swing.

    Attributes:
        z: ``d' - conj(pole) d`` of the displacement d [m/s].
        drive: The acceleration that drove them last [m/s²].
        time_s: When; None before the first instant.
    """

    z: Complex[Array, "s 3"]
    drive: Float[Array, "s 3"]
    time_s: float | None


def skin_of(
    what: Imperfections,
    skeleton: Skeleton,
    mounting: Mounting,
    on: tuple[int, ...],
    *,
    seed: int,
    occasion: int = 0,
) -> Skin:
    """How a glove's sensors move on a person; a seed is one glove on one person."""
    rng, slipping = generator(seed, _SKIN), generator(seed, _SLIP, occasion)
    s, place = len(on), mounting.t_segment_sensor
    pivots = place * [0.0, 1.0, 0.0]
    shifts, tilts = np.zeros((3, s, 3)), np.zeros((3, s, 3))
    # flexion is minus the turn: a joint that bends draws the skin behind it back, before it forth
    slide = what.slide * SLIDE_M_RAD * rng.normal(1.0, 1.0 / 3.0, (2, s))
    shifts[0, :, 1], shifts[1, :, 1] = slide[0], -slide[1]
    tilts[:2, :, 0] = what.rock * ROCK_RAD_RAD * rng.standard_normal((2, s))
    lag = what.slide * LAG_AT_ELBOW * rng.normal(1.0, 0.2, s)
    hz = np.array([WOBBLE_HZ.get(SEGMENTS[k], WOBBLE_ELSEWHERE_HZ) for k in on])
    hz = hz * rng.normal(1.0, 0.1, s)
    for sensor, segment in enumerate(on):
        if PARENTS[segment] < 0:  # from so far nothing is drawn to the elbow
            along_bone = np.clip(place[sensor, 1] / skeleton.length_m[segment], 0.0, 1.0)
            shifts[0, sensor], tilts[0, sensor] = 0.0, 0.0
            tilts[2, sensor, 1] = -lag[sensor] * (1.0 - along_bone)
        if _behind(segment) is None:
            shifts[1, sensor], tilts[1, sensor] = 0.0, 0.0
    mirror = np.array([1.0 if skeleton.side == "right" else -1.0, 1.0, 1.0])
    normal = slipping.standard_normal((2, s, 3))
    return Skin(
        on=on,
        pivots=pivots,
        q=mounting.q_segment_sensor,
        arms=place - pivots,
        turns=tuple(_turns_beside(segment) for segment in on),
        shifts=shifts,
        tilts=tilts,
        poles=2.0 * np.pi * hz * complex(-DAMPING, np.sqrt(1.0 - DAMPING**2)),
        give=np.tile(what.wobble * np.array([1.0, 1.0, ACROSS_SKIN]), (s, 1)),
        slip_shift=what.board_slip * SLIP_M * normal[0] * mirror,
        slip_tilt=what.board_slip * np.deg2rad(SLIP_DEG) * normal[1] * mirror * mirror[0],
        slip_start_s=float(slipping.uniform(*SLIP_BETWEEN_S)),
    )


def settled(skin: Skin) -> Wobble:
    """Boards that hang still."""
    s = len(skin.on)
    return Wobble(np.zeros((s, 3), dtype=complex), np.zeros((s, 3)), None)


def on_skin(
    skin: Skin, wobble: Wobble, time_s: Float[Array, " n"], joints: JointMotion, segments: Moving
) -> tuple[Moving, Wobble]:
    """Every sensor in the world, (n, s), at rising instants that follow those of the state.

    The acceleration that drives the wobble runs straight from instant to instant; for such a drive
    the wobble is exact.
    """
    shift, tilt = _bent(skin.turns, skin.shifts, joints), _bent(skin.turns, skin.tilts, joints)
    if skin.slip_shift.any() or skin.slip_tilt.any():
        for order, slipped in enumerate(_slip(time_s - skin.slip_start_s)):
            share = np.repeat(slipped[:, None], len(skin.on), axis=1)
            shift[order] += along(skin.slip_shift, share)
            tilt[order] += along(skin.slip_tilt, share)
    if skin.give.any():
        swung, wobble = _swung(skin.poles, wobble, time_s, _drive(skin, segments))
        for order, d in enumerate(swung):
            shift[order] += d
            tilt[order][..., 0] -= TILT_RAD_M * d[..., 1]
            tilt[order][..., 1] += TILT_RAD_M * d[..., 0]
    moving = turned_by(*tilt).slid(skin.pivots + shift[0], shift[1], shift[2])
    return segments.then(moving.carrying(skin.q, skin.arms)), wobble


def turned_by(
    r: Float[Array, "*n 3"], dr: Float[Array, "*n 3"], ddr: Float[Array, "*n 3"]
) -> Moving:
    """A frame at the origin turned by a rotation vector [rad], given with two derivatives.

    ``omega = dr + A r x dr + B r x (r x dr)`` with ``A = (1 - cos u)/u²`` and
    ``B = (u - sin u)/u³`` of ``u = |r|``: the left Jacobian of rotations (T. D. Barfoot, State
    Estimation for Robotics, 2017, section 7.1.5). Their series are taken as far as 3 rad needs.
    """
    t = r[..., 0] ** 2 + r[..., 1] ** 2 + r[..., 2] ** 2
    dt = 2.0 * (r[..., 0] * dr[..., 0] + r[..., 1] * dr[..., 1] + r[..., 2] * dr[..., 2])
    (a, da), (b, db) = _series(_A, t), _series(_B, t)
    once = cross(r, dr)
    twice, again = cross(r, once), cross(r, ddr)
    omega = dr + along(once, a) + along(twice, b)
    alpha = ddr + along(again, a) + along(cross(dr, once) + cross(r, again), b)
    alpha = alpha + along(once, da * dt) + along(twice, db * dt)
    half = 0.5 * np.sqrt(t)
    # sinc keeps the limit of no angle exact
    q = np.concatenate([np.cos(half)[None], planes_first(along(r, 0.5 * np.sinc(half / np.pi)))])
    zero = np.zeros_like(omega)
    return Moving(vectors_last(q), zero, omega, zero, alpha, zero)


_SKIN, _SLIP = 40, 41  # which of a seed's streams

# (-1)^k / (2k + 2)! and (-1)^k / (2k + 3)!: eleven terms leave 1e-13 at 3 rad
_TERMS = 11
_FACTORIALS = np.cumprod([1.0, *range(1, 2 * _TERMS + 2)])
_SIGNS = (-1.0) ** np.arange(_TERMS)
_A, _B = _SIGNS / _FACTORIALS[2::2], _SIGNS / _FACTORIALS[3::2]


def _series(coefficients: Array, t: Array) -> tuple[Array, Array]:
    """A power series of t, and its derivative."""
    value, slope = np.full_like(t, coefficients[-1]), np.zeros_like(t)
    for c in coefficients[-2::-1]:
        slope = slope * t + value
        value = value * t + c
    return value, slope


def _turns_beside(segment: int) -> tuple[tuple[int, int], ...]:
    """Flexion of the joint before a segment, of the one behind it, and its own rotation."""
    behind = _behind(segment)
    return (segment, FLEXION), (segment if behind is None else behind, FLEXION), (segment, ROTATION)


def _behind(segment: int) -> int | None:
    """The joint whose bending draws on a segment's skin from its far end."""
    children = [child for child, parent in enumerate(PARENTS) if parent == segment]
    # the palm has several: the skin on its back follows the knuckles
    knuckles = [child for child in children if SEGMENTS[child].endswith("proximal")]
    return (knuckles or children)[-1] if children else None


def _bent(
    turns: tuple[tuple[tuple[int, int], ...], ...], gains: Array, joints: JointMotion
) -> list[Array]:
    """What the joints beside it make of a sensor, linear in their turns, with two derivatives."""
    which = np.array(turns)  # sensor, which of three, (joint, turn)
    out = []
    for motion in (joints.turns, joints.rates, joints.accelerations):
        parts = [along(gains[i], motion[:, which[:, i, 0], which[:, i, 1]]) for i in range(3)]
        out.append(parts[0] + parts[1] + parts[2])
    return out


def _slip(after_s: Array) -> tuple[Array, Array, Array]:
    """How much of a slip is done, with two derivatives: as smooth as a movement."""
    u = np.clip(after_s / SLIP_LASTS_S, 0.0, 1.0)
    done = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    rate = 30.0 * u * u * (1.0 + u * (u - 2.0)) / SLIP_LASTS_S
    acceleration = 60.0 * u * (1.0 + u * (2.0 * u - 3.0)) / SLIP_LASTS_S**2
    return done, rate, acceleration


def _drive(skin: Skin, segments: Moving) -> Array:
    """What pushes the boards [m/s²], in their segments' axes: the bone runs away beneath them."""
    arm = rotate(segments.q, skin.pivots + skin.arms)
    around = cross(segments.omega, cross(segments.omega, arm))
    a = segments.a + cross(segments.alpha, arm) + around
    return -skin.give * rotate(so3.conjugate(segments.q), a)


def _swung(
    poles: Array, wobble: Wobble, time_s: Array, drive: Array
) -> tuple[tuple[Array, Array, Array], Wobble]:
    """Displacement of damped oscillators, with two derivatives, exact for a straight drive.

    ``d'' = u - 2 D w d' - w² d`` is ``z' = pole z + u`` with ``z = d' - conj(pole) d``.
    """
    dt = np.diff(time_s, prepend=time_s[0] if wobble.time_s is None else wobble.time_s)
    x = poles * dt[:, None]
    decay, still = np.exp(x), dt[:, None] == 0.0
    divisor = np.where(still, 1.0, x)
    mean = np.where(still, 1.0, (decay - 1.0) / divisor)
    slope = np.where(still, 0.5, (decay - 1.0 - x) / divisor**2)
    before = np.concatenate([wobble.drive[None], drive[:-1]])
    push = (dt[:, None] * mean)[..., None] * before
    push += (dt[:, None] * slope)[..., None] * (drive - before)
    z, swings = wobble.z.copy(), np.empty(push.shape, dtype=complex)
    for swing, factor, pushed in zip(swings, decay[..., None], push, strict=True):
        np.multiply(z, factor, out=z)
        z += pushed
        swing[:] = z
    pole = poles[:, None]
    d = swings.imag / pole.imag
    v = swings.real + pole.real * d
    a = drive + 2.0 * pole.real * v - (pole.real**2 + pole.imag**2) * d
    return (d, v, a), Wobble(z, drive[-1], float(time_s[-1]))
