"""What was felt during a phase of a wizard: samples that grow, but never beyond a bound."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handstudio.samples import ImuSamples

RATE_HZ = 100.0
"""As often as a hand's motion has to be looked at; what comes faster is thinned to about that."""

MOST = 20_000
"""Instants that are kept: 200 s at 100 Hz, 30 MB of twenty sensors. Beyond it every other goes."""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Samples since some instant, thinned by counting, so that no cutting changes them.

    Attributes:
        every: Of so many instants that came one is kept.
        seen: How many came.
        kept: How many are kept.
        pieces: What is kept, in runs.
    """

    every: int = 1
    seen: int = 0
    kept: int = 0
    pieces: tuple[ImuSamples, ...] = ()

    @property
    def samples(self) -> ImuSamples | None:
        """All of it; None: nothing yet."""
        return joined(self.pieces) if self.pieces else None

    @property
    def seconds(self) -> float:
        """From the first instant to the last."""
        if not self.pieces:
            return 0.0
        return int(self.pieces[-1].time_us[-1] - self.pieces[0].time_us[0]) * 1e-6


def begun(rate_hz: float) -> Window:
    """Nothing yet, of a device of this rate."""
    return Window(every=max(1, round(rate_hz / RATE_HZ)))


def added(window: Window, samples: ImuSamples) -> Window:
    """What came since is there too."""
    first = -window.seen % window.every
    piece = samples[first :: window.every]
    window = replace(window, seen=window.seen + len(samples))
    if not len(piece):
        return window
    window = replace(window, kept=window.kept + len(piece), pieces=(*window.pieces, piece))
    while window.kept > MOST:
        window = _halved(window)
    return window


def compact(window: Window) -> Window:
    """The same in one run of its own memory."""
    return window if len(window.pieces) < 2 else replace(window, pieces=(joined(window.pieces),))


def last(window: Window, seconds: float) -> Window:
    """Only the newest of it."""
    whole = window.samples
    if whole is None:
        return window
    oldest = int(whole.time_us[-1]) - round(seconds * 1e6)
    rest = whole[int(np.searchsorted(whole.time_us, oldest)) :]
    return replace(window, kept=len(rest), pieces=(rest,))


def joined(pieces: tuple[ImuSamples, ...]) -> ImuSamples:
    """Runs one after the other."""
    if len(pieces) == 1:
        return pieces[0]
    return ImuSamples(
        *(np.concatenate([getattr(p, name) for p in pieces]) for name in ImuSamples.__slots__)
    )


def _halved(window: Window) -> Window:
    pieces = (joined(window.pieces)[::2],)
    return replace(window, every=2 * window.every, kept=len(pieces[0]), pieces=pieces)
