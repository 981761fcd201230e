"""A take on the screen: its motion, another to compare, where in it we are, how fast it plays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from app.channels import sds_of, values_of
from app.comparison import Comparison, compared, picked, seconds_of
from app.found import Found
from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.pipeline import Motion
from handstudio.recording.notes import Notes
from handstudio.recording.take import Take
from handstudio.setup import Setup

_PLOTTED = 1000  # instants in a plot of the whole take: more than it has pixels

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True, eq=False)
class Review:
    """An opened take."""

    take: Take
    motion: Motion
    time_s: Float[Array, " n"]
    plot_time_s: Float[Array, " p"]
    plot_values: Float[Array, "p c"]
    plot_sds: Float[Array, "p c"]  # [deg], inf where the filter does not tell
    at_s: float = 0.0
    playing: bool = False
    speed: float = 1.0
    in_s: float = 0.0  # the part that is played and exported
    out_s: float | None = None  # None: to the end
    loop: bool = False
    notes: Notes = Notes()
    used: Setup | None = None  # what this motion was computed by; None: the take's own
    smooth: bool = False  # somebody wants it smoothed; it is once that is computed
    compare: str = ""  # and compared with this one, or nothing
    comparison: Comparison | None = None
    found: Found = Found()  # what was written and grasped, once that is looked for

    @property
    def setup(self) -> Setup:
        """What decided this motion."""
        return self.used or self.take.header.setup

    @property
    def plotted(self) -> Motion:
        """The instants that are in the plots."""
        return picked(self.motion, np.searchsorted(self.time_s, self.plot_time_s))

    @property
    def duration_s(self) -> float:
        """Time of the last instant."""
        return float(self.time_s[-1])

    @property
    def end_s(self) -> float:
        """Where the part that counts ends."""
        return self.duration_s if self.out_s is None else self.out_s

    @property
    def index(self) -> int:
        """The instant that is shown: the last one not after the time we are at."""
        found = int(np.searchsorted(self.time_s, self.at_s + 1e-9, side="right")) - 1
        return min(max(found, 0), len(self.time_s) - 1)

    @property
    def instant(self) -> Motion:
        """The motion at this instant."""
        return self.motion[self.index : self.index + 1]


def opened(take: Take, motion: Motion, setup: Setup | None = None) -> Review:
    """A take at its beginning, paused; ``setup`` is what the motion was computed by, if another.

    Raises:
        TakeError: nothing moves in it.
    """
    if len(motion) == 0:
        raise _nothing_in(take)
    time_s = seconds_of(motion)
    shown = np.unique(np.linspace(0, len(time_s) - 1, _PLOTTED).round().astype(int))
    by, few = setup or take.header.setup, picked(motion, shown)
    curves = values_of(by, few), sds_of(by, few)
    return Review(take, motion, time_s, time_s[shown], *curves, used=setup)


def computed_by(review: Review, setup: Setup, motion: Motion) -> Review:
    """The same take at the same place by another setup, compared with nothing yet."""
    new = opened(review.take, motion, setup)
    same = {
        name: getattr(review, name)
        for name in ("playing", "speed", "in_s", "out_s", "loop", "notes", "smooth", "compare")
    }
    return replace(new, at_s=min(review.at_s, new.duration_s), **same)


def compared_with(review: Review, setup: Setup, motion: Motion) -> Review:
    """The take with the second motion that was asked for.

    Raises:
        TakeError: nothing moves in it.
    """
    if len(motion) == 0:
        raise _nothing_in(review.take)
    plotted = review.plotted
    found = compared(review.compare, setup, motion, plotted, review.plot_values)
    return replace(review, comparison=found)


def settled(review: Review) -> Review:
    """What was asked for and will not come is asked for no more."""
    comparison = review.comparison
    return replace(
        review, smooth=review.setup.smooth, compare="" if comparison is None else comparison.name
    )


def advanced(review: Review, elapsed_s: float) -> Review:
    """Play on; at the end of the part that counts it stops, or begins again."""
    if not review.playing:
        return review
    at = review.at_s + elapsed_s * review.speed
    if at < review.end_s:
        return replace(review, at_s=at)
    if review.loop and review.end_s > review.in_s:
        return replace(review, at_s=review.in_s)
    return replace(review, at_s=review.end_s, playing=False)


def sought(review: Review, at_s: float) -> Review:
    """Go to a time, pausing."""
    return replace(review, at_s=min(max(at_s, 0.0), review.duration_s), playing=False)


def stepped(review: Review, instants: int) -> Review:
    """Go some instants on or back, pausing."""
    index = min(max(review.index + instants, 0), len(review.time_s) - 1)
    return sought(review, float(review.time_s[index]))


def toggled(review: Review) -> Review:
    """Play or pause; from outside the part that counts, or its end, it plays from its begin."""
    inside = review.in_s <= review.at_s < review.end_s - 1e-9
    if not review.playing and not inside:
        return replace(review, at_s=review.in_s, playing=True)
    return replace(review, playing=not review.playing)


def marked_in(review: Review) -> Review:
    """The part that counts begins here; an end before it is forgotten."""
    out_s = review.out_s if review.out_s is not None and review.out_s > review.at_s else None
    return replace(review, in_s=review.at_s, out_s=out_s)


def marked_out(review: Review) -> Review:
    """The part that counts ends here; a begin after it is forgotten."""
    in_s = review.in_s if review.in_s < review.at_s else 0.0
    return replace(review, in_s=in_s, out_s=review.at_s)


def whole(review: Review) -> Review:
    """The whole take counts."""
    return replace(review, in_s=0.0, out_s=None)


def at_next_mark(review: Review, *, forward: bool) -> Review:
    """On to the next mark, or back to the one before; where there is none, to the take's end."""
    apart = 1e-6 if forward else -1e-6
    marks = [mark.at_s for mark in review.notes.marks]
    if forward:
        ahead = [at for at in marks if at > review.at_s + apart]
        return sought(review, min(ahead, default=review.duration_s))
    return sought(review, max((at for at in marks if at < review.at_s + apart), default=0.0))


def _nothing_in(take: Take) -> TakeError:
    return TakeError(
        "{name} holds no instant of motion.",
        "The device sent nothing while it was recorded; record it again.",
        name=take.path.name,
    )
