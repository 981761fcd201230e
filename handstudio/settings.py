"""What the studio remembers of one start to the next: choices of a person, nothing of a take.

A JSON file in the user's folder of settings. What cannot be read or makes no sense costs a notice,
never the start of the studio.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import msgspec
import platformdirs

from handstudio.analysis.posture_time import Band
from handstudio.errors import HandstudioError, SettingsError
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M, HandSide, HandType
from handstudio.recording.atomic import BACKUP, write_atomically

FILE_VARIABLE = "HANDSTUDIO_SETTINGS"
"""Environment variable that names another file."""

QUIET_S = 1.0
"""How long nothing more must change before a change is written."""


class Shown(msgspec.Struct, frozen=True):
    """What of the hand is drawn."""

    skin: bool = True
    bones: bool = True
    sensors: bool = True
    axes: bool = False
    labels: bool = False
    room: bool = True  # where a take knows where in one the hand was


class Settings(msgspec.Struct, frozen=True):
    """Everything remembered.

    Attributes:
        language: ``en``, ``ja``, ...; empty: the system's.
        theme: Of the page.
        last_address: The device that was connected last.
        subject: Code of the person, as last recorded; empty: nobody yet.
        take_name: What takes are called.
        visit: Name of the visit; empty: the day.
        countdown_s: How long to count down before a recording begins.
        sounds: Whether start and stop are heard.
        shown: What of the hand is drawn.
        camera: Name of the view.
        side: Which hand, where a device does not know.
        hand_length_mm: Of a subject whose hand was not measured.
        hand_type: How a calibration divides the palm, where the glove can tell.
        plot_span_s: How much time live plots show.
        filter: Name of the live filter; empty: whatever suits the device.
        curves: Name of the set of curves that is plotted.
        tracker: Address of the tracker in use: ``lsl:NAME``, or ``virtual:SEGMENT`` for the one on
            the virtual glove; empty: none.
        tracker_terminal: Which of its terminals; empty: the first.
        tracker_sensor: The sensor that sits on; empty: found from the motion.
        postures: Whose time is counted on the page besides that of the usual ones.
    """

    language: str = ""
    theme: Literal["dark", "light"] = "dark"
    last_address: str = ""
    subject: str = ""
    take_name: str = "take"
    visit: str = ""
    countdown_s: float = 3.0
    sounds: bool = True
    shown: Shown = Shown()
    camera: str = ""
    side: HandSide = "right"
    hand_length_mm: float = ADULT_HAND_LENGTH_M * 1e3
    hand_type: HandType = 3
    plot_span_s: float = 10.0
    filter: str = ""
    curves: str = "overview"
    tracker: str = ""
    tracker_terminal: str = ""
    tracker_sensor: str = ""
    postures: tuple[Band, ...] = ()


LIMITS: Mapping[str, tuple[float, float]] = {
    "countdown_s": (0.0, 30.0),
    "hand_length_mm": (50.0, 400.0),
    "plot_span_s": (1.0, 120.0),
}
"""Least and most of each number."""

_LONGEST = 500  # characters of a text: none of these is a novel
_LANGUAGE = re.compile(r"([a-z]{2,3}([-_]\w{2,8})*)?")


@dataclass(frozen=True, slots=True)
class Loaded:
    """Settings, and what a person should know of them."""

    settings: Settings
    notice: HandstudioError | None = None


def settings_path(chosen: Path | None = None) -> Path:
    """The file: the one chosen, else what ``HANDSTUDIO_SETTINGS`` names, else the user's."""
    if chosen is not None:
        return chosen
    named = os.environ.get(FILE_VARIABLE)
    if named:
        return Path(named)
    return platformdirs.user_config_path("handstudio", appauthor=False) / "settings.json"


def load_settings(path: Path, now: datetime | None = None) -> Loaded:
    """What was remembered; never fails.

    A file that makes no sense is kept as ``settings.broken-<stamp>.json`` and the one before it is
    read. A single value that makes no sense counts as its default; a number beyond its limits, as
    the limit.

    Args:
        path: The file.
        now: For the stamp.
    """
    notice: HandstudioError | None = None
    for candidate in (path, _backup(path)):
        try:
            values = _values(candidate.read_bytes())
        except FileNotFoundError:
            continue
        except OSError as error:
            notice = notice or _unreadable(candidate, error)
        except ValueError as error:
            kept = _put_aside(candidate, path, now or datetime.now(UTC))
            notice = notice or _broken(candidate, kept, error)
        else:
            settings, problem = _checked(values, candidate)
            return Loaded(settings, notice or problem)
    return Loaded(Settings(), notice)


