"""Joint turns and the elbow's place over time: piecewise polynomials, smooth to the acceleration.

A trajectory begins and ends at rest, so that any two can follow one another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import factorial

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import JOINTS
from handstudio.simulation.holding import Held

CHANNELS = 3 * len(JOINTS) + 3
"""Of a posture: turns about x, z and y of every joint [rad], then the elbow's place [m]."""

DEGREE = 5
_EASY_RAD_S = np.deg2rad(160.0)  # fastest joint on the way from one motion to the next
_EASY_M_S = 0.4  # and the elbow
_SHORTEST_WAY_S = 0.4
_PEAK = 1.875  # fastest over mean speed of a minimum-jerk movement


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Turns of every joint about x, z and y (intrinsic, as `hand.angles.compose` takes them).

    Attributes:
        turns: [rad]; the root's are the forearm's, relative to its attitude at the start.
        rates: Their first derivatives [rad/s].
        accelerations: Their second derivatives [rad/s²].
        elbow: Place of the elbow against the start, in the world [m], its velocity [m/s] and
            acceleration [m/s²].
    """

    turns: Float[Array, "n k 3"]
    rates: Float[Array, "n k 3"]
    accelerations: Float[Array, "n k 3"]
    elbow: tuple[Float[Array, "n 3"], Float[Array, "n 3"], Float[Array, "n 3"]]


@dataclass(frozen=True, slots=True)
class Span:
    """A named stretch of a trajectory [s]: what a label of a take will say.

    Attributes:
        held: What the hand holds meanwhile, if anything.
    """

    start_s: float
    end_s: float
    name: str
    held: Held | None = None

    def later(self, seconds: float) -> Span:
        """The same, later."""
        return replace(self, start_s=self.start_s + seconds, end_s=self.end_s + seconds)

    def stretched(self, factor: float) -> Span:
        """The same in ``factor`` times as long."""
        return replace(self, start_s=factor * self.start_s, end_s=factor * self.end_s)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Polynomials of time between breaks; before the first and after the last it stays.

    Attributes:
        breaks_s: Rising from 0 [s].
        coefficients: Of powers of the time since the break before, highest first.
        spans: What is done when.
        periodic: It repeats after the last break, where it is as at the first.
        begins_s: When the first break is, on the time axis that it is asked on [s].

    Raises:
        ValueError: breaks do not rise from 0, or a periodic motion does not close.
    """

    breaks_s: Float[Array, " b"]
    coefficients: Float[Array, "6 m c"]
    spans: tuple[Span, ...] = ()
    periodic: bool = False
    begins_s: float = 0.0

    def __post_init__(self) -> None:
        if self.breaks_s[0] != 0.0 or np.any(np.diff(self.breaks_s) <= 0.0):
            raise ValueError("Breaks must start at 0 s and each be later than the one before.")
        if self.periodic and not np.allclose(self.start, self.end, rtol=0.0, atol=1e-9):
            raise ValueError("A periodic motion must end in the pose it began with.")

    @property
    def duration_s(self) -> float:
        """Instant of the last break [s]: the period, where it repeats."""
        return float(self.breaks_s[-1])

    @property
    def start(self) -> Float[Array, " c"]:
        """Posture it begins in."""
        return np.array(self.coefficients[-1, 0])

    @property
    def end(self) -> Float[Array, " c"]:
        """Posture it ends in."""
        last = self.breaks_s[-1] - self.breaks_s[-2]
        end: Array = last ** np.arange(DEGREE, -1.0, -1.0) @ self.coefficients[:, -1]
        return end

    def posture(self, time_s: Float[Array, " n"]) -> Float[Array, "n c"]:
        """All channels at any instants [s]."""
        return self.derivatives(time_s)[0]

    def derivatives(
        self, time_s: Float[Array, " n"]
    ) -> tuple[Float[Array, "n c"], Float[Array, "n c"], Float[Array, "n c"]]:
        """All channels and their first two derivatives at any instants [s]."""
        at, u = self._piece(time_s)
        c = self.coefficients[:, at]
        value, rate, half = c[0], np.zeros_like(c[0]), np.zeros_like(c[0])
        for power in range(1, DEGREE + 1):  # Horner's rule, carrying the derivatives along
            half = half * u + rate
            rate = rate * u + value
            value = value * u + c[power]
        return value, rate, 2.0 * half

    def at(self, time_s: Float[Array, " n"]) -> JointMotion:
        """Turns, the elbow's place and their derivatives at any instants [s]."""
        value, rate, acceleration = self.derivatives(time_s)
        shape = (len(value), len(JOINTS), 3)
        return JointMotion(
            turns=value[:, :-3].reshape(shape),
            rates=rate[:, :-3].reshape(shape),
            accelerations=acceleration[:, :-3].reshape(shape),
            elbow=(value[:, -3:], rate[:, -3:], acceleration[:, -3:]),
        )

    def _piece(self, time_s: Array) -> tuple[Array, Array]:
        time_s = time_s - self.begins_s
        time_s = np.mod(time_s, self.duration_s) if self.periodic else time_s
        time_s = np.clip(time_s, 0.0, self.duration_s)
        last = len(self.breaks_s) - 2
        at = np.clip(np.searchsorted(self.breaks_s, time_s, side="right") - 1, 0, last)
        return at, (time_s - self.breaks_s[at])[:, None]


