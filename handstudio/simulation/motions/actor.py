"""Who performs, and what a motion is: a name and how the performer makes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.simulation.postures import Posture, Script, channels, scripted
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import Trajectory, joined
from handstudio.simulation.world import World

Stroke: TypeAlias = Float[Array, "_ 2"]
"""What a pen draws without being lifted: right and up, in heights of a character."""


@dataclass(frozen=True, slots=True)
class HandRecording:
    """A real hand's motion as somebody recorded it.

    Attributes:
        time_s: Rising from 0.
        joints_m: Of thumb to little finger: base of the metacarpal (NaN where unknown), MCP, PIP,
            DIP and tip, in a frame with z up and y away from the person; (n, 5, 5, 3) [m].
            The thumb's IP stands for its PIP, and its DIP is NaN.
        palm: Palm frame of each instant as a matrix: columns point to the little finger's side of
            a right hand, to the fingers and out of the back of the hand; (n, 3, 3).
    """

    side: str
    time_s: Float[Array, " n"]
    joints_m: Float[Array, "n 5 5 3"]
    palm: Float[Array, "n 3 3"]


def _no_strokes(character: str) -> Sequence[Stroke]:
    raise SetupError(
        "No strokes are at hand for {character!r}.",
        "Install them: pip install 'handstudio[writing]'.",
        character=character,
    )


@dataclass(frozen=True, slots=True)
class Material:
    """What comes from files: how characters are written, and recordings of real hands.

    Attributes:
        strokes: Gives a character's strokes in their order; raises SetupError for one it lacks.
        recordings: Real hands by name.
    """

    strokes: Callable[[str], Sequence[Stroke]] = _no_strokes
    recordings: Mapping[str, Callable[[], HandRecording]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Actor:
    """Somebody about to perform; a seed is one performance.

    Attributes:
        seed: Of this performance: no two of a person are the same.
        material: What comes from files.
        place: Where in the performance: doing something twice is not doing it the same way.
        world: Where it is performed, for whoever moves the elbow.
    """

    subject: Subject
    seed: int = 0
    material: Material = Material()
    place: str = ""
    world: World = World()

    def again(self, place: str) -> Actor:
        """The same person at another place of the performance."""
        return replace(self, place=place)

    def rng(self, motion: str) -> np.random.Generator:
        """Random numbers of one motion of this performance: others do not change them."""
        words = f"{self.subject.number} {self.place} {motion}".encode()
        return np.random.default_rng(np.random.SeedSequence([self.seed, *words]))

    def posture(self, posture: Posture) -> Float[Array, " c"]:
        """A posture in named angles [deg] on this subject's side, as a trajectory has it."""
        return channels(posture, self.subject.side)

    def play(self, script: Script) -> Trajectory:
        """A script in named angles [deg], from the flat hand."""
        return scripted(script, self.subject.side)


@dataclass(frozen=True, slots=True)
class Motion:
    """Something a subject can do.

    Attributes:
        name: In snake_case; ``index_mcp:flexion`` is the name of a calibration motion.
        what: What is done, a sentence without its full stop.
        make: Performs it: the actor, and what stands behind the colon.
        argument: What stands behind the colon, for people; empty where nothing does.
        example: Of what stands there; empty where it may be left out.
        of: The motions it is a row of, if it is one: manners act on each by itself.
    """

    name: str
    what: str
    make: Callable[[Actor, str], Trajectory]
    argument: str = ""
    example: str = ""
    of: tuple[Motion, ...] = ()

    @property
    def described(self) -> str:
        """One way to ask for it."""
        return f"{self.name}:{self.example}" if self.example else self.name


def in_a_row(name: str, what: str, *of: Motion) -> Motion:
    """A motion that is others, one after the other."""

    def make(actor: Actor, _: str) -> Trajectory:
        return joined([part.make(who, "") for who, part in taking_turns(actor, of)])

    return Motion(name, what, make, of=of)


def taking_turns(actor: Actor, of: Sequence[Motion]) -> Iterator[tuple[Actor, Motion]]:
    """The actor at each of the places of a row."""
    for place, part in enumerate(of):
        yield actor.again(f"{actor.place}/{place}"), part
