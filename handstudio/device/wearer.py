"""Whoever wears a virtual glove, while it streams: asked to do something, it does it."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

from handstudio.errors import HandstudioError
from handstudio.protocol.packets import Result
from handstudio.recording.material import material
from handstudio.recording.simulated import Rehearsed
from handstudio.simulation.glove import WornGlove
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import parse, perform
from handstudio.simulation.motions.naming import resolve


class Wearer:
    """Does what it is asked, in a thread: thinking about how to write a word takes seconds."""

    _AT_ONCE_S = 0.02  # what is thought of by then is told with the reply

    def __init__(self, rehearsed: Rehearsed, worn: WornGlove) -> None:
        self._rehearsed, self._worn = rehearsed, worn
        self._thinking = ThreadPoolExecutor(1, thread_name_prefix="wearer")
        self._thought: Future[float] | None = None
        self._times = 0

    def asked(self, text: str) -> tuple[Result, str]:
        """Begin to do what the text says; the answer for the host."""
        if self._thought is not None and not self._thought.done():
            return Result.BUSY, "still thinking about the last one"
        try:
            motion = resolve(text)
            parse(motion)
        except HandstudioError as error:
            return Result.BAD_ARGUMENT, str(error)
        self._times += 1
        self._thought = self._thinking.submit(self._perform, motion, f"asked {self._times}")
        try:
            return Result.OK, f"{self._thought.result(self._AT_ONCE_S):.1f} s"
        except TimeoutError:
            return Result.OK, "thinking"
        except HandstudioError as error:
            return Result.BAD_ARGUMENT, str(error)

    def _perform(self, motion: str, place: str) -> float:
        rehearsed = self._rehearsed
        actor = Actor(rehearsed.subject, rehearsed.seed, material(), place)
        trajectory = perform(motion, actor)
        self._worn.turn_to(trajectory)
        return trajectory.duration_s
