"""The log: what the studio did and what went wrong, in files that may be shown to a stranger.

It holds no subject codes, names of takes, notes, session paths or tokens: what is logged does not
say them, and a filter takes out what slipped in (`handstudio.scrub`).
"""

from __future__ import annotations

import contextlib
import logging
import logging.handlers
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from types import TracebackType

import platformdirs

from handstudio.errors import HandstudioError
from handstudio.scrub import Scrubber

FOLDER_VARIABLE = "HANDSTUDIO_LOG"
"""Environment variable with another folder for the log."""

FILE = "studio.log"
BYTES = 1_000_000
FILES = 5

_OURS = ("handstudio", "app")
_FORM = "%(asctime)s %(levelname)-7s %(threadName)s  %(name)s: %(message)s"
_CONTROL = {number: f"\\x{number:02x}" for number in (*range(9), *range(11, 32), 127)}


@dataclass(frozen=True, slots=True)
class Log:
    """A log that is being written.

    Attributes:
        folder: Where.
        problem: Why it cannot be written; empty when it can.
    """

    folder: Path
    problem: str = ""


def log_folder() -> Path:
    """Where the log is: the folder named in ``HANDSTUDIO_LOG``, else the user's own."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    return Path(chosen) if chosen else platformdirs.user_log_path("handstudio", appauthor=False)


def log_files(folder: Path) -> list[Path]:
    """The files of a log that there are, newest first."""
    names = [FILE, *(f"{FILE}.{number}" for number in range(1, FILES))]
    return [folder / name for name in names if (folder / name).is_file()]


@contextmanager
def logging_to(folder: Path, scrubber: Scrubber) -> Iterator[Log]:
    """Within this block: log to files there, also what ends a thread or the program.

    A folder that cannot be written is no reason not to work: it is told, and nothing is logged.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handler = _Handler(folder / FILE)
    except (OSError, ValueError) as error:
        yield Log(folder, getattr(error, "strerror", None) or str(error))
        return
    handler.addFilter(ScrubbingFilter(scrubber))
    with _hooked(handler), _unexpected_ends():
        yield Log(folder)


class ScrubbingFilter(logging.Filter):
    """Takes what is private out of a record, its traceback included; lets every record pass."""

    def __init__(self, scrubber: Scrubber) -> None:
        super().__init__()
        self._scrubber = scrubber

    def filter(self, record: logging.LogRecord) -> bool:
        """Put words without secrets in place of the record's own."""
        try:
            said = record.getMessage()
            trace = record.exc_text or ""
            if record.exc_info and record.exc_info[0] is not None:
                trace = logging.Formatter().formatException(record.exc_info)
            record.exc_text = self._scrubber.clean(trace) or None
            record.stack_info = self._scrubber.clean(record.stack_info or "") or None
            record.threadName = self._scrubber.clean(record.threadName or "")
            said = self._scrubber.clean(said)
        except Exception as error:  # whoever logs must not suffer from what is logged
            said = f"(a record that cannot be put in words: {type(error).__name__})"
            record.exc_text = record.stack_info = None
        record.exc_info = None
        record.msg, record.args = _on_one_line(said), None
        return True


class _Handler(logging.handlers.RotatingFileHandler):
    """Files for the person alone; a disk that is full or gone does not disturb."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, maxBytes=BYTES, backupCount=FILES - 1, encoding="utf-8", errors="backslashreplace"
        )
        self.setFormatter(logging.Formatter(_FORM))

    def _open(self) -> TextIOWrapper:
        def private(path: str, flags: int) -> int:
            return os.open(path, flags, 0o600)

        return open(
            self.baseFilename, "a", encoding=self.encoding, errors=self.errors, opener=private
        )

    def close(self) -> None:
        """Let go of the file; what it still held may be lost."""
        with contextlib.suppress(OSError):
            super().close()

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - its base's name
        """Go on: the log is the least of what is written."""


@contextmanager
def _hooked(handler: logging.Handler) -> Iterator[None]:
    """Warnings of everybody, and what we tell ourselves."""
    root = logging.getLogger()
    before = {name: logging.getLogger(name).level for name in _OURS}
    root.addHandler(handler)
    for name in _OURS:
        logging.getLogger(name).setLevel(logging.INFO)
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
        root.removeHandler(handler)
        handler.close()


@contextmanager
def _unexpected_ends() -> Iterator[None]:
    """Log what ends the program or a thread, and go on as before."""
    log = logging.getLogger(__name__)
    of_program, of_thread = sys.excepthook, threading.excepthook

    def program(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        log.critical("the program ends unexpectedly", exc_info=(kind, error, trace))
        of_program(kind, error, trace)

    def thread(ended: threading.ExceptHookArgs) -> None:
        name = ended.thread.name if ended.thread is not None else "?"
        if ended.exc_value is not None:
            info = (ended.exc_type, ended.exc_value, ended.exc_traceback)
            log.critical("the thread %s ends unexpectedly", name, exc_info=info)
        of_thread(ended)

    sys.excepthook, threading.excepthook = program, thread
    try:
        yield
    except HandstudioError as error:
        log.error("%s: %s", type(error).__name__, error.what)  # noqa: TRY400 - it is expected
        raise
    except Exception:
        log.critical("the program ends unexpectedly", exc_info=True)
        raise
    finally:
        with contextlib.suppress(Exception):
            sys.excepthook, threading.excepthook = of_program, of_thread


def _on_one_line(said: str) -> str:
    """A line of the log cannot be forged by a name with line ends in it."""
    return " | ".join(said.translate(_CONTROL).splitlines())
