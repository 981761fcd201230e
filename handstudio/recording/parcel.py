"""A take and its notes as one file, to be sent to somebody; and taking in what somebody sent.

The parcel is a zip of ``take.mcap`` and, where there are any, ``notes.json`` and ``track.npz``.
What it holds is checked before it enters the library, where it lies under its own subject and day;
nothing there is replaced.
"""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import zipfile
from datetime import datetime
from pathlib import Path

from handstudio.errors import TakeError
from handstudio.recording.library import new_take_path
from handstudio.recording.notes import load_notes, notes_path, save_notes
from handstudio.recording.take import Take, open_take
from handstudio.recording.take_track import track_path

SUFFIX = ".take.zip"
_TAKE, _NOTES, _TRACK = "take.mcap", "notes.json", "track.npz"


def pack(take: Take, target: Path) -> Path:
    """Write a take and its notes as one file; the take stays where it is.

    Raises:
        TakeError: it cannot be written.
    """
    fresh = target.with_name(target.name + ".new")
    notes = notes_path(take.path)
    try:
        with zipfile.ZipFile(fresh, "w", zipfile.ZIP_STORED) as parcel:  # it is compressed inside
            parcel.write(take.path, _TAKE)
            for beside, name in ((notes, _NOTES), (track_path(take.path), _TRACK)):
                if beside.exists():
                    parcel.write(beside, name)
        fresh.replace(target)
    except OSError as error:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Free some space or check the folder's permissions.",
            path=target,
            reason=error.strerror or error,
        ) from error
    return target


def take_in(file: Path, sessions: Path) -> Path:
    """Copy a take from elsewhere into the library.

    Args:
        file: A take, with its notes beside it where there are any, or a parcel.
        sessions: The library.

    Returns:
        Where it lies now.

    Raises:
        TakeError: it is neither, it is damaged, or the disk is full.
    """
    with tempfile.TemporaryDirectory(prefix="handstudio-") as place:
        path = Path(place) / _TAKE
        try:
            if zipfile.is_zipfile(file):
                _unpack(file, Path(place))
            else:
                shutil.copyfile(file, path)
                for place_of in (notes_path, track_path):
                    if place_of(file).exists():
                        shutil.copyfile(place_of(file), place_of(path))
            return _settle(path, _name_of(file), sessions)
        except (OSError, zipfile.BadZipFile) as error:
            raise TakeError(
                "{path}: cannot be read ({reason}).",
                "Copy it again from where it came; the copy may be cut short.",
                path=file,
                reason=getattr(error, "strerror", None) or error,
            ) from error


def _unpack(file: Path, place: Path) -> None:
    with zipfile.ZipFile(file) as parcel:
        held = set(parcel.namelist())
        if _TAKE not in held:
            raise TakeError(
                "{path}: a zip without a take in it.",
                "Choose a file that ends in .mcap or {suffix}.",
                path=file,
                suffix=SUFFIX,
            )
        take = place / _TAKE
        for name, path in ((_TAKE, take), (_NOTES, notes_path(take)), (_TRACK, track_path(take))):
            if name in held:
                with parcel.open(name) as source, path.open("wb") as copy:
                    shutil.copyfileobj(source, copy)


def _settle(path: Path, name: str, sessions: Path) -> Path:
    header = open_take(path).header
    notes = load_notes(path)
    day = datetime.fromtimestamp(header.start_utc_ns * 1e-9).astimezone()
    target = new_take_path(sessions, header.subject, name, day)
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = target.with_name(target.name + ".new")
    try:
        shutil.copyfile(path, fresh)
        fresh.replace(target)
    finally:
        fresh.unlink(missing_ok=True)
    if notes_path(path).exists():
        save_notes(target, notes)
    if track_path(path).exists():
        shutil.copyfile(track_path(path), track_path(target))
    return target


def _name_of(file: Path) -> str:
    return file.name.removesuffix(SUFFIX).removesuffix(".mcap").removesuffix(".zip")
