"""A line that loses frames in bursts and damages some: for hosts that have to live with it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from handstudio.simulation.imperfections.noise import BLOCK, generator
from handstudio.simulation.imperfections.strengths import Imperfections

LOST, BURST = 0.005, 4.0
DAMAGED = 0.0005


@dataclass(frozen=True, slots=True)
class Line:
    """A kind of line; a seed is one.

    Attributes:
        lost: Share of the frames that do not arrive.
        burst: How many are lost in a row, in the mean.
        damaged: Share of those that arrive with one byte changed.
    """

    seed: int
    lost: float
    damaged: float
    burst: float = BURST


@dataclass(frozen=True, slots=True)
class LineState:
    """Where a stream of frames stands: how many were sent, and whether they are being lost."""

    index: int = 0
    losing: bool = False


def line_of(what: Imperfections, seed: int) -> Line:
    """The line of one glove."""
    return Line(seed, lost=what.lost_packets * LOST, damaged=what.damaged_packets * DAMAGED)


def passed(line: Line, state: LineState, frames: Iterable[bytes]) -> tuple[list[bytes], LineState]:
    """What arrives of frames that follow those already sent.

    A line that works begins to lose, and one that loses works again, with a constant chance at
    every frame (E. N. Gilbert, Bell Syst. Tech. J. 39 (1960) 1253, without his errors in between).
    """
    index, losing = state.index, state.losing
    arrived = []
    for frame in frames:
        chance, hit, where, how = _chances(line.seed, index // BLOCK)[index % BLOCK]
        # chosen so that in the long run the share lost is lost
        begins = line.lost / (line.burst * (1.0 - line.lost))
        losing = chance >= 1.0 / line.burst if losing else chance < begins
        index += 1
        if not losing:
            arrived.append(_hit(frame, where, how) if hit < line.damaged else frame)
    return arrived, LineState(index, losing)


_LINE = 80  # which of a seed's streams


@lru_cache(maxsize=8)
def _chances(seed: int, block: int) -> list[list[float]]:
    chances: list[list[float]] = generator(seed, _LINE, block).uniform(size=(BLOCK, 4)).tolist()
    return chances


def _hit(frame: bytes, where: float, how: float) -> bytes:
    """One byte of a frame, its end included, becomes another."""
    out = bytearray(frame)
    if out:
        out[int(where * len(out))] ^= 1 + int(how * 255)
    return bytes(out)
