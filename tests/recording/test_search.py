"""Finding takes: every word somewhere, in any script."""

from __future__ import annotations

import pytest

from handstudio.recording.library import entries
from handstudio.recording.notes import Label, Mark, Notes, save_notes
from handstudio.recording.search import search


@pytest.fixture
def listed(tmp_path, written):
    """Three takes; all were recorded on 2023-11-14 (UTC)."""
    for subject, visit, name, notes in (
        ("S01", "2026-03-04", "squeeze", Notes((Label(0.0, 1.0, "Index MCP"),), "Café, left")),
        ("S01", "After", "open", Notes((), "", (Mark(0.5, "tremor"),))),
        ("患者2", "初診", "握る", Notes((), "ﾋﾟﾝﾁ １回目")),
    ):
        path = written(tmp_path / subject / visit / f"{name}.mcap")
        save_notes(path, notes)
    return sorted(entries(tmp_path), key=lambda entry: entry.name)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("", ["open", "squeeze", "握る"]),
        (" \u3000", ["open", "squeeze", "握る"]),
        ("s01", ["open", "squeeze"]),
        ("S01 SQUEEZE", ["squeeze"]),
        ("squeeze open", []),
        ("mcp index", ["squeeze"]),
        ("tremor", ["open"]),
        ("cafe\u0301", ["squeeze"]),
        ("after", ["open"]),
        ("2026-03", ["squeeze"]),
        ("2023-11-1", ["open", "squeeze", "握る"]),
        ("患者\u3000ピンチ", ["握る"]),
        ("1回目", ["握る"]),
        ("ｓｑｕｅｅｚｅ", ["squeeze"]),
        ("nothing of the kind", []),
    ],
)
def test_takes_are_found_by_words(listed, text, names):
    assert [entry.name for entry in search(listed, text)] == names


def test_what_cannot_be_opened_is_found_by_its_name(tmp_path):
    broken = tmp_path / "S01" / "day" / "broken.mcap"
    broken.parent.mkdir(parents=True)
    broken.write_bytes(b"")
    assert [entry.path for entry in search(entries(tmp_path), "brok")] == [broken]
