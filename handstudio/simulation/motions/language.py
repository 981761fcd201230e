r"""The language of motions: ``calibration+2*open_close~slow+writing:"a+b"&elbow_moving``.

    phrase = part { "+" part }        one after the other
    part   = layer { "&" layer }      at the same time: what the later ones do is added
    layer  = [ N "*" ] name [ ":" argument ] { "~" manner }

An argument that holds one of ``+ & ~`` stands in double quotes. `catalogue` has the names,
`manners` the manners.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from handstudio.errors import SetupError
from handstudio.simulation.motions.actor import Actor, Motion, taking_turns
from handstudio.simulation.motions.catalogue import motions
from handstudio.simulation.motions.manners import MANNERS
from handstudio.simulation.trajectory import Trajectory, joined, layered

_LAYER = re.compile(
    r"""\s*(?:(?P<times>\d+)\s*\*\s*)?
    (?P<name>[a-z][a-z0-9_]*)
    (?:\s*:\s*(?P<argument>"[^"]*"|[^+&~"]*))?
    (?P<manners>(?:\s*~\s*[a-z_]+)*)\s*""",
    re.VERBOSE,
)
_MOST_REPEATS = 1000


@dataclass(frozen=True, slots=True)
class Layer:
    """One motion as it is asked for."""

    motion: Motion
    argument: str
    manners: tuple[str, ...]
    times: int


def perform(text: str, actor: Actor) -> Trajectory:
    """Make a motion out of its description; it begins and ends at rest.

    Raises:
        SetupError: this is not a description of motions, or not one this subject can perform.
    """
    parts = []
    for number, layers in enumerate(parse(text)):
        # the same motion twice in a phrase is performed twice, not copied
        place = f"{actor.place} {number}".strip()
        first, *over = (_made(layer, actor, f"{place}.{i}") for i, layer in enumerate(layers))
        for other in over:
            first = layered(first, other)
        parts.append(first)
    return joined(parts)


def parse(text: str) -> list[list[Layer]]:
    """Understand a description: parts in a row, each of layers at the same time.

    Raises:
        SetupError: it is not one.
    """
    phrase: list[list[Layer]] = [[]]
    at = 0
    while True:
        match = _LAYER.match(text, at)
        if match is None:
            raise _not_understood(text, at)
        phrase[-1].append(_layer(match))
        at = match.end()
        if at == len(text):
            return phrase
        if text[at] not in "+&":
            raise _not_understood(text, at)
        if text[at] == "+":
            phrase.append([])
        at += 1


def _layer(match: re.Match[str]) -> Layer:
    name, argument = match["name"], (match["argument"] or "").strip().strip('"')
    known = motions()
    if f"{name}:{argument}" in known:  # index_mcp:flexion is one name
        name, argument = f"{name}:{argument}", ""
    if name not in known:
        raise SetupError(
            "There is no motion {name!r}.",
            "See handstudio motions for those there are.",
            name=f"{name}:{argument}" if argument else name,
        )
    if argument and not known[name].argument:
        raise SetupError(
            "The motion {name} takes nothing behind a colon, and got {argument!r}.",
            "Leave it out.",
            name=name,
            argument=argument,
        )
    manners = tuple(m.strip() for m in match["manners"].split("~") if m.strip())
    for manner in manners:
        if manner not in MANNERS:
            raise SetupError(
                "Nothing can be done in the manner {manner!r}.",
                "Choose one of: {known}.",
                manner=manner,
                known=", ".join(MANNERS),
            )
    times = int(match["times"] or 1)
    if not 1 <= times <= _MOST_REPEATS:
        raise SetupError(
            "A motion cannot be repeated {times} times.",
            "Choose 1 to {most}.",
            times=times,
            most=_MOST_REPEATS,
        )
    return Layer(known[name], argument, manners, times)


def _made(layer: Layer, actor: Actor, place: str) -> Trajectory:
    takes = []
    for repeat in range(layer.times):
        this = actor.again(f"{place}.{repeat}")
        takes.append(_in_manners(layer.motion, layer.argument, layer.manners, this))
    return joined(takes)


def _in_manners(
    motion: Motion, argument: str, manners: tuple[str, ...], actor: Actor
) -> Trajectory:
    """A motion done so; of a row of motions each by itself, as nobody is sloppy evenly."""
    if motion.of:
        turns = taking_turns(actor, motion.of)
        return joined([_in_manners(part, "", manners, who) for who, part in turns])
    done = motion.make(actor, argument)
    for manner in manners:
        done = MANNERS[manner].of(actor, motion.name, done)
    return done


def _not_understood(text: str, at: int) -> SetupError:
    return SetupError(
        "The description of motions is not understood from here on: {rest!r}.",
        "Write names joined by + (one after the other) or & (at the same time), such as "
        "calibration+open_close; see handstudio motions.",
        rest=text[at:] or "(its end)",
    )
