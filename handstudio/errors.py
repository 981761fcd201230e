"""Errors meant for a person: what happened, how much, and what to do next."""

from __future__ import annotations


class HandstudioError(Exception):
    """An expected failure that a person can act on.

    Args:
        what: The place and the fact, with figures and limits ("samples.csv, row 7: ...").
        remedy: What to do next, as an instruction.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what}\n{remedy}")
        self.what = what
        self.remedy = remedy


class DeviceError(HandstudioError):
    """A device cannot be opened, is not ours, or does not answer."""


class TakeError(HandstudioError):
    """A file is not a take, is damaged, or cannot be written."""


class ImportFolderError(HandstudioError):
    """A raw import folder does not hold what it should."""


class LayoutError(HandstudioError):
    """A layout names sensors, segments or joints that do not fit together."""


class SetupError(HandstudioError):
    """A setup asks for something this version does not know."""
