"""Writing by hand, the pen's tip where it should be: postures are solved for, not scripted.

A person sits at a desk whose top is where the elbow rests, the paper turned so that lines run
across the forearm. The forearm swings about the resting elbow from character to character, fingers
and wrist draw within one, and the hand's outer side glides on the desk. As many characters as the
arm reaches (four of 30 mm) are written so. Then the elbow moves on along the line, once; after that
it goes back and towards the body, to the next line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.following import following
from handstudio.simulation.motions.pen import HeldPen, held_pen
from handstudio.simulation.motions.strokes import (
    Character,
    Run,
    drawn,
    laid_out,
    minimum_jerk,
    over,
)
from handstudio.simulation.placing import TURNS
from handstudio.simulation.trajectory import (
    Span,
    Trajectory,
    held,
    joined,
    through_points,
    through_stops,
)

HEIGHT_M = 0.030
"""Of a character."""

_REACH_M = 0.135  # of a swing about the elbow, along the line: four characters and their gaps
_SWINGS = 2  # in a line, the elbow moved on between
_LINE_M = 1.35 * HEIGHT_M
_LIFT_M, _LIFT_SD_M = 0.0055, 0.0005
_DOWN_S = 0.3  # from above the paper onto it, and back
_ELBOW_MOVES_S = 0.7
_KNOT_S = 0.010
_RAISED_RAD = np.deg2rad(12.0)  # the forearm before and after, so that nothing brushes the desk

# How a performance differs from the copybook; ours.
_SIZE_SD, _PLACE_SD_M, _HURRY_SD = 0.01, 0.0002, 0.10


def writing(actor: Actor, text: str) -> Trajectory:
    """Take a pen in the air, write, and lay the hand flat again.

    Spans: every character, and the whole, with the pen that is held.

    Raises:
        SetupError: there is nothing to write, or nobody knows how.
    """
    characters = laid_out(text.strip(), actor.material.strokes)
    pen = held_pen(actor.subject)
    way = _planned(actor, pen, characters)
    postures = following(actor.subject, pen, way.tip, way.swing)
    postures[:, TURNS:] = so3.rotate(actor.world.q_world_start, way.elbow)
    write = through_points(way.time_s, postures)
    whole = Span(0.0, write.duration_s, f"writing:{text.strip()}", pen)
    write = replace(write, spans=(*way.spans, whole))
    return joined([_taken_up(pen, write.start), write, _laid_down(pen, write.end)])


WRITING = (Motion("writing", "Write with a pen on a desk", writing, "what to write", "同志社大"),)


@dataclass(frozen=True, slots=True, eq=False)
class PenWay:
    """Where a pen's tip should be, in the frame that the forearm has at the start.

    Attributes:
        time_s: Rising from 0.
        tip: As the elbow were where it was at the start [m].
        swing: Where the forearm would like to be: about the vertical, from the habit [rad].
        elbow: Against its place at the start [m].
        down: Whether a stroke is drawn.
        spans: Every character.
    """

    time_s: Float[Array, " n"]
    tip: Float[Array, "n 3"]
    swing: Float[Array, " n"]
    elbow: Float[Array, "n 3"]
    down: Array
    spans: tuple[Span, ...]


@dataclass(frozen=True, slots=True)
class _Leg:
    """A stretch of the way: a run over the paper [m], from the middle of a line, at a height."""

    run: Run
    height: tuple[float, float, float]  # at its start, added in its middle, at its end [m]
    swing: tuple[float, float]
    elbow: tuple[Array, Array]
    character: int
    stroke: int


def _planned(actor: Actor, pen: HeldPen, characters: list[Character]) -> PenWay:
    rng = actor.rng("writing")
    legs = [leg for text in _reached(characters) for leg in _written(text, pen, rng)]
    legs = list(_connected(legs, rng))
    parts, began = [], 0.0
    spans = dict[int, tuple[float, float]]()
    for leg in legs:
        count = max(4, round(leg.run.seconds / _KNOT_S))
        last = leg is legs[-1]
        u = np.arange(count + last) / count
        parts.append((began + leg.run.seconds * u, *_at(leg, pen, u)))
        if leg.height == _ON_PAPER:
            first = spans.get(leg.character, (began, began))[0]
            spans[leg.character] = (first, began + leg.run.seconds)
        began += leg.run.seconds
    named = (Span(*ends, characters[i].name) for i, ends in spans.items())
    time_s, tip, swing, elbow, down = (np.concatenate(part) for part in zip(*parts, strict=True))
    return PenWay(time_s, tip, swing, elbow, down, tuple(named))


_ON_PAPER = (0.0, 0.0, 0.0)


def _at(leg: _Leg, pen: HeldPen, u: Array) -> tuple[Array, Array, Array, Array]:
    """Tip, swing, elbow and whether it writes, u from 0 to 1 along a leg."""
    going = minimum_jerk(u)
    before, between, after = leg.height
    height = before + (after - before) * going + between * 64.0 * (u * (1.0 - u)) ** 3
    place = leg.run.at(leg.run.seconds * u)
    tip = np.concatenate([pen.place[:2] + place, (pen.desk_m + height)[:, None]], axis=1)
    swing = leg.swing[0] + (leg.swing[1] - leg.swing[0]) * going
    elbow = leg.elbow[0] + (leg.elbow[1] - leg.elbow[0]) * going[:, None]
    return tip, swing, elbow, np.full(len(u), leg.height == _ON_PAPER)


@dataclass(frozen=True, slots=True)
class _Reached:
    """Characters that are written with the elbow in one place."""

    characters: list[tuple[int, Character]]
    middle_m: float
    elbow: Array


def _reached(characters: list[Character]) -> list[_Reached]:
    """A text in what the arm reaches without moving on, and the elbow's places."""
    groups = list[list[tuple[int, Character]]]()
    for numbered in enumerate(characters):
        left = groups[-1][0][1].left if groups else -np.inf
        if (numbered[1].right - left) * HEIGHT_M > _REACH_M:
            groups.append([])
        groups[-1].append(numbered)
    middles = [0.5 * HEIGHT_M * (g[0][1].left + g[-1][1].right) for g in groups]
    lefts = [HEIGHT_M * group[0][1].left for group in groups]
    out = []
    for i, (group, middle) in enumerate(zip(groups, middles, strict=True)):
        line, first = i // _SWINGS, i - i % _SWINGS
        along = (middle - lefts[first]) - (middles[0] - lefts[0])
        out.append(_Reached(group, middle, np.array([along, -line * _LINE_M, 0.0])))
    return out


