"""Subject calibrations: the one in use, the one before, and every one there ever was.

``<sessions>/<code>/calibration.<side>.json`` and ``<sessions>/<code>/calibrations/<id>.json``. What
is in the history is never changed, and a damaged file never hides the last good one.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeAlias, TypeVar

from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration, decode, encode
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import HandSide
from handstudio.recording.atomic import BACKUP, write_atomically
from handstudio.recording.library import CALIBRATIONS, subject_folder
from handstudio.recording.naming import file_name, same_name

_Kind = TypeVar("_Kind", SubjectCalibration, DeviceCalibration)

_KEY = re.compile(r"\w[\w.+-]{0,79}")


@dataclass(frozen=True, slots=True)
class Loaded(Generic[_Kind]):
    """What is in use.

    Attributes:
        calibration: None: there never was one.
        problem: Why it is not the one that should be: that cannot be read.
    """

    calibration: _Kind | None
    problem: CalibrationError | None = None


@dataclass(frozen=True, slots=True)
class Version(Generic[_Kind]):
    """One of the history.

    Attributes:
        id: What `restore` asks for.
        calibration: None: its file cannot be read.
        problem: Why not.
    """

    id: str
    calibration: _Kind | None
    problem: CalibrationError | None = None


LoadedSubject: TypeAlias = Loaded[SubjectCalibration]
SubjectVersion: TypeAlias = Version[SubjectCalibration]


def new_id(now: datetime) -> str:
    """An id that no other calibration has unless it was made in the same millisecond."""
    utc = now.astimezone(UTC)
    return f"{utc:%Y%m%d-%H%M%S}-{utc.microsecond // 1000:03d}"


def save_calibration(sessions: Path, calibration: SubjectCalibration) -> Path:
    """Put a calibration in use, and in the history; the file in use.

    Raises:
        CalibrationError: another one has its id, it holds what cannot be read again, or it cannot
            be written; what was in use still is.
        TakeError: its subject's code leaves nothing to call a folder.
    """
    shelf = _shelf(sessions, calibration.subject, calibration.side)
    return shelf.keep(calibration.id, encode(calibration))


def load_calibration(sessions: Path, code: str, side: HandSide) -> LoadedSubject:
    """The calibration in use of a hand; the last good one, and why, where that cannot be read.

    Raises:
        CalibrationError: there are some, and each is broken, foreign or of a newer version.
        TakeError: the code leaves nothing to call a folder.
    """
    return _shelf(sessions, code, side).load()


def history(sessions: Path, code: str, side: HandSide) -> list[SubjectVersion]:
    """Every calibration of a hand, newest first; then those that cannot be read, of either hand.

    Raises:
        TakeError: the code leaves nothing to call a folder.
    """
    return _shelf(sessions, code, side).versions()


def restore(sessions: Path, code: str, id: str) -> SubjectCalibration:
    """Put a calibration of the history in use again; the one it is.

    Raises:
        CalibrationError: there is none of this id, or it cannot be read or written.
        TakeError: the code leaves nothing to call a folder.
    """
    found = _shelf(sessions, code, "right").version(id)
    return _shelf(sessions, code, found.side).use(id)


@dataclass(frozen=True, slots=True)
class Shelf(Generic[_Kind]):
    """A file with what is in use, and a folder with all there ever was.

    Attributes:
        current: The file.
        folder: The history, ``<id>.json``; others may keep theirs in it too.
        decode: Makes a calibration of a text and what to call it; raises CalibrationError.
        foreign: Why a calibration should not lie there at all; None: it should.
        ours: Whether it is one that this file may hold.
    """

    current: Path
    folder: Path
    decode: Callable[[bytes, Path], _Kind]
    foreign: Callable[[_Kind, Path], CalibrationError | None]
    ours: Callable[[_Kind], bool]

    def keep(self, id: str, data: bytes) -> Path:
        """Put something new in use, and in the history: both or neither.

        Raises:
            CalibrationError: something else has this id, it cannot be read again, or it cannot be
                written.
        """
        path = self._version(id)
        self.decode(data, self.current)  # numbers that are none are no JSON either
        with self._saying_what_to_do():
            known = path.exists()
            if known and path.read_bytes() != data:
                raise CalibrationError(
                    "There is another calibration {id} already.",
                    "Give this one another id: none is ever overwritten.",
                    id=id,
                )
            try:
                if not known:
                    write_atomically(path, data)
                self._write(data)
            except OSError:
                if not known:
                    _remove(path)
                raise
        return self.current

    def use(self, id: str) -> _Kind:
        """Put one of the history in use again.

        Raises:
            CalibrationError: there is none of this id, or it cannot be read or written.
        """
        found = self.version(id)
        with self._saying_what_to_do():
            self._write(self._version(id).read_bytes())
        return found

    def load(self) -> Loaded[_Kind]:
        """What is in use; the last good one where that cannot be read.

        Raises:
            CalibrationError: there is one, and neither it nor any before can be read.
        """
        problem: CalibrationError | None = None
        for path in (self.current, self.current.with_name(self.current.name + BACKUP)):
            try:
                found = self._opened(path)
            except FileNotFoundError:
                continue
            except CalibrationError as error:
                problem = problem or error
                continue
            whole = path == self.current
            return Loaded(found, None if whole else self._instead(problem, found))
        for version in self.versions():
            if version.calibration is not None:
                return Loaded(version.calibration, self._instead(problem, version.calibration))
        if problem is not None:
            raise problem
        return Loaded(None)

    def versions(self) -> list[Version[_Kind]]:
        """The history, newest first; then what cannot be read, whosoever it is."""
        good, bad = list[Version[_Kind]](), list[Version[_Kind]]()
        for path in sorted(_files(self.folder), reverse=True):
            try:
                found = self._read(path)
            except FileNotFoundError:
                continue
            except CalibrationError as error:
                bad.append(Version(path.stem, None, error))
                continue
            if self.ours(found):
                good.append(Version(path.stem, found))
        return sorted(good, key=_made, reverse=True) + bad

    def version(self, id: str) -> _Kind:
        """One of the history.

        Raises:
            CalibrationError: there is none of this id, or it cannot be read.
        """
        with contextlib.suppress(FileNotFoundError):
            if _KEY.fullmatch(id):
                return self._read(self._version(id))
        raise CalibrationError(
            "There is no calibration {id}.",
            "Choose one that there is: handstudio calibrations lists them.",
            id=id,
        )

    def _version(self, id: str) -> Path:
        if not _KEY.fullmatch(id):
            raise CalibrationError(
                "{id!r} cannot be the id of a calibration.",
                "Use letters, digits and - + . _ only, up to 80.",
                id=id,
            )
        return self.folder / f"{id}.json"

    def _write(self, data: bytes) -> None:
        with contextlib.suppress(FileNotFoundError):
            if self.current.read_bytes() == data:
                return  # the backup stays the one before
        write_atomically(self.current, data)

    def _opened(self, path: Path) -> _Kind:
        """What this file may hold; raises FileNotFoundError where there is none."""
        found = self._read(path)
        if not self.ours(found):
            raise CalibrationError(
                "{path}: is the calibration of the other hand.",
                "Restore the one of this hand (handstudio calibrations), or calibrate again.",
                path=path,
            )
        return found

    def _read(self, path: Path) -> _Kind:
        try:
            found = self.decode(path.read_bytes(), path)
        except FileNotFoundError:
            raise
        except (OSError, RecursionError) as error:
            raise CalibrationError(
                "{path}: the calibration cannot be read ({reason}).",
                "Check the file's permissions, restore another one, or calibrate again.",
                path=path,
                reason=getattr(error, "strerror", None) or error,
            ) from error
        foreign = self.foreign(found, path)
        if foreign is not None:
            raise foreign
        return found

    def _instead(self, problem: CalibrationError | None, used: _Kind) -> CalibrationError:
        if problem is None:
            return CalibrationError(
                "{path}: is gone. The calibration of {made} is used instead.",
                "Restore the one you want (handstudio calibrations), or calibrate again.",
                path=self.current,
                made=used.made_utc,
            )
        return CalibrationError(
            "{why} The calibration of {made} is used instead.",
            "Restore the one you want (handstudio calibrations), or calibrate again.",
            why=problem,
            made=used.made_utc,
        )

    @contextlib.contextmanager
    def _saying_what_to_do(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise CalibrationError(
                "{path}: cannot be written ({reason}).",
                "Free some space or check the folder's permissions. The calibration before is "
                "still in use.",
                path=self.current,
                reason=error.strerror or error,
            ) from error


def _shelf(sessions: Path, code: str, side: HandSide) -> Shelf[SubjectCalibration]:
    home = subject_folder(sessions, code)

    def foreign(calibration: SubjectCalibration, path: Path) -> CalibrationError | None:
        if same_name(file_name(calibration.subject, "subject"), home.name):
            return None
        return CalibrationError(
            "{path}: is a calibration of {other}, not of {code}.",
            "Restore one of this subject (handstudio calibrations), or calibrate again.",
            path=path,
            other=calibration.subject,
            code=home.name,
        )

    return Shelf(
        home / f"calibration.{side}.json",
        home / CALIBRATIONS,
        lambda data, path: decode(data, str(path)),
        foreign,
        lambda calibration: calibration.side == side,
    )


def _made(version: Version[_Kind]) -> tuple[str, str]:
    made = "" if version.calibration is None else version.calibration.made_utc
    return made, version.id


def _files(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if path.suffix == ".json"]
    except OSError:
        return []


def _remove(path: Path) -> None:
    for each in (path, path.with_name(path.name + ".new")):
        with contextlib.suppress(OSError):
            each.unlink(missing_ok=True)
