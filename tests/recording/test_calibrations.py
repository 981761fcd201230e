"""Calibrations of subjects and devices: kept with history, and never hidden by a broken file."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import msgspec
import pytest

from handstudio.calibration import device as device_text
from handstudio.calibration import subject as subject_text
from handstudio.calibration.device import UNITY, DeviceCalibration, Residuals, SensorErrors, Source
from handstudio.calibration.subject import Segment, SubjectCalibration
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.errors import CalibrationError, TakeError
from handstudio.recording import atomic
from handstudio.recording.calibrations import (
    history,
    load_calibration,
    new_id,
    restore,
    save_calibration,
)
from handstudio.recording.deletion import delete_subject, what_deleting_removes
from handstudio.recording.device_calibrations import (
    device_history,
    load_device_calibration,
    restore_device_calibration,
    save_device_calibration,
)
from handstudio.recording.library import entries, new_take_path
from handstudio.recording.subjects import Subject, create_subject, list_subjects, load_subject

NOW = datetime(2026, 3, 4, 12, 30, 5, 417_900, tzinfo=UTC)

DAMAGE = [b"", b"{", b"[]", b'{"format": 1}', b"\xff\xfe", b"[" * 100_000, b"four years of work"]

posix = pytest.mark.skipif(sys.platform == "win32", reason="limits and permissions of POSIX")


def subject_calibration(n: int = 1, side: str = "right", code: str = "S01") -> SubjectCalibration:
    now = NOW + timedelta(days=n)
    unit, here = (1.0, 0.0, 0.0, 0.0), (0.0, 0.01 * n, 0.0)
    segment = Segment(
        *("index_proximal", "SN15", unit, unit, here, (1e-3,) * 3),
        *(0.04, 1e-3, "measured", "measured", 0.1 * n),
    )
    return SubjectCalibration(
        *(new_id(now), now.isoformat(), "handstudio", code, side, 0.18, 3, "VG-1", (segment,), ()),
        verdicts=(Verdict("flat_hand", (Reading("time", 2.5, 2.0, "s"),)),),
        takes=(("course", "ab" * 32),),
    )


def device_calibration(n: int = 1, serial: str = "VG-1") -> DeviceCalibration:
    zero = (0.0, 0.0, 0.0)
    errors = SensorErrors("SN1", UNITY, (0.1 * n, 0.0, 0.0), UNITY, zero, Residuals(0.1, 0.01), 12)
    made = (NOW + timedelta(days=n)).isoformat()
    return DeviceCalibration(serial, made, "handstudio", (Source("tumble", "cd" * 32),), (errors,))


class Store:
    """The same functions of both kinds."""

    def __init__(self, sessions: Path, kind: str) -> None:
        self.sessions, self.kind = sessions, kind
        self.of_subject = kind == "subject"
        self.make = subject_calibration if self.of_subject else device_calibration

    def save(self, n: int):
        made = self.make(n)
        self.file = (save_calibration if self.of_subject else save_device_calibration)(
            self.sessions, made
        )
        return made

    def load(self):
        if self.of_subject:
            return load_calibration(self.sessions, "S01", "right")
        return load_device_calibration(self.sessions, "VG-1")

    def versions(self):
        if self.of_subject:
            return history(self.sessions, "S01", "right")
        return device_history(self.sessions, "VG-1")

    def restore(self, id: str):
        if self.of_subject:
            return restore(self.sessions, "S01", id)
        return restore_device_calibration(self.sessions, "VG-1", id)

    @property
    def backup(self) -> Path:
        return self.file.with_name(self.file.name + ".bak")

    def text(self, n: int, **other: object) -> bytes:
        """Another text of its kind, as it may have come from somewhere."""
        made = msgspec.structs.replace(self.make(n), **other)
        encoded = (subject_text if self.of_subject else device_text).encode(made)
        return encoded if isinstance(encoded, bytes) else encoded.encode()


@pytest.fixture(params=["subject", "device"])
def store(request, tmp_path) -> Store:
    return Store(tmp_path / "sessions", request.param)


def test_where_nobody_calibrated_there_is_none(store):
    loaded = store.load()
    assert (loaded.calibration, loaded.problem) == (None, None)
    assert store.versions() == []


def test_a_calibration_is_kept_and_every_one_stays_in_the_history(store):
    made = [store.save(n) for n in (1, 2, 3)]
    loaded = store.load()
    assert (loaded.calibration, loaded.problem) == (made[2], None)
    assert [version.calibration for version in store.versions()] == made[::-1]
    assert store.file.read_bytes() == store.text(3)  # a text that a person can read
    assert store.backup.read_bytes() == store.text(2)


def test_where_they_lie(tmp_path):
    file = save_calibration(tmp_path, subject_calibration())
    assert file == tmp_path / "S01" / "calibration.right.json"
    (kept,) = (tmp_path / "S01" / "calibrations").iterdir()
    assert kept.name == "20260305-123005-417.json"
    file = save_device_calibration(tmp_path, device_calibration())
    assert file == tmp_path / ".devices" / "VG-1.json"
    (kept,) = (tmp_path / ".devices" / "VG-1").iterdir()
    assert kept.name == "20260305-123005-417.json"


def test_an_id_is_of_utc():
    assert new_id(NOW) == new_id(NOW.astimezone(timezone(timedelta(hours=9))))
    assert new_id(NOW) < new_id(NOW + timedelta(milliseconds=1))


def test_an_older_one_is_restored_and_the_history_stays(store):
    made = [store.save(n) for n in (1, 2, 3)]
    oldest = store.versions()[-1].id
    assert store.restore(oldest) == made[0]
    assert store.load().calibration == made[0]
    assert [version.calibration for version in store.versions()] == made[::-1]
    assert store.restore(oldest) == made[0]
    assert store.backup.read_bytes() == store.text(3)  # still the one before


@pytest.mark.parametrize(
    "id", ["", "no-such", "../calibration.right", "..", "a/b", "a\0b", "x" * 99]
)
def test_what_is_not_in_the_history_is_not_restored(store, id):
    made = store.save(1)
    with pytest.raises(CalibrationError, match=r"There is no calibration .*\n.*lists them"):
        store.restore(id)
    assert store.load().calibration == made


def test_the_same_again_changes_nothing_and_another_of_that_id_is_refused(store, content):
    store.save(1)
    store.save(2)
    before = content(store.sessions)
    store.save(2)
    assert content(store.sessions) == before
    other = msgspec.structs.replace(store.make(2), software="another")
    with pytest.raises(CalibrationError, match=r"another calibration .* already"):
        (save_calibration if store.of_subject else save_device_calibration)(store.sessions, other)
    assert content(store.sessions) == before


@pytest.mark.parametrize("damage", DAMAGE, ids=range(len(DAMAGE)))
def test_a_broken_file_has_the_one_before_and_then_the_history(store, damage):
    made = [store.save(n) for n in (1, 2, 3)]
    store.file.write_bytes(damage)
    loaded = store.load()
    assert loaded.calibration == made[1]  # the backup
    assert str(store.file) in loaded.problem.what
    assert made[1].made_utc in loaded.problem.what
    assert "calibrate again" in loaded.problem.remedy
    store.backup.write_bytes(damage)
    assert store.load().calibration == made[2]  # the newest of the history
    newest = store.versions()[0].id
    (path,) = store.sessions.rglob(f"{newest}.json")
    path.write_bytes(damage)
    assert store.load().calibration == made[1]
    versions = store.versions()
    assert [version.calibration for version in versions] == [made[1], made[0], None]
    assert str(path) in versions[2].problem.what
    with pytest.raises(CalibrationError, match=newest):
        store.restore(newest)
    again = store.save(4)
    assert (store.load().calibration, store.load().problem) == (again, None)


def test_where_none_is_left_it_is_said(store):
    store.save(1)
    for path in store.sessions.rglob("*.json"):
        path.write_bytes(b"{")
    with pytest.raises(CalibrationError, match="again") as caught:
        store.load()
    assert str(store.file) in caught.value.what


def test_a_file_of_a_newer_version_is_left_and_the_one_before_is_used(store):
    made = store.save(1)
    newer = store.text(2, format=99).replace(b'"device"', b'"unheard of": 1, "device"')
    store.file.write_bytes(newer)
    loaded = store.load()
    assert loaded.calibration == made
    assert "99" in loaded.problem.what
    assert store.file.read_bytes() == newer


def test_a_file_that_is_gone_is_said_and_the_newest_is_used(store):
    made = [store.save(n) for n in (1, 2)]
    store.file.unlink()
    assert store.load().calibration == made[0]
    store.backup.unlink()
    loaded = store.load()
    assert loaded.calibration == made[1]
    assert "is gone" in loaded.problem.what


def test_a_file_of_somebody_else_is_not_used(store):
    made = store.save(1)
    foreign = {"subject": "S02"} if store.of_subject else {"device": "VG-2"}
    store.file.write_bytes(store.text(2, **foreign))
    loaded = store.load()
    assert loaded.calibration == made
    assert next(iter(foreign.values())) in loaded.problem.what


def test_the_two_hands_do_not_mix(tmp_path):
    right, left = subject_calibration(1), subject_calibration(2, "left")
    save_calibration(tmp_path, right)
    assert load_calibration(tmp_path, "S01", "left").calibration is None
    file = save_calibration(tmp_path, left)
    assert load_calibration(tmp_path, "S01", "right").calibration == right
    assert [version.calibration for version in history(tmp_path, "S01", "left")] == [left]
    assert restore(tmp_path, "S01", right.id) == right
    assert load_calibration(tmp_path, "S01", "left").calibration == left
    file.write_bytes(subject_text.encode(right))
    loaded = load_calibration(tmp_path, "S01", "left")
    assert loaded.calibration == left
    assert "other hand" in loaded.problem.what


def test_a_broken_one_of_the_other_hand_does_not_stand_in_the_way(tmp_path):
    save_calibration(tmp_path, subject_calibration(1))
    for path in tmp_path.rglob("*.json"):
        path.write_bytes(b"{")
    assert load_calibration(tmp_path, "S01", "left").calibration is None


def test_a_code_is_found_however_it_is_written(tmp_path):
    create_subject(tmp_path, Subject("S01"))
    made = subject_calibration(code="s01")
    assert save_calibration(tmp_path, made).parent.name == "S01"
    assert load_calibration(tmp_path, " S01", "right").calibration == made
    with pytest.raises(TakeError, match="no name"):
        load_calibration(tmp_path, "..", "right")


def test_what_could_not_be_read_again_is_not_kept(tmp_path):
    made = subject_calibration(1)
    save_calibration(tmp_path, made)
    wrong = msgspec.structs.replace(subject_calibration(2), hand_length_m=float("nan"))
    with pytest.raises(CalibrationError, match="not a subject calibration"):
        save_calibration(tmp_path, wrong)
    assert [version.calibration for version in history(tmp_path, "S01", "right")] == [made]


@pytest.mark.parametrize("serial", ["VG/1", "../x", "手袋 7", "VG-1.", "CON", "a" * 200, ".x"])
def test_a_serial_number_that_is_no_file_name_is_kept_all_the_same(tmp_path, serial):
    made, other = device_calibration(1, serial), device_calibration(1, f"{serial} ")
    file = save_device_calibration(tmp_path, made)
    assert file.parent == tmp_path / ".devices"
    assert save_device_calibration(tmp_path, other) != file
    assert load_device_calibration(tmp_path, serial).calibration == made
    assert [each.calibration for each in device_history(tmp_path, serial)] == [made]


def test_a_device_without_a_number_or_a_day_is_refused(tmp_path):
    with pytest.raises(CalibrationError, match="no serial number"):
        save_device_calibration(tmp_path, device_calibration(1, " "))
    with pytest.raises(CalibrationError, match="when it was made"):
        save_device_calibration(
            tmp_path, msgspec.structs.replace(device_calibration(), made_utc="")
        )
    assert list(tmp_path.iterdir()) == []


# --- full disks -----------------------------------------------------------------------------------


@posix
def test_a_disk_that_is_full_leaves_the_one_before(store, content, limit_of_file_size):
    made = store.save(1)
    before = content(store.sessions)
    with (
        limit_of_file_size(200),
        pytest.raises(CalibrationError, match=r"cannot be written.*\nFree some space"),
    ):
        store.save(2)
    assert content(store.sessions) == before
    assert (store.load().calibration, store.load().problem) == (made, None)
    assert store.save(2) == store.load().calibration


def test_a_disk_that_fails_anywhere_leaves_all_or_nothing(store, tripwire):
    made = store.save(1)
    for passes in range(10):
        with tripwire(passes, OSError(28, "No space left on device")) as wire:
            try:
                new = store.save(2)
            except CalibrationError:
                assert store.load().calibration == made
                continue
        assert not wire.tripped
        break
    assert passes >= 2
    assert store.load().calibration == new
    assert [version.calibration for version in store.versions()] == [new, made]


@pytest.mark.parametrize("write", [1, 2])
def test_a_crash_in_the_middle_of_saving_leaves_a_calibration(store, monkeypatch, write):
    made = store.save(1)
    count = 0
    real = os.fsync

    def crash(number: int) -> None:
        nonlocal count
        count += 1
        if count == write:
            raise KeyboardInterrupt
        real(number)

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "fsync", crash)
        with pytest.raises(KeyboardInterrupt):
            store.save(2)
    assert (store.load().calibration, store.load().problem) == (made, None)
    assert store.save(2) == store.load().calibration


@posix
def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "S01").write_text("four years of work")
    (tmp_path / ".devices").write_text("four years of work")
    for save, made in (
        (save_calibration, subject_calibration()),
        (save_device_calibration, device_calibration()),
    ):
        with pytest.raises(CalibrationError, match=r"cannot be written.*\n.*permissions"):
            save(tmp_path, made)


# --- subjects, visits, the library ----------------------------------------------------------------


def test_calibrations_are_no_visit_and_no_take(tmp_path, written: Callable[[Path], Path]):
    path = written(new_take_path(tmp_path, "S01", "squeeze", NOW))
    save_calibration(tmp_path, subject_calibration())
    save_device_calibration(tmp_path, device_calibration())
    (known,) = list_subjects(tmp_path)
    assert known.visits == ("2026-03-04",)
    assert load_subject(tmp_path, "S01") == Subject("S01")
    assert [entry.path for entry in entries(tmp_path)] == [path]
    assert what_deleting_removes(tmp_path, "S01").visits == 1


@pytest.mark.parametrize("visit", ["calibrations", "Calibrations", " CALIBRATIONS "])
def test_no_visit_can_be_called_so(tmp_path, visit):
    with pytest.raises(TakeError, match=r"No visit can be called.*\nGive the visit another name"):
        new_take_path(tmp_path, "S01", "squeeze", NOW, visit)


def test_deleting_a_subject_deletes_its_calibrations_and_no_other(tmp_path, content):
    for code in ("S01", "S02"):
        for n in (1, 2):
            save_calibration(tmp_path, subject_calibration(n, code=code))
    save_device_calibration(tmp_path, device_calibration())
    before = content(tmp_path)
    told = what_deleting_removes(tmp_path, "S01")
    ours = [data for name, data in before.items() if name.startswith("S01/") and data is not None]
    assert (len(ours), told.bytes) == (4, sum(map(len, ours)))
    delete_subject(tmp_path, "S01", "S01")
    assert content(tmp_path) == {
        name: data for name, data in before.items() if Path(name).parts[0] != "S01"
    }
