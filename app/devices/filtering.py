"""Which filter is live: the one that was chosen, or the best for the device that is ready."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.state import Preparing, State
from handstudio.device.capture import Capture
from handstudio.device.orders import SetFilter
from handstudio.setup import FILTERS, AnyFilter

BEST = "tree"
"""For hands; it has to be prepared before it can serve."""

PLAIN = "vqf"
"""For everything else, and until then."""


class Prepared(Protocol):
    """What gets the best filter ready, see `app.work.preparing.Preparation`."""

    @property
    def ready(self) -> bool:
        """Whether nobody has to wait for it any more."""
        ...

    @property
    def failed(self) -> bool:
        """Whether it will never be."""
        ...


@dataclass
class Chooser:
    """Tells the capture which filter is wanted, whenever that is another one.

    Attributes:
        capture: Who is told.
        preparation: What gets the best filter ready; None: nobody does, and it never is.
    """

    capture: Capture
    preparation: Prepared | None = None
    _ready: bool = False
    _told: AnyFilter = FILTERS[PLAIN]

    def follow(self, state: State) -> Preparing:
        """Tell it where that is needed; how far the best filter is."""
        idle = state.newest.recorder is None and state.guided is None
        if idle and not self._ready and self.preparation is not None:
            # it comes by itself, so not into a take, nor into a course
            self._ready = self.preparation.ready
        wanted = FILTERS[self._name(state)]
        if wanted != self._told:
            self._told = wanted
            self.capture.send(SetFilter(wanted))
        return self._stands

    def _name(self, state: State) -> str:
        name = wanted_of(state)
        return PLAIN if name == BEST and not self._ready else name

    def serves(self, chosen: AnyFilter) -> bool:
        """Whether nobody has to wait for this filter here."""
        return self._ready or not isinstance(chosen, type(FILTERS[BEST]))

    @property
    def _stands(self) -> Preparing:
        if self._ready or self.preparation is None:
            return "no"
        return "failed" if self.preparation.failed else "yes"


def wanted_of(state: State) -> str:
    """Name of the filter that was chosen, else of the one that suits the device."""
    chosen, setup = state.settings.filter, state.newest.setup
    if chosen in FILTERS:
        return chosen
    return BEST if setup is None or setup.layout.is_hand else PLAIN
