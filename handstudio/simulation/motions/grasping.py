"""Grasps on things of given sizes: reach, close, lift, put back, open."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.hand.angles import joint_index
from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.grasp_classes import GRASPS as CLASSES
from handstudio.simulation.motions.grasp_classes import GraspClass
from handstudio.simulation.motions.grasp_search import Grasp, grasped
from handstudio.simulation.postures import channels
from handstudio.simulation.trajectory import Span, Trajectory, joined, through_stops

_REACH = {"elbow_flexion": 20.0, "forearm_pronation": -40.0, "wrist_flexion": -10.0}
_LIFT = {"elbow_flexion": 32.0, "forearm_pronation": -60.0, "wrist_flexion": -5.0}
_OPEN = 0.35  # of a finger's flexion, on the way to a thing and away
_BY_NAME = {kind.name: kind for kind in CLASSES}

# Seconds to reach with the hand open, to close, hold, lift, hold, put back and hold, to open, and
# to come back. What is held is held from closed to open: 2.8 s.
_SECONDS = (1.0, 0.6, 0.6, 0.7, 0.4, 0.7, 0.4, 0.5, 1.0)
_CLOSED, _OPENED = sum(_SECONDS[:2]), sum(_SECONDS[:7])


def grasp(actor: Actor, argument: str) -> Trajectory:
    """One grasp; a span has its name, and what is held.

    Args:
        actor: Who grasps.
        argument: A class, or ``class/size`` [mm]. Without a size it is the usual one, or a little
            less or more where that does not fit the hand.

    Raises:
        SetupError: there is no such class, or not for this size or hand.
    """
    return held_in_hand(grasp_of(actor, argument), actor)


def grasps(actor: Actor, _: str) -> Trajectory:
    """All classes on things of their usual sizes, one after the other; none that does not fit.

    Raises:
        SetupError: nothing fits this hand.
    """
    done: list[Trajectory] = []
    misfit: SetupError | None = None
    for kind in CLASSES:
        try:
            done.append(grasp(actor, kind.name))
        except SetupError as error:
            misfit = error
    if misfit is not None and not done:
        raise misfit
    return joined(done)


GRASPS = (
    Motion(
        "grasp",
        "Grasp a thing, lift it and put it back",
        grasp,
        f"a class, or class/size in mm; classes: {', '.join(_BY_NAME)}",
        "power_sphere",
    ),
    Motion(
        "grasps",
        "All sixteen grasps in a row, but those that do not fit this hand",
        grasps,
    ),
)


def grasp_of(actor: Actor, argument: str) -> Grasp:
    """What `grasp` will hold, and how.

    Raises:
        SetupError: there is no such class, or not for this size or hand.
    """
    name, _, size = (part.strip() for part in argument.partition("/"))
    if name not in _BY_NAME:
        raise SetupError(
            "There is no grasp {name!r}.",
            "Choose one of: {known}.",
            name=name,
            known=", ".join(_BY_NAME),
        )
    kind, rng = _BY_NAME[name], actor.rng(f"grasp {name}")
    sizes = [_size_mm(kind, size)] if size else _sizes_mm(kind)
    for size_mm in sizes[:-1]:
        with suppress(SetupError):
            return grasped(actor.subject, kind, 1e-3 * size_mm, rng)
    return grasped(actor.subject, kind, 1e-3 * sizes[-1], rng)


def _sizes_mm(kind: GraspClass) -> list[float]:
    """The usual one, and what somebody takes whom it does not fit."""
    usual, least, most = kind.size_mm
    return [usual, *np.clip([0.92 * usual, 1.08 * usual, 0.85 * usual], least, most).tolist()]


def _size_mm(kind: GraspClass, text: str) -> float:
    usual, least, most = kind.size_mm
    try:
        size = float(text)
    except ValueError:
        size = float("nan")
    if not least <= size <= most:
        raise SetupError(
            "{name} holds {least:g} to {most:g} mm, not {size!r}.",
            "Choose a size between them, such as grasp:{name}/{usual:g}.",
            name=kind.name,
            least=least,
            most=most,
            size=text,
            usual=usual,
        )
    return size


def held_in_hand(grasp: Grasp, actor: Actor) -> Trajectory:
    """From the flat hand to a grasp and back."""
    side, flat = actor.subject.side, np.zeros_like(grasp.posture)
    reach, lift = (channels(posture, side) for posture in (_REACH, _LIFT))
    opened, closed, lifted = (
        reach + _opened(grasp.posture),
        reach + grasp.posture,
        lift + grasp.posture,
    )
    stops = [flat, opened, closed, closed, lifted, lifted, closed, closed, opened, flat]
    time_s = np.round(np.cumsum([0.0, *_SECONDS]), 6)
    span = Span(_CLOSED, _OPENED, f"grasp:{grasp.kind.name}", grasp.held)
    return replace(through_stops(time_s, np.stack(stops)), spans=(span,))


def _opened(posture: Array) -> Array:
    """The same hand about to close: fingers straighter, the thumb away from them."""
    out = posture.copy()
    for finger in FINGERS[1:]:
        for joint in ("mcp", "pip", "dip"):
            out[3 * joint_index(f"{finger}_{joint}")] *= _OPEN
    for joint in ("thumb_cmc", "thumb_mcp", "thumb_ip"):
        out[3 * joint_index(joint)] *= _OPEN
    return out
