"""Recovery: a file cut or damaged anywhere gives back what was whole before, or says it cannot."""

from __future__ import annotations

import random
import shutil
import struct
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from handstudio.errors import HandstudioError, TakeError
from handstudio.recording.notes import Mark, Notes, load_notes, save_notes
from handstudio.recording.recovery import recover
from handstudio.recording.take import FirstState, open_take
from handstudio.recording.writer import UNFINISHED, TakeWriter

MAGIC = 8
CHUNK, ATTACHMENT, METADATA = 0x06, 0x09, 0x0C


def boundaries(data: bytes) -> Iterator[tuple[int, int]]:
    """Where each record of a whole file begins, and what kind it is."""
    at = MAGIC
    while at < len(data) - MAGIC:
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield at, opcode
        at += 9 + length


@pytest.fixture
def whole(tmp_path, written) -> bytes:
    return written(tmp_path / "whole.mcap").read_bytes()


@pytest.fixture
def damaged(tmp_path):
    """``damaged(data)``: a fresh file of that content, what was recovered before taken away."""

    def write(data: bytes) -> Path:
        folder = tmp_path / "damaged"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        path = folder / f"squeeze.mcap{UNFINISHED}"
        path.write_bytes(data)
        return path

    return write


def flushed(whole: bytes, length: int) -> int:
    """How many chunks lie in the first ``length`` bytes with their end."""
    ends = [at + 9 + struct.unpack_from("<Q", whole, at + 1)[0] for at, _ in boundaries(whole)]
    kinds = [kind for _, kind in boundaries(whole)]
    return sum(kind == CHUNK and end <= length for kind, end in zip(kinds, ends, strict=True))


def test_boundaries_are_where_the_tests_think(whole, chunks):
    kinds = [kind for _, kind in boundaries(whole)]
    assert kinds.count(CHUNK) == len(chunks)
    assert kinds.index(METADATA) < kinds.index(ATTACHMENT) < kinds.index(CHUNK)


def test_cut_around_every_record_all_that_was_flushed_comes_back(whole, damaged, header, chunks):
    (begun,) = (
        at + 9 + struct.unpack_from("<Q", whole, at + 1)[0]
        for at, kind in boundaries(whole)
        if kind == ATTACHMENT
    )
    places = {at + near for at, _ in boundaries(whole) for near in (-1, 0, 1, 8, 9, 10, 60)}
    seen = set()
    for length in sorted(place for place in places if place <= len(whole)):
        path = damaged(whole[:length])
        if length < begun:
            said = "nothing of a take" if length else "before anything was recorded"
            with pytest.raises(TakeError, match=said):
                recover(path)
            continue
        got = recover(path)
        take = open_take(got.path)
        count = flushed(whole, length)
        assert list(take.chunks()) == chunks[:count], length
        assert (take.header, take.summary) == (header, None)
        assert take.first_state == FirstState(b"what the decoder knew", b"what the pipeline knew")
        assert (got.chunks, got.bytes) == (count, sum(len(data) for _, data in chunks[:count]))
        seen.add(count)
    assert seen == set(range(len(chunks) + 1))


def recovered_or_refused(path: Path, header, chunks) -> int | None:
    """How many chunks came back; what did is as it was written, or it was refused in words."""
    try:
        take = open_take(recover(path).path)
    except TakeError:
        return None
    back = list(take.chunks())
    assert back == chunks[: len(back)]
    assert take.header == header
    whole_state = FirstState(b"what the decoder knew", b"what the pipeline knew")
    assert take.first_state in (whole_state, FirstState())
    return len(back)


def opened_or_refused(path: Path, header, chunks) -> bool:
    """Whether the file was taken for whole; then everything in it is as it was written."""
    path = path.rename(path.with_name("squeeze.mcap"))
    try:
        take = open_take(path)
        back = list(take.chunks())
    except TakeError:
        return False
    assert (back, take.header) == (chunks, header)
    return True


def flip(whole: bytes, place: int, rng: random.Random) -> bytes:
    data = bytearray(whole)
    data[place] ^= 1 << rng.randrange(8)
    return bytes(data)