def through_stops(
    time_s: Float[Array, " m"], postures: Float[Array, "m c"], periodic: bool = False
) -> Trajectory:
    """Reach every posture and leave it at rest, at the given instants [s], the first 0.

    Between two of them every channel follows the minimum-jerk curve of Flash and Hogan (J.
    Neurosci. 5, 1985, 1688, eq. 3), ``s(u) = 10 u³ - 15 u⁴ + 6 u⁵``: velocity and acceleration
    are zero at both.
    """
    span, way = np.diff(time_s)[:, None], np.diff(postures, axis=0)
    zero = np.zeros_like(way)
    coefficients = np.stack(
        [
            6.0 * way / span**5,
            -15.0 * way / span**4,
            10.0 * way / span**3,
            zero,
            zero,
            postures[:-1],
        ]
    )
    return Trajectory(time_s, coefficients, periodic=periodic)


def through_points(time_s: Float[Array, " m"], postures: Float[Array, "m c"]) -> Trajectory:
    """Pass through every posture without stopping; only the first and the last are at rest.

    An interpolating quintic spline, continuous to its fourth derivative; 2 postures or more.
    """
    if len(time_s) == 2:
        return through_stops(time_s, postures)
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - takes a second to load

    rest = [(1, np.zeros(postures.shape[1])), (2, np.zeros(postures.shape[1]))]
    spline = make_interp_spline(time_s, postures, k=DEGREE, bc_type=(rest, rest))  # type: ignore[arg-type] # its hints know scalars only
    breaks = np.unique(spline.t)
    powers = [spline(breaks[:-1], nu) / factorial(nu) for nu in range(DEGREE, -1, -1)]
    return Trajectory(breaks, np.stack(powers))


def held(posture: Float[Array, " c"], seconds: float) -> Trajectory:
    """Stay."""
    coefficients = np.zeros((DEGREE + 1, 1, len(posture)))
    coefficients[-1, 0] = posture
    return Trajectory(np.array([0.0, seconds]), coefficients)