def _written(text: _Reached, pen: HeldPen, rng: np.random.Generator) -> Iterator[_Leg]:
    """The strokes of some characters, as this performance has them."""
    for number, character in text.characters:
        middle = np.array([character.middle, 0.5])
        size, shift = rng.normal(1.0, _SIZE_SD), rng.normal(0.0, _PLACE_SD_M, 2)
        place = np.array([HEIGHT_M * character.middle - text.middle_m, 0.0]) + shift
        swing = _turn(pen, place[0])
        for which, stroke in enumerate(character.strokes):
            points = place + size * HEIGHT_M * (stroke - middle)
            for run in drawn(points, np.exp(rng.normal(0.0, _HURRY_SD))):
                staying = (swing, swing), (text.elbow, text.elbow)
                yield _Leg(run, _ON_PAPER, *staying, number, which)


def _connected(strokes: list[_Leg], rng: np.random.Generator) -> Iterator[_Leg]:
    """The same with the pen brought down first, lifted between strokes, and at the end."""
    start, end = _end(strokes[0], 0.0), _end(strokes[-1], 1.0)
    yield replace(strokes[0], run=_still(start), height=(_LIFT_M, 0.0, 0.0))
    for before, after in zip(strokes, [*strokes[1:], None], strict=True):
        yield before
        if after is None:
            break
        if (before.character, before.stroke) == (after.character, after.stroke):
            continue  # a corner
        here, there = _end(before, 1.0), _end(after, 0.0)
        moved = not np.array_equal(before.elbow[1], after.elbow[0])
        run = over(
            here, there, np.exp(rng.normal(0.0, _HURRY_SD)), _ELBOW_MOVES_S if moved else 0.0
        )
        yield _Leg(
            run,
            (0.0, float(rng.normal(_LIFT_M, _LIFT_SD_M)), 0.0),
            (before.swing[1], after.swing[0]),
            (before.elbow[1], after.elbow[0]),
            before.character,
            before.stroke,
        )
    yield replace(strokes[-1], run=_still(end), height=(0.0, 0.0, _LIFT_M))


def _end(leg: _Leg, u: float) -> Array:
    place: Array = leg.run.at(np.array([u * leg.run.seconds]))[0]
    return place


def _still(place: Array) -> Run:
    return Run(_DOWN_S, lambda time_s: np.tile(place, (len(time_s), 1)))


def _turn(pen: HeldPen, along_m: float) -> float:
    """Of the forearm, from the middle of the reach to this far along the line."""
    x, y = pen.place[:2]
    return float(np.arctan2(y, x + along_m) - np.arctan2(y, x))


def _taken_up(pen: HeldPen, start: Array) -> Trajectory:
    flat = np.zeros_like(start)
    up = through_stops(np.array([0.0, 1.2, 2.0]), np.stack([flat, _raised(pen, start), start]))
    return joined([held(flat, 0.5), up])


def _laid_down(pen: HeldPen, end: Array) -> Trajectory:
    flat = np.zeros_like(end)
    down = through_stops(np.array([0.0, 0.8, 2.2]), np.stack([end, _raised(pen, end), flat]))
    return joined([down, held(flat, 0.5)])


def _raised(pen: HeldPen, posture: Array) -> Array:
    raised = pen.posture.copy()
    raised[0] += _RAISED_RAD
    raised[TURNS:] = posture[TURNS:]
    return raised
