"""A file to send to somebody who helps: what runs here and how it goes, and nothing of subjects."""

from __future__ import annotations

import io
import json
import os
import platform
import re
import shutil
import sys
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from serial.tools import list_ports

from handstudio import __version__
from handstudio.device.orders import Newest
from handstudio.log import log_files, log_folder
from handstudio.recording.bin import list_bin
from handstudio.recording.library import Entry
from handstudio.recording.notes import Notes
from handstudio.recording.subjects import list_subjects
from handstudio.scrub import Scrubber

LEFT_OUT = "[left out]"

_PRIVATE = re.compile(
    r"subject|take|visit|name|note|label|word|path|folder|file|session|token|search",
    re.IGNORECASE,
)
"""Settings called so are left out, whatever they hold but yes and no."""

_DAY = re.compile(r"\d{4}-\d{2}-\d{2}")
"""The name of most visits: a date is in every line of a log."""

_README = """\
What helps to find out why handstudio does not do what it should.

versions.json    handstudio, Python, packages and operating system
settings.json    settings of the studio
device.json      the device as it describes itself, the connection, and figures of the stream
ports.json       serial ports of the computer
disk.json        space on the disk that takes are written to
log/             what the studio did and what went wrong, newest in studio.log

No subject codes, names of takes, notes, recordings, folders of sessions or tokens are in it: they
were not written down, or were taken out ([name], [sessions], [take], [token], [left out]). All
files are plain text; look through them before you send them.

handstudio が正しく動かないときに、原因を調べるための資料です。
被験者コード、記録（テイク）の名前、メモ、記録データ、保存先のフォルダー、接続用の文字列は含まれません
（[name] などに置き換えてあります）。すべてテキストファイルですので、送る前に内容をご確認ください。
"""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a studio; texts may still hold what is private."""

    made_utc: datetime
    versions: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    device: Mapping[str, Any] = field(default_factory=dict)
    ports: tuple[Mapping[str, Any], ...] = ()
    disk: Mapping[str, Any] = field(default_factory=dict)
    log: Mapping[str, str] = field(default_factory=dict)  # name of the file to its text


def make(
    newest: Newest,
    *,
    settings: Mapping[str, Any],
    sessions: Path,
    takes: Iterable[Entry],
    names: Iterable[str] = (),
) -> bytes:
    """The zip of a studio; takes up to a few seconds where there are many takes.

    Args:
        newest: The newest of the capture; `Newest()` where there is none.
        settings: Settings of the studio by name; private ones are left out.
        sessions: Where takes live.
        takes: The library.
        names: Subjects and takes that are not in the library yet.
    """
    scrubber = Scrubber()
    scrubber.sessions(sessions)
    scrubber.names(names)
    recorder = newest.recorder
    if recorder is not None:
        scrubber.names((recorder.header.subject, recorder.header.name))
    learn_names(scrubber, takes)
    scrubber.names(_names_elsewhere(sessions))
    return bundle(collect(newest, settings, sessions, log_folder()), scrubber)


def bundle(facts: Facts, scrubber: Scrubber) -> bytes:
    """A zip of the facts, without what is private."""
    kept = _without_private(facts.settings)
    members = {
        "README.txt": _README,
        "versions.json": _json(facts.versions, scrubber),
        "settings.json": _json(kept, scrubber),
        "device.json": _json(facts.device, scrubber),
        "ports.json": _json(facts.ports, scrubber),
        "disk.json": _json(facts.disk, scrubber),
        **{f"log/{name}": scrubber.clean(text) for name, text in facts.log.items()},
    }
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zipped:
        for name, text in members.items():
            zipped.writestr(zipfile.ZipInfo(name, facts.made_utc.timetuple()[:6]), text.encode())
    return file.getvalue()


def collect(
    newest: Newest, settings: Mapping[str, Any], sessions: Path, folder_of_log: Path
) -> Facts:
    """Look at the machine and the studio; opens no port, and takes less than a second.

    Args:
        newest: The newest of the capture.
        settings: Settings of the studio by name.
        sessions: Where takes live.
        folder_of_log: Where the log is.
    """
    return Facts(
        made_utc=datetime.now(UTC),
        versions=_versions(),
        settings=settings,
        device=_device(newest),
        ports=_ports(),
        disk=_disk(sessions),
        log=_log(folder_of_log),
    )


def learn_names(scrubber: Scrubber, takes: Iterable[Entry]) -> None:
    """Let a scrubber know what may not be said: names of takes and subjects, words of notes."""
    names: set[str] = set()
    for entry in takes:
        names |= {entry.subject, entry.visit, entry.name, *_words_of(entry.notes)}
        if entry.take is not None:
            names |= {entry.take.header.subject, entry.take.header.name}
    scrubber.names(name for name in names if not _DAY.fullmatch(name))


def zip_name(now: datetime) -> str:
    """What such a file is called."""
    return f"handstudio-diagnostics-{now:%Y%m%d-%H%M%S}.zip"


def _words_of(notes: Notes) -> set[str]:
    labels, marks = (label.label for label in notes.labels), (mark.text for mark in notes.marks)
    return {notes.text, *labels, *marks}


def _names_elsewhere(sessions: Path) -> set[str]:
    """Subjects without takes, what is noted of subjects, and what lies in the bin."""
    names: set[str] = set()
    for known in list_subjects(sessions):
        names |= {known.subject.code, known.subject.note, *known.visits}
    for binned in list_bin(sessions):
        names |= {binned.subject, binned.visit, binned.name}
    return {name for name in names if not _DAY.fullmatch(name)}


def _without_private(settings: Mapping[str, Any]) -> dict[str, Any]:
    kept: dict[str, Any] = {}
    for name, value in settings.items():
        if isinstance(value, Mapping):
            kept[name] = _without_private(value)
        else:
            private = _PRIVATE.search(name) is not None and not isinstance(value, bool)
            kept[name] = LEFT_OUT if private else value
    return kept


def _json(value: object, scrubber: Scrubber) -> str:
    return json.dumps(scrubber.cleaned(value), indent=1, ensure_ascii=False, default=str) + "\n"


def _versions() -> dict[str, Any]:
    return {
        "handstudio": __version__,
        "python": sys.version.split()[0],
        "system": platform.platform(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "packages": _packages(),
    }


def _packages() -> dict[str, str]:
    try:
        wanted = [re.split(r"[^\w.-]", line)[0] for line in metadata.requires("handstudio") or []]
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        tops = {name.partition(".")[0] for name in sys.modules}
        known = metadata.packages_distributions()
        wanted = [name for top in tops for name in known.get(top, ())]
    found = {}
    for name in sorted(set(wanted)):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue  # of an extra that is not installed
    return found


def _device(newest: Newest) -> dict[str, Any]:
    problem = newest.problem
    return {
        "phase": newest.phase.value,
        "address": newest.address,
        "problem": None if problem is None else {"what": problem.what, "remedy": problem.remedy},
        "description": None if newest.description is None else asdict(newest.description),
        "health": asdict(newest.health) | {"loss_percent": newest.health.loss_percent},
        "recording": newest.recorder is not None,
    }


def _ports() -> tuple[dict[str, Any], ...]:
    try:
        ports = sorted(list_ports.comports(), key=lambda port: str(port.device))
    except OSError:
        return ()
    names = ("device", "vid", "pid", "description", "manufacturer", "product")
    return tuple({name: getattr(port, name) for name in names} for port in ports)


def _disk(sessions: Path) -> dict[str, Any]:
    for folder in (sessions.absolute(), *sessions.absolute().parents):
        try:
            usage = shutil.disk_usage(folder)
        except OSError:
            continue
        return {"there": folder == sessions.absolute(), "free": usage.free, "total": usage.total}
    return {}


def _log(folder: Path) -> dict[str, str]:
    found = {}
    for file in log_files(folder):
        try:
            found[file.name] = file.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            found[file.name] = f"cannot be read: {error.strerror}\n"
    return found