def way(
    begin: tuple[Float[Array, " c"], Float[Array, " c"], Float[Array, " c"]],
    end: Float[Array, " c"],
    seconds: float | None = None,
) -> Trajectory:
    """Go, from posture, rates and accelerations, to a posture and rest there.

    Takes as long as a person in no hurry would, unless told.
    """
    if seconds is None:
        change = np.abs(end - begin[0])
        slowest = max(change[:-3].max() / _EASY_RAD_S, change[-3:].max() / _EASY_M_S)
        seconds = max(_SHORTEST_WAY_S, _PEAK * float(slowest))
    seconds = round(seconds, 6)
    place, rate, acceleration = begin
    # what is left to do of place, rate and acceleration where these would go on as they are
    p = end - place - rate * seconds - 0.5 * acceleration * seconds**2
    v = -(rate + acceleration * seconds) * seconds
    a = -acceleration * seconds**2
    coefficients = np.stack(
        [
            (6.0 * p - 3.0 * v + 0.5 * a) / seconds**5,
            (-15.0 * p + 7.0 * v - a) / seconds**4,
            (10.0 * p - 4.0 * v + 0.5 * a) / seconds**3,
            0.5 * acceleration,
            rate,
            place,
        ]
    )
    return Trajectory(np.array([0.0, seconds]), coefficients[:, None])


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """One after the other, with a way between where one does not begin as the last ended."""
    breaks, coefficients, spans = [np.zeros(1)], [], list[Span]()
    end: Array | None = None
    for part in parts:
        pieces = [part]
        if end is not None and not np.allclose(part.start, end, rtol=0.0, atol=1e-9):
            rest = np.zeros_like(end)
            pieces.insert(0, way((end, rest, rest), part.start))
        for piece in pieces:
            began = float(breaks[-1][-1])
            breaks.append(began + piece.breaks_s[1:])
            coefficients.append(piece.coefficients)
            spans += [span.later(began) for span in piece.spans]
        end = part.end
    return Trajectory(np.concatenate(breaks), np.concatenate(coefficients, axis=1), tuple(spans))


def turned_to(before: Trajectory, at_s: float, then: Trajectory) -> Trajectory:
    """Leave off at an instant [s], without a jump, and go on to another motion.

    On the same time axis, to be used from ``at_s`` on.
    """
    place, rate, acceleration = (x[0] for x in before.derivatives(np.array([at_s])))
    going = way((place, rate, acceleration), then.start)
    return replace(joined([going, then]), begins_s=at_s)


def labelled(part: Trajectory, name: str) -> Trajectory:
    """The same, named as a whole."""
    return replace(part, spans=(*part.spans, Span(0.0, part.duration_s, name)))


def stretched(part: Trajectory, factor: float) -> Trajectory:
    """The same in ``factor`` times as long."""
    powers = factor ** -np.arange(DEGREE, -1.0, -1.0)
    spans = tuple(span.stretched(factor) for span in part.spans)
    return replace(
        part,
        breaks_s=part.breaks_s * factor,
        coefficients=part.coefficients * powers[:, None, None],
        spans=spans,
    )


def scaled(part: Trajectory, factor: float) -> Trajectory:
    """The same with everything done ``factor`` times as far from the posture it begins in."""
    coefficients = part.coefficients * factor
    coefficients[-1] += (1.0 - factor) * part.start
    return replace(part, coefficients=coefficients)


def layered(part: Trajectory, over: Trajectory) -> Trajectory:
    """Both at once: what ``over`` does from its first posture is added; the longer one lasts."""
    ends = (part.duration_s, over.duration_s)
    breaks = np.unique(np.concatenate([part.breaks_s, over.breaks_s]))
    # breaks that only rounding keeps apart would leave a piece of no length
    breaks = breaks[np.concatenate([[True], np.diff(breaks) > 1e-9])]
    breaks[-1] = max(ends)
    total = _shifted(part, breaks[:-1]) + _shifted(over, breaks[:-1])
    total[-1] -= over.start
    return Trajectory(breaks, total, part.spans + over.spans)


def _shifted(part: Trajectory, breaks_s: Array) -> Array:
    """Coefficients of the same polynomials about other breaks, among which are its own."""
    # the middle of nowhere: a break that is rounded down must not fall into the piece before
    at, _ = part._piece(breaks_s + 1e-10)
    u = (breaks_s - part.breaks_s[at])[:, None]
    after = breaks_s >= part.duration_s - 1e-9
    out = part.coefficients[:, at].copy()
    for lowest in range(DEGREE):  # Taylor shift: repeated synthetic division
        for power in range(1, DEGREE + 1 - lowest):
            out[power] += out[power - 1] * u
    out[:, after] = 0.0
    out[-1, after] = part.end
    return out
