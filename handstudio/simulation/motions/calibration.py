"""What a subject is asked to do before a measurement, named as the labels of a take."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.hand.angles import compose, joint_index
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor, Motion, in_a_row
from handstudio.simulation.motions.reach import acted, bent, kept, raised
from handstudio.simulation.motions.trials import TRIALS
from handstudio.simulation.postures import FLAT, Posture, channels, thumb
from handstudio.simulation.trajectory import Trajectory, held, labelled, through_stops

LONGEST_S = 6.0 * 3600.0

_TUMBLE_POSES = 20
_TUMBLE_TURN_S, _TUMBLE_REST_S = 2.5, 2.0
_TUMBLE_CENTRE_M = np.array([0.0, 0.30, 0.45])  # where the hand stays, from the table's edge
_TO_THE_HAND_M = 0.33

_TIPS: dict[str, tuple[Posture, float, float, float]] = {
    # thumb, and the finger's MCP, PIP and abduction; pads 10 mm apart on the nominal hand (search)
    "index": (thumb(18.0, 14.5, 21.5, 6.0, 25.0), 52.0, 31.0, 5.5),
    "middle": (thumb(21.0, 21.0, 23.0, 7.0, 27.0), 59.0, 28.0, 15.0),
    "ring": (thumb(30.0, 24.5, 19.5, 7.0, 30.0), 47.0, 23.0, -19.0),
    "little": (thumb(30.0, 22.0, 38.5, 14.0, 28.5), 48.0, 13.0, -19.0),
}
_FOLDED_PALM = {"ring": 12.0, "little": 8.5}  # ulnar CMC, which brings them nearer


def seconds_of(argument: str, default: float, least: float, most: float = LONGEST_S) -> float:
    """How long, from what stands behind a colon; nothing is the default.

    Raises:
        SetupError: it is no number of seconds, or not one from least to most.
    """
    try:
        seconds = float(argument or default)
    except ValueError:
        seconds = float("nan")
    if not least <= seconds <= most:
        raise SetupError(
            "{argument!r} is no time that this motion can take.",
            "Give seconds from {least:g} to {most:g}, such as {default:g}.",
            argument=argument,
            least=least,
            most=most,
            default=default,
        )
    return seconds


def _static(actor: Actor, _: str) -> Trajectory:
    return labelled(held(actor.posture(FLAT), 2.0), "static")


def _flat_hand(actor: Actor, _: str) -> Trajectory:
    return labelled(held(actor.posture(FLAT), 3.0), "flat_hand")


def _rest(actor: Actor, argument: str) -> Trajectory:
    return labelled(held(actor.posture(FLAT), seconds_of(argument, 60.0, 1.0)), "rest")


def _heading_rotation(actor: Actor, _: str) -> Trajectory:
    """Lift the arm about the elbow and lay it back; the hand is as stiff as a board."""
    rng = actor.rng("heading_rotation")
    up = {
        "elbow_flexion": float(rng.uniform(45.0, 65.0)),
        # nobody lifts an arm about exactly one axis
        "elbow_rotation": float(rng.uniform(-6.0, 6.0)),
        "forearm_pronation": float(rng.uniform(-6.0, 6.0)),
    }
    half = round(float(rng.uniform(0.95, 1.05)), 6)
    postures = np.stack([actor.posture(p) for p in (FLAT, kept(actor.subject, up), FLAT)])
    return labelled(through_stops(np.array([0.0, half, 2.0]), postures), "heading_rotation")


def _tumble(actor: Actor, _: str) -> Trajectory:
    """The stiff hand, or a board in two hands, laid down in every direction in turn.

    The body helps, so the elbow's range is no limit here. The hand stays about where it is.
    """
    rng = actor.rng("tumble")
    turns = _directions(rng)
    postures = [actor.posture(FLAT), *(_lying(actor, each) for each in turns)]
    postures += [actor.posture(FLAT)]
    times, stops = [0.0], [postures[0]]
    for one, other in pairwise(postures):
        for seconds, posture in ((_TUMBLE_REST_S, one), (_TUMBLE_TURN_S, other)):
            times.append(times[-1] + seconds * float(rng.uniform(0.9, 1.15)))
            stops.append(posture)
    times.append(times[-1] + _TUMBLE_REST_S)
    stops.append(stops[-1])
    return labelled(through_stops(np.round(times, 6), np.stack(stops)), "tumble")


def _directions(rng: np.random.Generator) -> Array:
    """Turns of the forearm [rad] that have gravity come from all around, near ones in a row.

    What points up is spread over the sphere on Fibonacci's spiral. About the axis up everything
    may be turned, which spreads the field's direction: the turn about z is free where it can be,
    and each direction is reached from the front or, now and then, over the back.
    """
    k = np.arange(_TUMBLE_POSES) + 0.5
    along = 1.0 - 2.0 * k / _TUMBLE_POSES  # of the bones' direction in what points up
    around = k * np.pi * (3.0 - np.sqrt(5.0)) + rng.uniform(0.0, 2.0 * np.pi)
    # up in the hand is Ry(-c) (sin b sin a, cos b sin a, cos a)
    free = np.minimum(np.deg2rad(50.0), 0.9 * np.arccos(np.abs(along)))
    b = free * rng.uniform(-1.0, 1.0, _TUMBLE_POSES)
    a = np.arcsin(along / np.cos(b))
    a = np.where(rng.random(_TUMBLE_POSES) < 0.35, np.pi - a, a)
    c = np.arctan2(np.sin(b) * np.sin(a), np.cos(a)) - around
    turns = np.stack([_least(a), b, _least(c)], axis=-1)
    return turns[_in_a_chain(turns)]


def _least(angle: Array) -> Array:
    """The same angle, from -pi to pi."""
    least: Array = np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
    return least


def _in_a_chain(turns: Array) -> list[int]:
    """From the one nearest to lying flat, always on to the nearest that is left."""
    order, here = list[int](), np.zeros(3)
    while len(order) < len(turns):
        left = [i for i in range(len(turns)) if i not in order]
        order.append(min(left, key=lambda i: float(np.abs(turns[i] - here).max())))
        here = turns[order[-1]]
    return order


def _lying(actor: Actor, turns: Array) -> Array:
    """The stiff hand at these turns of the forearm, the hand's middle where it was."""
    side = 1.0 if actor.subject.side == "right" else -1.0
    posture = channels(FLAT, actor.subject.side)
    root = 3 * joint_index("elbow")
    posture[root : root + 3] = turns * [1.0, side, side]
    arm = so3.rotate(compose(turns), np.array([0.0, _TO_THE_HAND_M, 0.0]))
    posture[-3:] = (_TUMBLE_CENTRE_M - arm) * [side, 1.0, 1.0]
    return posture


