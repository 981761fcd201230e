"""Exercises of hand and arm, as they are done for a measurement; what moves is labelled work."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handstudio.errors import SetupError
from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.calibration import HEADING, STATIC, seconds_of
from handstudio.simulation.motions.reach import acted, bent, following, raised, share
from handstudio.simulation.motions.swings import instants, through_reversals
from handstudio.simulation.postures import ELBOW, Posture, thumb
from handstudio.simulation.trajectory import Trajectory, held, joined, labelled, through_points

Steps = list[tuple[float, Posture]]

_THESIS_S = 15.0
_WAY_UP_S = 1.0

_ELBOW_TRAVEL_M = (0.08, 0.15)
_ELBOW_PERIOD_S = (1.0, 1.4)  # with the travel 0.1 to 0.3 g
_ELBOW_S = 20.0
_ELBOW_STEP_S = 0.05

_DRIFT_DEG, _DRIFT_M = 0.25, 0.0004  # a hand that lies; what is not held by the table wanders
_DRIFT_EVERY_S = 2.5


def _joint_by_joint(actor: Actor, _: str) -> Trajectory:
    ease = raised(actor.subject)
    steps: Steps = []
    for flexion in (40.0, -35.0):
        steps += [(0.4, ease | {"wrist_flexion": flexion}), (0.4, ease)]
    steps += _to_and_fro(ease, ease | thumb(15.0, 20.0, 8.0, 8.0), 0.35)
    steps += _to_and_fro(ease, ease | thumb(0.0, 12.0, 45.0, 60.0), 0.35)
    for finger in FINGERS[1:]:
        one = [finger]
        steps += _to_and_fro(ease, ease | bent(actor.subject, 70.0, 14.0, fingers=one), 0.38)
        steps += _to_and_fro(ease, ease | bent(actor.subject, 12.0, 85.0, fingers=one), 0.38)
    return labelled(acted(actor, "joint_by_joint", ease, steps, seconds=10.0), "work")


def _open_close(actor: Actor, _: str) -> Trajectory:
    ease = raised(actor.subject)
    wide = ease | bent(actor.subject, -5.0, 2.0) | thumb(-12.0, 15.0, 0.0, -5.0)
    curled = ease | bent(actor.subject, 80.0, 92.0) | thumb(-5.0, 25.0, 5.0, 5.0)
    fist = curled | thumb(1.0, 11.0, 48.0, 58.0)
    steps: Steps = []
    for _repeat in range(6):
        # the thumb comes last and leaves first, or it would be caught inside
        steps += [(0.4, wide), (0.5, curled), (0.25, fist), (0.15, fist), (0.25, curled)]
    return labelled(acted(actor, "open_close", ease, [*steps, (0.6, ease)]), "work")


def _scissors(actor: Actor, _: str) -> Trajectory:
    """The hand works a pair of scissors, thumb up: the thumb against middle and ring finger."""
    ease = raised(actor.subject)
    ready = ease | {"forearm_pronation": -65.0, "wrist_flexion": -12.0, "elbow_flexion": 25.0}
    ready |= bent(actor.subject, 35.0, 55.0, fingers=["little"])
    ready |= bent(actor.subject, 25.0, 30.0, fingers=["index"])
    shut = ready | bent(actor.subject, 40.0, 52.0, fingers=["middle", "ring"])
    shut |= thumb(12.0, 35.0, 18.0, 22.0)
    apart = ready | bent(actor.subject, 20.0, 38.0, fingers=["middle", "ring"])
    apart |= {"index_mcp_flexion": 20.0} | thumb(-12.0, 42.0, 5.0, 6.0)
    cuts: Steps = [step for _ in range(13) for step in ((0.5, apart), (0.42, shut))]
    steps: Steps = [(1.2, ready), (0.4, apart), *cuts, (0.4, ready), (1.2, ease)]
    return labelled(acted(actor, "scissors", ease, steps, seconds=15.0), "work")


def _thesis_index(actor: Actor, argument: str) -> Trajectory:
    """Two seconds still, two of turning the arm, then joint after joint along the index finger."""
    seconds = seconds_of(argument, _THESIS_S, 10.0, 600.0)
    each = (seconds - 4.0 - _WAY_UP_S) / len(_ALONG_THE_INDEX)
    base = raised(actor.subject)
    parts = [STATIC.make(actor, ""), HEADING.make(actor, "")]
    up = through_reversals(
        np.array([0.0, _WAY_UP_S]), np.stack([actor.posture({}), actor.posture(base)])
    )
    swings = [_turned(actor, base, moved, each) for moved in _ALONG_THE_INDEX]
    return joined([*parts, labelled(joined([up, *swings]), "work")])


_ALONG_THE_INDEX = (
    ("elbow_flexion", 0.15, 0.5),
    ("wrist_flexion", -0.6, 0.6),
    ("index_mcp_flexion", -0.3, 0.75),
    ("index_pip_flexion", 0.05, 0.85),
    ("index_dip_flexion", 0.0, 0.55),
)
"""What moves, and between which shares of its range."""


def _turned(
    actor: Actor, base: Posture, moved: tuple[str, float, float], seconds: float
) -> Trajectory:
    """To and fro once a second or so, from the base and back to it."""
    name, *shares = moved
    rng = actor.rng(f"thesis_index {name}")
    count = max(1, round(seconds / 1.1))
    at = instants(rng, seconds / (2 * count + 1), seconds)
    postures = []
    for number in range(len(at)):
        towards = share(actor.subject, name, shares[number % 2]) * rng.uniform(0.88, 1.0)
        posture = {**base, name: float(towards)}
        if name == "index_pip_flexion":
            posture["index_dip_flexion"] = following(actor.subject, "index", float(towards))
        postures.append(posture)
    postures[0] = postures[-1] = dict(base)
    return through_reversals(at, np.stack([actor.posture(posture) for posture in postures]))


def _resting(actor: Actor, argument: str) -> Trajectory:
    """Nobody lies still: joints wander by fractions of a degree."""
    seconds = seconds_of(argument, 120.0, 5.0)
    rng = actor.rng("resting")
    at = instants(rng, _DRIFT_EVERY_S, seconds)
    names = [name for name in raised(actor.subject) if not name.startswith("elbow")]
    walk = np.cumsum(rng.standard_normal((len(at), len(names) + len(ELBOW))), axis=0)
    walk -= np.linspace(walk[0], walk[-1], len(at))  # it ends where it began
    walk /= max(1.0, float(np.abs(walk).max()) / 3.0)
    sizes = [_DRIFT_DEG] * len(names) + [_DRIFT_M * 1e3] * len(ELBOW)
    rows = (walk * sizes).tolist()
    postures = [actor.posture(dict(zip((*names, *ELBOW), row, strict=True))) for row in rows]
    return through_points(at, np.stack(postures))


def _elbow_moving(actor: Actor, argument: str) -> Trajectory:
    """The elbow swings along one axis or all three, smoothly; the rest of the arm is free."""
    axes, seconds, after = _axes_and_times(argument)
    rng = actor.rng(f"elbow_moving {argument}")
    at = np.linspace(0.0, seconds, round(seconds / _ELBOW_STEP_S) + 1).round(6)
    start = actor.posture({})
    postures = np.tile(start, (len(at), 1))
    for axis in axes:
        channel = len(start) - 3 + _AXES.index(axis)
        travel = 1e3 * rng.uniform(*_ELBOW_TRAVEL_M) / len(axes) ** 0.25
        turns = instants(rng, 0.5 * rng.uniform(*_ELBOW_PERIOD_S), seconds)
        ends = np.array([(n % 2) * travel * rng.uniform(0.8, 1.0) for n in range(len(turns))])
        # the table is below, so up is only up; elsewhere it swings about where it was
        ends -= 0.0 if axis == "up" else 0.5 * travel
        ends[[0, -1]] = 0.0
        swing = np.stack([actor.posture({f"elbow_{axis}_mm": float(end)}) for end in ends])
        postures[:, channel] = through_reversals(turns, swing).posture(at)[:, channel]
    moving = labelled(through_points(at, postures), "work")
    return joined([held(start, after), moving]) if after else moving


_AXES = ("north", "west", "up")


def _axes_and_times(argument: str) -> tuple[Sequence[str], float, float]:
    axis, seconds, after = [*argument.split(), "", "", ""][:3]
    if axis not in ("", "all", *_AXES) or len(argument.split()) > 3:
        raise SetupError(
            "The elbow cannot move {argument!r}.",
            "Choose one of {known}, and behind it, if you like, for how many seconds and after how "
            "many: elbow_moving:up 11 4.",
            argument=argument,
            known="all, north, west, up",
        )
    return (
        (axis,) if axis in _AXES else _AXES,
        seconds_of(seconds, _ELBOW_S, 5.0, 600.0),
        seconds_of(after, 0.0, 0.0, 600.0),
    )


def _to_and_fro(ease: Posture, away: Posture, seconds: float) -> Steps:
    return [(seconds, away), (seconds, ease)]


EXERCISES = (
    Motion("joint_by_joint", "One joint after the other, ten seconds", _joint_by_joint),
    Motion("open_close", "Six fists, and wide open between them", _open_close),
    Motion("scissors", "The hand works a pair of scissors, fifteen seconds", _scissors),
    Motion(
        "thesis_index",
        "Still, the arm turned, then elbow, wrist, and the index finger's joints in turn",
        _thesis_index,
        "seconds",
    ),
    Motion("resting", "The hand lies, and drifts a little", _resting, "seconds"),
    Motion(
        "elbow_moving",
        "The elbow swings by ten centimetres, up, north, west or all; a layer to put over others",
        _elbow_moving,
        "axis seconds after",
    ),
)
