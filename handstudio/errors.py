"""Errors meant for a person: what happened, how much, and what to do next."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class HandstudioError(Exception):
    """An expected failure that a person can act on.

    The words are templates, and what varies in them is given by name, so that a catalogue can hold
    them: ``TakeError("{path}: is no take.", "Choose another file.", path=path)``.

    A value may be another error, the reason of this one: its name stands for what happened, in the
    language of the rest, and ``{name.remedy}`` for what it says to do.

    Args:
        what: The place and the fact, with figures and limits ("{path}, row {row}: ...").
        remedy: What to do next, as an instruction.
        values: What stands for the names in the two; without any they are taken literally.
            Numbers, text and errors are kept as they are, of anything else its text.
    """

    def __init__(self, what: str, remedy: str, /, **values: object) -> None:
        self._templates = what, remedy
        self._values = {name: _kept(value) for name, value in values.items()}
        super().__init__("\n".join(self.in_words(_as_written)))

    @property
    def what(self) -> str:
        """What happened, in English."""
        return self.in_words(_as_written)[0]

    @property
    def remedy(self) -> str:
        """What to do next, in English."""
        return self.in_words(_as_written)[1]

    def in_words(self, translate: Callable[[str], str]) -> tuple[str, str]:
        """What happened and what to do next, in the language of a catalogue."""
        what, remedy = (translate(template) for template in self._templates)
        if not self._values:
            return what, remedy
        said = {name: _said(value, translate) for name, value in self._values.items()}
        return what.format(**said), remedy.format(**said)

    def about(self, **values: object) -> HandstudioError:
        """The same error with other values, as far as its words hold them."""
        known = {name: value for name, value in values.items() if name in self._values}
        return type(self)(*self._templates, **{**self._values, **known})

    def __reduce__(self) -> tuple[object, ...]:
        """Errors travel between processes, which an exception's own way does not allow here."""
        return _again, (type(self), *self._templates, self._values)


_Value = int | float | str | HandstudioError


class _Said(NamedTuple):
    """An error as a value of another."""

    what: str
    remedy: str

    def __str__(self) -> str:
        return self.what

    def __format__(self, spec: str) -> str:
        return format(self.what, spec)


def _kept(value: object) -> _Value:
    """What is whole in another process too."""
    return value if isinstance(value, _Value) else str(value)


def _said(value: _Value, translate: Callable[[str], str]) -> object:
    return _Said(*value.in_words(translate)) if isinstance(value, HandstudioError) else value


def _as_written(template: str) -> str:
    return template


def _again(
    kind: type[HandstudioError], what: str, remedy: str, values: dict[str, _Value]
) -> HandstudioError:
    return kind(what, remedy, **values)


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


class SettingsError(HandstudioError):
    """What the studio remembers cannot be read, makes no sense, or cannot be kept."""


class CalibrationError(HandstudioError):
    """A calibration cannot be computed from what was recorded, or cannot be read."""


class TrackError(HandstudioError):
    """What a tracker told cannot be read, or no joint can be found from it."""