def save_settings(path: Path, settings: Settings) -> None:
    """Store settings; what a newer version has written beside them stays.

    Raises:
        SettingsError: they cannot be written; those before are still there.
    """
    stored = _stored(path)
    merged = _merged(stored, msgspec.to_builtins(settings))
    try:
        write_atomically(path, msgspec.json.format(msgspec.json.encode(merged)))
    except OSError as error:
        raise SettingsError(
            "{path}: the settings cannot be kept ({reason}).",
            "The studio works, but forgets them when it ends. Check the folder's permissions.",
            path=path,
            reason=error.strerror or error,
        ) from error


@dataclass(slots=True)
class SettingsStore:
    """Settings that are written once nothing has changed for a while; for one thread.

    Attributes:
        path: The file.
        settings: As they are now.
    """

    path: Path
    settings: Settings = field(default_factory=Settings)
    _notice: HandstudioError | None = None
    _changed_at: float | None = None
    _failed: bool = False

    @classmethod
    def opened(cls, path: Path | None = None) -> SettingsStore:
        """The store of a file, by default the user's."""
        file = settings_path(path)
        loaded = load_settings(file)
        return cls(file, loaded.settings, loaded.notice)

    def put(self, settings: Settings, now_s: float) -> None:
        """Change settings; ``now_s`` is any steady clock, the one `tick` is told."""
        if settings != self.settings:
            self.settings = settings
            self._changed_at = now_s

    def tick(self, now_s: float) -> None:
        """Write what changed, once it has been quiet for `QUIET_S`; call it often."""
        if self._changed_at is not None and now_s - self._changed_at >= QUIET_S:
            self.flush()

    def flush(self) -> None:
        """Write what changed, now."""
        if self._changed_at is None:
            return
        self._changed_at = None
        try:
            save_settings(self.path, self.settings)
        except SettingsError as error:
            if not self._failed:  # said once
                self._notice = error
            self._failed = True
        else:
            self._failed = False

    def take_notice(self) -> HandstudioError | None:
        """What a person should know, once."""
        notice, self._notice = self._notice, None
        return notice


def _backup(path: Path) -> Path:
    return path.with_name(path.name + BACKUP)


def _values(data: bytes) -> dict[str, Any]:
    """The object in a file; raises ValueError where there is none."""
    try:
        return msgspec.json.decode(data, type=dict[str, Any])
    except (msgspec.MsgspecError, RecursionError) as error:
        raise ValueError(str(error)) from error


def _put_aside(file: Path, path: Path, now: datetime) -> Path:
    kept = path.with_name(f"{path.stem}.broken-{now:%Y%m%d-%H%M%S}{path.suffix}")
    if file != path:
        kept = kept.with_name(kept.name + BACKUP)
    try:
        return file.replace(kept)
    except OSError:  # it stays where it is, to be told of again
        return file


def _unreadable(file: Path, error: OSError) -> SettingsError:
    return SettingsError(
        "{path}: the settings cannot be read ({reason}).",
        "Check the file's permissions. Until then others are used.",
        path=file,
        reason=error.strerror or error,
    )


def _broken(file: Path, kept: Path, error: ValueError) -> SettingsError:
    return SettingsError(
        "{path}: the settings are damaged ({reason}).",
        "Those before them are used, or the defaults. The damaged file is kept: {kept}.",
        path=file,
        reason=error,
        kept=kept,
    )


def _checked(values: dict[str, Any], file: Path) -> tuple[Settings, HandstudioError | None]:
    wrong: list[str] = []
    good: dict[str, Any] = {}
    for each in msgspec.structs.fields(Settings):
        if each.name not in values:
            continue
        try:
            value = _converted(each.name, values[each.name], each.type)
        except ValueError:
            wrong.append(each.name)
            continue
        good[each.name] = within = _clamped(each.name, value)
        if within != value:
            wrong.append(each.name)
    if not wrong:
        return Settings(**good), None
    notice = SettingsError(
        "{path}: the values of {names} make no sense.",
        "The nearest that does is used, or the default; choose anew in the settings.",
        path=file,
        names=", ".join(wrong),
    )
    return Settings(**good), notice


def _converted(name: str, value: Any, kind: Any) -> Any:
    converted = msgspec.convert(value, kind)
    if isinstance(converted, str) and len(converted) > _LONGEST:
        raise ValueError("too long")
    if name == "language" and not _LANGUAGE.fullmatch(converted):
        raise ValueError("no language")
    return converted


def _clamped(name: str, value: Any) -> Any:
    if name not in LIMITS:
        return value
    least, most = LIMITS[name]
    return min(max(value, least), most)


def _stored(path: Path) -> dict[str, Any]:
    for candidate in (path, _backup(path)):
        with contextlib.suppress(OSError, ValueError):
            return _values(candidate.read_bytes())
    return {}


def _merged(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, Any]:
    """What is there now, and what was there before under names we do not know."""
    merged = {**before, **now}
    for key, value in now.items():
        old = before.get(key)
        if isinstance(value, dict) and isinstance(old, dict):
            merged[key] = {**old, **value}
    return merged
