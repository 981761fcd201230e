"""What the shell prints: tables and bars for a person, JSON for a program, errors that help."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from handstudio.errors import HandstudioError
from handstudio.process import Progress as ProgressCallback

# what is printed is what people named their folders: never markup
out = Console(highlight=False, soft_wrap=True, markup=False, emoji=False)
err = Console(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)


def print_json(value: Any) -> None:
    """One JSON document on standard output."""
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(value)).decode() + "\n")


def print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """A table for a person."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*row)
    out.print(table)


def print_error(error: HandstudioError) -> None:
    """What happened, and what to do next."""
    err.print(Text(error.what, style="bold red"))
    err.print(Text(error.remedy))


@contextmanager
def progress(words: str, quiet: bool = False) -> Iterator[ProgressCallback]:
    """A progress bar on standard error, where that is a terminal."""
    words_as_they_are = TextColumn("{task.description}", markup=False)
    columns = (words_as_they_are, BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, disable=quiet or not err.is_terminal) as bar:
        task = bar.add_task(words, total=1.0)
        yield lambda share: bar.update(task, completed=share)
