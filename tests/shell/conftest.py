"""The command itself, in a process of its own, as a person or a script runs it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest

from handstudio import shell
from handstudio.cli import main

WIDE = 400  # columns

_ALL_HELP = """
import contextlib, io, json
from handstudio.cli import COMMANDS, main
said = {}
for name in COMMANDS:
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stdout(out):
        try:
            main([name, "--help"])
        except SystemExit as ended:
            assert ended.code == 0
    out.flush()
    said[name] = out.buffer.getvalue().decode()
print(json.dumps(said))
"""

COMMAND = [sys.executable, "-c", "from handstudio.cli import main; main()"]
ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Said:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output, which must be one JSON document."""
        return msgspec.json.decode(self.out)


def _environment(**more: str) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "TTY_COMPATIBLE")}
    return kept | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8", "COLUMNS": "200"} | more


@pytest.fixture(scope="session")
def handstudio() -> Callable[..., Said]:
    """``handstudio("info", take, "--json")``: run to the end, with everything it said."""

    def run(*arguments: object, **more: Any) -> Said:
        done = subprocess.run(
            [*COMMAND, *(str(argument) for argument in arguments)],
            capture_output=True,
            encoding="utf-8",
            env=_environment(),
            timeout=120.0,
            check=False,
            **more,
        )
        assert "\x1b" not in done.stdout + done.stderr, "colour codes in a pipe"
        assert "Traceback" not in done.stderr, done.stderr
        return Said(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope="session")
def help_of() -> dict[str, str]:
    """What each command says to ``--help``; one process, for they are many."""
    done = subprocess.run(
        [sys.executable, "-c", _ALL_HELP],
        stdout=subprocess.PIPE,
        encoding="utf-8",
        env=_environment(),
        check=True,
    )
    return dict(msgspec.json.decode(done.stdout))


@pytest.fixture
def wide(monkeypatch) -> None:
    """A terminal in this process that folds no line, be the consoles made already or not."""
    for console in (shell.out, shell.err):
        monkeypatch.setattr(console, "width", WIDE)


@pytest.fixture
def here(capsys, wide) -> Callable[..., Said]:
    """The same within this process, which is there sooner: for what says little."""

    def run(*arguments: object) -> Said:
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return Said(ended.value.code, captured.out, captured.err)

    return run


@pytest.fixture
def begun() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """``begun("record", "virtual:")``: runs on its own, as in a terminal of its own."""
    processes: list[subprocess.Popen[str]] = []

    def begin(*arguments: object) -> subprocess.Popen[str]:
        processes.append(
            subprocess.Popen(
                [*COMMAND, *(str(argument) for argument in arguments)],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                env=_environment(),
                start_new_session=True,
            )
        )
        return processes[-1]

    yield begin
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def running() -> Callable[[str], list[str]]:
    """``running("a name")``: command lines of processes in which it stands."""

    def look(name: str) -> list[str]:
        found = []
        for process in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = process.read_bytes().decode(errors="replace").replace("\0", " ")
            except OSError:
                continue
            if re.search(rf"virtual_glove .*{re.escape(name)}", words):
                found.append(words)
        return found

    return look
