"""A take on the screen: its motion, another to compare, where in it we are, how fast it plays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float

from app.shown.comparison import Comparison, compared, seconds_of
from app.shown.seen import Choice, Seen, seen
from handstudio.analysis.stretches import Stretch
from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.finds import Found
from handstudio.measure import Measured
from handstudio.pipeline import Motion
from handstudio.recording.notes import Notes
from handstudio.recording.take import Take
from handstudio.setup import Setup
from handstudio.signals import Signals
from handstudio.way import Way

_NARROWEST_S = 0.2  # of time in the plots: a few instants
_LEAD = 0.1  # share of the plots before the playhead, where it has played out of them

Rest: TypeAlias = Literal["here", "coming", "missing"]
"""What is beyond the first seconds: there, being computed, or not, as that stopped or failed."""

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True, eq=False)
class Review:
    """An opened take."""

    take: Take
    motion: Motion
    time_s: Float[Array, " n"]
    seen: Seen  # what the plots show, of the time from here
    from_s: float
    to_s: float
    choice: Choice = Choice()
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
    earlier: Path | None = None  # the take of an earlier visit that measures are held against
    other_side: Path | None = None  # and that of the other hand
    measured: Measured | None = None
    signals: Signals | None = None  # None: nobody has asked for them yet
    stretches: tuple[Stretch, ...] | None = None  # None: not known yet
    found: Found | None = None  # what was written and grasped; None: not known yet
    way: Way | None = None  # in a tracker's room; None: there is none, or it is not known yet
    ordered: frozenset[str] = frozenset()  # which of these are on their way
    rest: Rest = "here"

    @property
    def setup(self) -> Setup:
        """What decided this motion."""
        return self.used or self.take.header.setup

    @property
    def partial(self) -> bool:
        """Only the first seconds are there."""
        return self.rest != "here"

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
    by, time_s = setup or take.header.setup, seconds_of(motion)
    ends = 0.0, float(time_s[-1])
    return Review(take, motion, time_s, seen(by, motion, time_s, ends, Choice()), *ends, used=setup)


def computed_by(review: Review, setup: Setup, motion: Motion) -> Review:
    """The same take at the same place by another setup, compared with nothing yet."""
    new = opened(review.take, motion, setup)
    names = ["playing", "speed", "in_s", "out_s", "loop", "notes", "smooth", "compare"]
    names += ["choice", "signals", "earlier", "other_side"]
    if not _is(review, 0.0, review.duration_s):
        names += ["from_s", "to_s"]
    same = {name: getattr(review, name) for name in names}
    return seen_anew(replace(new, at_s=min(review.at_s, new.duration_s), **same))


def compared_with(review: Review, setup: Setup, motion: Motion, take: str = "") -> Review:
    """The take with the second motion that was asked for; ``take`` names the other, if it is one.

    Raises:
        TakeError: nothing moves in it.
    """
    if len(motion) == 0:
        raise _nothing_in(review.take)
    return seen_anew(replace(review, comparison=compared(review.compare, setup, motion, take)))


def shifted(review: Review, later_s: float) -> Review:
    """The other take's begin is laid so much later than this one's."""
    if review.comparison is None:
        return review
    return seen_anew(replace(review, comparison=replace(review.comparison, later_s=later_s)))


def seen_anew(review: Review) -> Review:
    """With the curves that are now to be seen."""
    window = review.from_s, review.to_s
    curves = seen(
        review.setup,
        review.motion,
        review.time_s,
        window,
        review.choice,
        signals=review.signals,
        comparison=review.comparison,
    )
    return replace(review, seen=curves)


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
        return followed(replace(review, at_s=at))
    if review.loop and review.end_s > review.in_s:
        return followed(replace(review, at_s=review.in_s))
    return followed(replace(review, at_s=review.end_s, playing=False))


def sought(review: Review, at_s: float) -> Review:
    """Go to a time, pausing."""
    there = min(max(at_s, 0.0), review.duration_s)
    return followed(replace(review, at_s=there, playing=False))


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


def zoomed(review: Review, factor: float) -> Review:
    """So many times less time in the plots, about the playhead where it is in them."""
    inside = review.from_s <= review.at_s <= review.to_s
    middle = review.at_s if inside else (review.from_s + review.to_s) / 2.0
    return _windowed(
        review, *(middle + (end - middle) / factor for end in (review.from_s, review.to_s))
    )


def panned(review: Review, share: float) -> Review:
    """On by this share of the time in the plots, or back."""
    step = share * (review.to_s - review.from_s)
    return _windowed(review, review.from_s + step, review.to_s + step)


def fitted(review: Review) -> Review:
    """The part that counts fills the plots; where it does already, the whole take does."""
    part = review.in_s, review.end_s
    return _windowed(review, *((0.0, review.duration_s) if _is(review, *part) else part))


def followed(review: Review) -> Review:
    """The plots turn over to where the playhead is."""
    if review.from_s - 1e-9 <= review.at_s <= review.to_s + 1e-9:
        return review
    width = review.to_s - review.from_s
    start = review.at_s - _LEAD * width
    return _windowed(review, start, start + width)


def _windowed(review: Review, from_s: float, to_s: float) -> Review:
    """This window of time, as far as the take goes, in the plots."""
    width = min(max(to_s - from_s, _NARROWEST_S), review.duration_s)
    start = min(max(from_s, 0.0), review.duration_s - width)
    if _is(review, start, start + width):
        return review
    return seen_anew(replace(review, from_s=start, to_s=start + width))


def _is(review: Review, from_s: float, to_s: float) -> bool:
    return abs(review.from_s - from_s) < 1e-6 and abs(review.to_s - to_s) < 1e-6


def _nothing_in(take: Take) -> TakeError:
    return TakeError(
        "{name} holds no instant of motion.",
        "The device sent nothing while it was recorded; record it again.",
        name=take.path.name,
    )