def _tryout(actor: Actor, _: str) -> Trajectory:
    """The thumb to every fingertip, and a fist: what shows at a glance whether it worked."""
    ease = raised(actor.subject)
    steps: list[tuple[float, Posture]] = [(0.4, ease)]
    for finger in _TIPS:
        touching = _touching(actor, finger)
        steps += [(0.7, touching), (0.4, touching), (0.6, ease)]
    # the thumb comes last and leaves first, or it would be caught inside
    curled = ease | bent(actor.subject, 80.0, 95.0)
    fist = curled | thumb(1.0, 11.0, 50.0, 61.0)
    steps += [(0.9, curled), (0.6, fist), (0.7, fist), (0.5, curled), (0.9, ease)]
    return labelled(acted(actor, "tryout", ease, steps), "work")


def _touching(actor: Actor, finger: str) -> dict[str, float]:
    opposed, mcp, pip, abduction = _TIPS[finger]
    ease = raised(actor.subject) | bent(actor.subject, 25.0, 30.0)
    touching = bent(actor.subject, mcp, pip, abduction, [finger])
    palm = {"ulnar_cmc_flexion": _FOLDED_PALM.get(finger, 0.0)}
    return {**ease, **touching, **opposed, **palm}


STATIC = Motion("static", "The hand lies still on the table for two seconds", _static)
HEADING = Motion(
    "heading_rotation", "The whole arm, the hand stiff, is lifted and laid back", _heading_rotation
)
FLAT_HAND = Motion("flat_hand", "The hand lies flat on the table", _flat_hand)
TRYOUT = Motion("tryout", "The thumb touches every fingertip, then a fist", _tryout)

QUICK_START = in_a_row("quick_start", "What every measurement begins with", STATIC, HEADING, STATIC)
JOINT_CENTRES = in_a_row("joint_centres", "Every joint in turn, some five minutes", *TRIALS)

CALIBRATION = (
    STATIC,
    HEADING,
    FLAT_HAND,
    *TRIALS,
    Motion("tumble", "The stiff hand lies still in twenty directions", _tumble),
    Motion("rest", "Nothing moves", _rest, "seconds"),
    TRYOUT,
    QUICK_START,
    JOINT_CENTRES,
    in_a_row(
        "calibration",
        "A whole calibration",
        QUICK_START,
        JOINT_CENTRES,
        FLAT_HAND,
        TRYOUT,
    ),
)
