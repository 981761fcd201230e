"""The take that is open: what is shown of it as far as it is there, the rest ordered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from app.shown import comparison
from app.shown import review as reviewing
from app.shown.channels import OVERVIEW, SIGNALS, sets_of
from app.shown.review import Review
from app.shown.seen import Choice
from app.work.workshop import Workshop
from handstudio.finds import kept_finds
from handstudio.pipeline import Motion
from handstudio.process import kept_motion
from handstudio.recording.take import Take, open_take
from handstudio.rooted import track_key
from handstudio.setup import Setup
from handstudio.signals import kept_signals
from handstudio.survey import kept_survey
from handstudio.way import kept_way


@dataclass
class Reviewer:
    """Makes reviews, and orders of the workshop what they lack; for one thread.

    Attributes:
        workshop: Where long work is ordered.
        curves: Name of the set of curves that is wanted.
        sensor: Name of the one whose signals are.
        opening: The take that was asked for and is not there yet.
    """

    workshop: Workshop
    curves: str = OVERVIEW
    sensor: str = ""
    opening: Path | None = None

    def opened(self, take: Take, *, preview: bool) -> Review | None:
        """A take at its beginning; None: it is computed first, ``preview``: its first seconds now.

        Raises:
            TakeError: nothing moves in it.
        """
        motion = kept_motion(take)
        if motion is not None:
            self.opening = None
            return reviewing.opened(take, motion)
        self.opening = take.path
        if preview:  # first: somebody waits for it
            self.workshop.preview(take)
        self.workshop.compute(take)
        return None

    def head(self, take: Take, motion: Motion) -> Review | None:
        """The first seconds, where they are still waited for."""
        if take.path != self.opening or len(motion) == 0:
            return None
        return replace(reviewing.opened(take, motion), rest="coming")

    def computed(self, take: Take, review: Review | None) -> Review | None:
        """All of a take that was computed, in the place of what was shown of it; None: not wanted.

        Raises:
            TakeError: nothing moves in it.
        """
        motion, wanted = kept_motion(take), take.path == self.opening
        here = review is not None and review.take.path == take.path
        if motion is None or not (wanted or here):
            return None
        self.opening = None if wanted else self.opening
        if review is None or not here:
            return reviewing.opened(take, motion)
        if review.partial:
            return reviewing.computed_by(review, take.header.setup, motion)
        return review

    def uncomputed(self, take: Take, review: Review | None) -> Review | None:
        """What is shown of a take whose computing was stopped or failed; None: nothing changes."""
        if take.path == self.opening:
            self.opening = None
        if review is None or review.take.path != take.path or not review.partial:
            return None
        return replace(review, rest="missing")

    def completed(self, review: Review) -> Review:
        """With the rest of its take ordered, where that is missing."""
        if review.rest != "missing":
            return review
        self.workshop.compute(review.take)
        return replace(review, rest="coming")

    def brought(self, review: Review) -> Review:
        """With the motions that are asked for, as far as they are there; others are ordered.

        Raises:
            HandstudioError: the take to compare with cannot be opened.
        """
        own = review.take.header.setup
        wanted = comparison.setup_of(comparison.SMOOTHED, own) if review.smooth else own
        if wanted != review.setup:
            motion = self._motion_by(review.take, wanted)
            if motion is not None:
                review = reviewing.computed_by(review, wanted, motion)
        if not review.compare:
            if review.comparison is not None:
                review = reviewing.seen_anew(replace(review, comparison=None))
        elif review.comparison is None or review.comparison.name != review.compare:
            review = self._beside(review)
        return self._looked_through(review)

    def _beside(self, review: Review) -> Review:
        """With the motion that is compared with, where it is there; else it is ordered."""
        if review.compare.startswith(comparison.OF_TAKE):
            other = open_take(Path(review.compare.removeprefix(comparison.OF_TAKE)))
            setup, name = other.header.setup, other.path.stem
        else:
            other, name = review.take, ""
            setup = comparison.setup_of(review.compare, other.header.setup)
        motion = self._motion_by(other, setup)
        if motion is None:
            return review
        return reviewing.compared_with(review, setup, motion, name)

    def _looked_through(self, review: Review) -> Review:
        """With the curves that are chosen, and what is known of the motion."""
        layout = review.setup.layout
        chosen = self.curves if self.curves in sets_of(layout) else OVERVIEW
        sensor = layout.names.index(self.sensor) if self.sensor in layout.names else 0
        before = review
        review = replace(review, choice=Choice(chosen, sensor))
        if not review.partial:  # else all of it is on its way, and these afterwards
            review = self._ordered(review)
        same = review.choice == before.choice and review.signals is before.signals
        return review if same else reviewing.seen_anew(review)

    def _ordered(self, review: Review) -> Review:
        """With what is kept of signals, stretches and finds; what is not is ordered, once."""
        take, signals = review.take, review.signals
        stretches, found, way = review.stretches, review.found, review.way
        if review.choice.name == SIGNALS and signals is None:
            signals = kept_signals(take)
        if stretches is None:
            stretches = kept_survey(take, review.setup)
        if found is None:
            found = kept_finds(take, review.setup)
        tracked = track_key(take, review.setup) is not None
        if way is None and tracked:
            way = kept_way(take, review.setup)
        lacking = {
            "signals": review.choice.name == SIGNALS and signals is None,
            "stretches": stretches is None,
            "found": found is None,
            "way": way is None and tracked,
        }
        new = {name for name, lacks in lacking.items() if lacks} - review.ordered
        if "signals" in new:
            self.workshop.write_signals(take)
        if "stretches" in new:
            self.workshop.look_through(take, review.used)
        if "found" in new:
            self.workshop.find(take, review.setup)
        if "way" in new:
            self.workshop.find_way(take, review.used)
        review = replace(review, stretches=stretches, found=found, way=way)
        return replace(review, signals=signals, ordered=review.ordered | new)

    def _motion_by(self, take: Take, setup: Setup) -> Motion | None:
        motion = kept_motion(take, setup)
        if motion is None:
            self.workshop.compute_by(take, setup)
        return motion