@pytest.mark.parametrize(
    "every", [pytest.param(1, marks=pytest.mark.long, id="every byte"), pytest.param(17, id="some")]
)
def test_no_flipped_bit_passes_for_what_was_recorded(whole, damaged, header, chunks, every):
    rng = random.Random(every)
    ends = [at for at, kind in boundaries(whole) if kind == CHUNK]
    refused = passed = 0
    for place in range(rng.randrange(every), len(whole), every):
        data = flip(whole, place, rng)
        back = recovered_or_refused(damaged(data), header, chunks)
        before = sum(end <= place for end in ends) - 1
        assert back is None or back >= min(before, len(chunks)), place
        if opened_or_refused(damaged(data), header, chunks):
            passed += 1
        else:
            refused += 1
    assert refused > 2 * passed > 0


@pytest.mark.parametrize("opcode", [CHUNK, ATTACHMENT, METADATA])
def test_a_record_that_vanishes_is_noticed(whole, damaged, header, chunks, opcode):
    """An opcode of another kind makes a reader of the container pass a record over."""
    for at, kind in boundaries(whole):
        if kind != opcode or at > max(a for a, k in boundaries(whole) if k == CHUNK):
            continue
        data = bytearray(whole)
        data[at] = 0x7F
        path = damaged(bytes(data))
        back = recovered_or_refused(path, header, chunks)
        if opcode == CHUNK:
            assert back == flushed(whole, at)
            assert not opened_or_refused(path, header, chunks)
        else:
            assert back is None


def test_a_length_beyond_all_bounds_is_damage_and_not_waited_for(whole, damaged, header, chunks):
    for at, kind in boundaries(whole):
        if kind == CHUNK:
            for length in (1 << 30, 1 << 62, (1 << 64) - 1):
                data = whole[: at + 1] + struct.pack("<Q", length) + whole[at + 9 :]
                assert recovered_or_refused(damaged(data), header, chunks) == flushed(whole, at)


def test_noise_is_refused(damaged):
    rng = random.Random(1)
    for size in (0, 1, 8, 100, 5000):
        path = damaged(rng.randbytes(size))
        with pytest.raises(TakeError):
            recover(path)
        assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_the_damaged_file_stays_and_the_recovered_one_is_not_overwritten(whole, damaged):
    path = damaged(whole[:-100])
    recovered = recover(path).path
    assert recovered.name == "squeeze-recovered.mcap"
    before = path.read_bytes(), recovered.read_bytes()
    with pytest.raises(TakeError, match="exists already"):
        recover(path)
    assert (path.read_bytes(), recovered.read_bytes()) == before


def test_a_whole_take_can_be_recovered_too(tmp_path, written, chunks):
    got = recover(written(tmp_path / "squeeze.mcap"))
    assert list(open_take(got.path).chunks()) == chunks
    assert got.duration_s == pytest.approx(0.3)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(TakeError, match=r"gone\.mcap: cannot be opened"):
        recover(tmp_path / "gone.mcap")


def test_a_take_of_a_newer_format_is_not_recovered_into_an_old_one(tmp_path, header, chunks):
    writer = TakeWriter(tmp_path / "new.mcap", msgspec.structs.replace(header, format=3))
    writer.write(*chunks[0])
    path = writer.close()
    with pytest.raises(TakeError, match="Update handstudio"):
        recover(path)


def test_where_there_is_no_room_for_the_recovered_take_one_can_try_again(
    whole, damaged, chunks, monkeypatch
):
    path = damaged(whole)
    with monkeypatch.context() as patch:
        patch.setattr(TakeWriter, "write", _full)
        with pytest.raises(HandstudioError, match="no room"):
            recover(path)
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]
    assert list(open_take(recover(path).path).chunks()) == chunks


def _full(*_: object) -> None:
    raise TakeError("no room", "make some")


def test_what_was_noted_while_it_was_recorded_is_with_the_recovered_take(tmp_path, header):
    path = tmp_path / "squeeze.mcap"
    writer = TakeWriter(path, header)
    save_notes(path, Notes((), "left hand", (Mark(0.1, "tremor"),)))
    writer.abandon()
    cut = path.with_name(path.name + UNFINISHED)
    assert load_notes(recover(cut).path) == load_notes(cut) == load_notes(path)
    assert load_notes(path).text == "left hand"
