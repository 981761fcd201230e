"""The log: in files of bounded size, without anything private, and never in the way."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

from handstudio import log as logs
from handstudio.errors import TakeError
from handstudio.log import FILE, ScrubbingFilter, log_files, log_folder, logging_to
from handstudio.scrub import Scrubber

NAME = "Müller, Hans"
TOKEN = "four-years-of-work-in-one-word"
SESSIONS = Path("/srv/glove data/sessions")
ROOT = Path(__file__).parents[1]


@pytest.fixture
def scrubber() -> Scrubber:
    one = Scrubber(home=Path("/home/maria"))
    one.sessions(SESSIONS)
    one.names([NAME])
    one.tokens([TOKEN])
    return one


@pytest.fixture
def written(scrubber: Scrubber, tmp_path: Path) -> Callable[[Callable[[], object]], str]:
    """What stands in the log after something was done."""

    def during(done: Callable[[], object]) -> str:
        with logging_to(tmp_path / "log", scrubber) as log:
            assert log.problem == ""
            done()
        return (tmp_path / "log" / FILE).read_text("utf-8")

    return during


def fail_with(text: str) -> None:
    raise RuntimeError(text)


def test_a_line_says_when_who_and_how_bad(written) -> None:
    (line,) = written(lambda: logging.getLogger("app.x").info("%d bytes", 7)).splitlines()
    date, _, level, thread, name, words = line.split(maxsplit=5)
    assert date.count("-") == 2
    assert (level, thread, name, words) == ("INFO", "MainThread", "app.x:", "7 bytes")


def test_of_others_warnings_are_kept_and_talk_is_not(written) -> None:
    def talk() -> None:
        logging.getLogger("websockets.server").info("connection open")
        logging.getLogger("websockets.server").warning("strange handshake")
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn("a page closed", stacklevel=1)

    said = written(talk)
    assert "strange handshake" in said
    assert "a page closed" in said
    assert "connection open" not in said


HOSTILE = {
    "in the words": lambda log: log.warning(f"{NAME} at {SESSIONS}/x y/z.mcap, {TOKEN}"),
    "in the arguments": lambda log: log.warning("%s %r %s", NAME, NAME, {"token": TOKEN}),
    "in the name of a thread": lambda log: _in_thread(NAME, lambda: log.warning("here")),
    "in a stack": lambda log: log.warning("here", stack_info=True),
    "as the message itself": lambda log: log.warning(ValueError(NAME, TOKEN)),
    "over several lines": lambda log: log.warning(
        f"x\n2026-01-31 CRITICAL {NAME}\r\n{TOKEN}\x1b[2J"
    ),
    "in the home folder": lambda log: log.warning("/home/maria/x"),
}


class _Breaking:
    def __str__(self) -> str:
        raise RuntimeError(NAME)


def _in_thread(name: str, done: Callable[[], object]) -> None:
    thread = threading.Thread(target=done, name=name)
    thread.start()
    thread.join()


@pytest.mark.parametrize("how", HOSTILE)
def test_what_is_private_does_not_come_through(written, how: str, capfd) -> None:
    said = written(lambda: HOSTILE[how](logging.getLogger("app")))
    for secret in (NAME, "Hans", TOKEN, str(SESSIONS), "x y", "z.mcap", "maria", "\x1b"):
        assert secret not in said
    assert len([line for line in said.splitlines() if line[:2] == "20"]) == 1
    assert capfd.readouterr().err == ""  # and does not come out elsewhere


def test_half_a_letter_is_written(written) -> None:
    """Without pytest's own ears: what they heard could not travel between its processes."""
    root = logging.getLogger()
    ears = [handler for handler in root.handlers if type(handler).__module__.startswith("_pytest")]
    for ear in ears:
        root.removeHandler(ear)
    try:
        said = written(lambda: logging.getLogger("app").warning(f"\ud800 {NAME}"))
    finally:
        for ear in ears:
            root.addHandler(ear)
    assert NAME not in said
    assert len([line for line in said.splitlines() if line[:2] == "20"]) == 1


@pytest.mark.parametrize(("form", "value"), [("%d %d", NAME), ("%s", _Breaking())])
def test_what_cannot_be_put_in_words_is_not_put_in_words(scrubber, form: str, value) -> None:
    record = logging.LogRecord("app", logging.INFO, "x.py", 1, form, (value,), None)
    assert ScrubbingFilter(scrubber).filter(record)
    assert record.getMessage().startswith("(a record that cannot be put in words: ")
    assert NAME not in str(vars(record))


