"""The library from the person's side: finding, renaming, the bin, undo, subjects and notes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from app import intents
from app.state import HAND_LENGTH_MM, Shelf
from app.words import _
from handstudio.recording import bin as rubbish
from handstudio.recording import deletion, housekeeping, library, subjects
from handstudio.recording.naming import take_stem
from handstudio.recording.notes import Notes
from handstudio.recording.search import search
from handstudio.recording.subjects import Subject

_UNDO = 20  # changes that can be taken back


@dataclass
class Keeper:
    """Owner of the shelf: every change to the library from the page goes through here.

    All methods raise TakeError where something cannot be done; nothing is changed then.
    """

    sessions: Path
    shelf: Shelf = Shelf()
    _done: list[tuple[str, housekeeping.Undo]] = field(default_factory=list)

    def refresh(self) -> None:
        """Read the library again."""
        takes = tuple(library.entries(self.sessions, self.shelf.takes))
        known = tuple(known.subject for known in subjects.list_subjects(self.sessions))
        self.shelf = replace(
            self.shelf,
            takes=takes,
            found=tuple(search(takes, self.shelf.search)),
            subjects=known,
            undo=self._done[-1][0] if self._done else "",
            binned=tuple(rubbish.list_bin(self.sessions)),
        )

    def search(self, text: str) -> None:
        """Show only the takes in which these words occur."""
        found = tuple(search(self.shelf.takes, text))
        self.shelf = replace(self.shelf, search=text, found=found)

    def rename(self, path: Path, name: str) -> Path:
        """Call a take otherwise; where it is then."""
        undo = housekeeping.rename_take(self.sessions, path, name)
        self._remember(_("renaming of {name}").format(name=path.stem), undo)
        return undo.path

    def bin(self, path: Path) -> str:
        """Put a take in the bin; what to say."""
        name = take_stem(path)
        undo = rubbish.move_to_bin(self.sessions, path, datetime.now(UTC))
        self._remember(_("moving {name} to the bin").format(name=name), undo)
        return _("{name} is in the bin. Ctrl+Z takes it out again.").format(name=name)

    def undo(self) -> tuple[str, Path] | None:
        """Take the last change back; what to say, and the take it was about."""
        if not self._done:
            return None
        words, value = self._done[-1]
        path = housekeeping.undo(self.sessions, value)
        self._done.pop()
        self.refresh()
        return _("Taken back: {what}.").format(what=words), path

    def restore(self, key: str) -> str:
        """Take a take out of the bin; what to say."""
        path = rubbish.restore(self.sessions, key)
        self._done = [(w, v) for w, v in self._done if getattr(v, "key", None) != key]
        self.refresh()
        return _("{name} is back.").format(name=path.stem)

    def empty_bin(self) -> str:
        """Remove what is in the bin; what to say."""
        self._done = [
            (words, value) for words, value in self._done if not isinstance(value, rubbish.UndoBin)
        ]
        removed = rubbish.empty_bin(self.sessions, datetime.now(UTC))
        self.refresh()
        return _("{count} takes are gone for good.").format(count=removed)

    def write_notes(self, path: Path, notes: Notes) -> None:
        """Store the notes of a take."""
        undo = housekeeping.edit_notes(path, notes)
        self._remember(_("notes of {name}").format(name=path.stem), undo)

    def save_subject(self, typed: intents.SaveSubject) -> Subject:
        """A person as typed, new or known."""
        shortest, longest = HAND_LENGTH_MM
        length = min(max(typed.hand_length_mm, shortest), longest)
        side = typed.side if typed.side in ("left", "right") else ""
        known = {subject.code: subject for subject in self.shelf.subjects}
        code = typed.code.strip()
        if code in known:
            changed = Subject(code, side, length, known[code].note)  # type: ignore[arg-type]
            saved = subjects.save_subject(self.sessions, changed)
        else:
            new = Subject(code, side, length)  # type: ignore[arg-type]
            saved = subjects.create_subject(self.sessions, new)
        self.refresh()
        return saved

    def delete_subject(self, code: str, typed: str) -> str:
        """Remove a person with everything recorded; what to say."""
        removed = deletion.delete_subject(self.sessions, code, typed)
        self._done = []  # what could be taken back may be of this person
        self.refresh()
        words = _("{code} and {takes} takes are gone for good.")
        return words.format(code=code, takes=removed.takes)

    def _remember(self, words: str, value: housekeeping.Undo) -> None:
        self._done = [*self._done[-_UNDO + 1 :], (words, value)]
        self.refresh()