@pytest.mark.parametrize("chained", [False, True])
def test_nor_does_it_in_a_traceback(written, chained: bool) -> None:
    def fail() -> None:
        try:
            try:
                fail_with(f"{NAME} {TOKEN}")
            except RuntimeError as error:
                if not chained:
                    raise
                path = SESSIONS / NAME / "x.mcap"
                raise TakeError("{path}: is no take.", "Look.", path=path) from error
        except Exception as error:
            error.add_note(f"while recording {NAME}")
            logging.getLogger("app").exception("it failed")

    said = written(fail)
    assert "Traceback" in said
    assert "test_log.py" in said
    assert not any(secret in said for secret in (NAME, "Hans", TOKEN, str(SESSIONS)))


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_what_ends_a_thread_is_kept(written) -> None:
    said = written(lambda: _in_thread("capture", lambda: fail_with(f"lost {NAME}")))
    assert "the thread capture ends unexpectedly" in said
    assert "RuntimeError: lost [name]" in said


def test_what_ends_the_program_is_kept(scrubber: Scrubber, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=NAME), logging_to(tmp_path, scrubber):
        fail_with(NAME)
    said = (tmp_path / FILE).read_text("utf-8")
    assert "the program ends unexpectedly" in said
    assert "Traceback" in said
    assert NAME not in said


def test_an_expected_end_is_no_traceback(scrubber: Scrubber, tmp_path: Path) -> None:
    with pytest.raises(TakeError), logging_to(tmp_path, scrubber):
        raise TakeError("no port is free.", "Choose another.")
    said = (tmp_path / FILE).read_text("utf-8")
    assert "TakeError: no port is free." in said
    assert "Traceback" not in said


def test_everything_is_as_before_afterwards(written) -> None:
    root, hooks = logging.getLogger(), (sys.excepthook, threading.excepthook)
    before = (list(root.handlers), logging.getLogger("app").level, warnings.showwarning)
    written(lambda: None)
    assert before == (list(root.handlers), logging.getLogger("app").level, warnings.showwarning)
    assert hooks == (sys.excepthook, threading.excepthook)


def test_the_files_are_few_and_small(scrubber: Scrubber, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(logs, "BYTES", 2000)
    with logging_to(tmp_path, scrubber):
        for number in range(1000):
            logging.getLogger("app").info("line %d of many", number)
    files = log_files(tmp_path)
    assert [file.name for file in files] == [FILE, *(f"{FILE}.{n}" for n in range(1, 5))]
    assert set(files) == set(tmp_path.iterdir())
    assert all(file.stat().st_size <= 2000 for file in files)
    assert "line 999 of many" in files[0].read_text()


@pytest.mark.skipif(os.name != "posix", reason="modes of POSIX")
def test_the_files_are_for_oneself(scrubber: Scrubber, tmp_path: Path) -> None:
    with logging_to(tmp_path, scrubber):
        logging.getLogger("app").info("x")
    assert (tmp_path / FILE).stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("obstacle", ["file", "folder"])
def test_a_folder_that_cannot_be_written_is_told_and_no_obstacle(
    scrubber: Scrubber, tmp_path: Path, obstacle: str
) -> None:
    place = tmp_path / "log"
    if obstacle == "file":
        place.write_text("")
    else:
        (place / FILE).mkdir(parents=True)
    with logging_to(place, scrubber) as log:
        logging.getLogger("app").warning("nobody hears this")
    assert log.problem


def test_a_disk_that_fills_up_is_no_obstacle(scrubber: Scrubber, tmp_path: Path, capfd) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no disk that is always full here")
    (tmp_path / FILE).symlink_to("/dev/full")
    with logging_to(tmp_path, scrubber) as log:
        assert log.problem == ""
        for _ in range(3):
            logging.getLogger("app").warning("no room for this")
    assert capfd.readouterr().err == ""


def test_the_folder_may_be_chosen(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv(logs.FOLDER_VARIABLE, str(tmp_path))
    assert log_folder() == tmp_path
    monkeypatch.delenv(logs.FOLDER_VARIABLE)
    assert "handstudio" in str(log_folder())


def test_a_program_that_breaks_says_so_in_both_places(tmp_path: Path) -> None:
    program = (
        "from pathlib import Path\n"
        "from handstudio.log import logging_to\n"
        "from handstudio.scrub import Scrubber\n"
        f"with logging_to(Path({str(tmp_path)!r}), Scrubber()):\n"
        "    1 / 0\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "ZeroDivisionError" in done.stderr
    assert "ZeroDivisionError" in (tmp_path / FILE).read_text()
