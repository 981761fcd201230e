"""Takes: what is written is read, nothing is overwritten, and what is no take says what it is."""

from __future__ import annotations

import hashlib
from pathlib import Path

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from handstudio.errors import TakeError
from handstudio.layout import glove
from handstudio.recording.header import (
    HEADER_RECORD,
    PROFILE,
    Header,
    Summary,
    encode_header,
)
from handstudio.recording.samples_message import decode_samples, encode_samples
from handstudio.recording.take import FirstState, open_take
from handstudio.recording.writer import FLUSH_S, UNFINISHED, TakeWriter
from handstudio.samples import ImuSamples
from handstudio.setup import Setup


def unfinished(path: Path) -> Path:
    return path.with_name(path.name + UNFINISHED)


# --- writing and reading ----------------------------------------------------------------------


def test_what_was_written_is_read(tmp_path, written, header, chunks):
    path = written(tmp_path / "S01" / "2026-01-02" / "squeeze.mcap")
    take = open_take(path)
    assert take.header == header
    assert take.first_state == FirstState(b"what the decoder knew", b"what the pipeline knew")
    assert list(take.chunks()) == chunks
    assert list(take.chunks()) == chunks  # as often as one likes
    assert take.summary == Summary(7, sum(len(data) for _, data in chunks), 0.35, packets=7)
    assert take.sha256() == hashlib.sha256(path.read_bytes()).hexdigest()


def test_any_reader_of_the_container_finds_the_same(tmp_path, written, chunks):
    with written(tmp_path / "squeeze.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        read = [(m.log_time, m.data) for _, _, m in reader.iter_messages(topics=["/wire"])]
        assert read == chunks
        assert reader.get_header().profile == "handstudio"
        assert {record.name for record in reader.iter_metadata()} == {
            "handstudio.take",
            "handstudio.summary",
        }


def test_a_take_of_nothing_is_a_take(tmp_path, header):
    path = TakeWriter(tmp_path / "nothing.mcap", header).close()
    take = open_take(path)
    assert list(take.chunks()) == []
    assert list(take.events()) == []
    assert take.first_state == FirstState()
    assert take.summary is None


def test_what_the_summary_says_was_written_is_what_was_written(tmp_path, header, chunks):
    writer = TakeWriter(tmp_path / "squeeze.mcap", header)
    for chunk in chunks[:3]:
        writer.write(*chunk)
    writer.close(Summary(chunks=999, bytes=1, duration_s=0.2, missing=5))
    summary = open_take(writer.path).summary
    assert (summary.chunks, summary.bytes) == (3, sum(len(data) for _, data in chunks[:3]))
    assert (summary.duration_s, summary.missing) == (0.2, 5)


def test_a_take_in_the_making_has_another_name_and_is_refused(tmp_path, header, chunks):
    path = tmp_path / "squeeze.mcap"
    writer = TakeWriter(path, header)
    writer.write(*chunks[0])
    assert not path.exists()
    with pytest.raises(TakeError, match=r"interrupted.*\n.*recover"):
        open_take(unfinished(path))
    writer.close()
    assert path.exists()
    assert not unfinished(path).exists()


def test_what_is_older_than_the_flush_interval_is_handed_over(tmp_path, header, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("handstudio.recording.writer.time.monotonic", lambda: now[0])
    writer = TakeWriter(tmp_path / "squeeze.mcap", header)
    file = unfinished(writer.path)
    empty = file.stat().st_size
    writer.write(0, b"a" * 100)
    assert file.stat().st_size == empty
    now[0] += FLUSH_S
    writer.write(1, b"b" * 100)
    assert file.stat().st_size > empty
    writer.abandon()


def test_a_file_has_its_beginning_whole_or_nothing(tmp_path, header, monkeypatch):
    seen = []
    beginning = TakeWriter.flush

    def flush(self):
        seen.append(file.stat().st_size)
        beginning(self)
        seen.append(file.stat().st_size)

    monkeypatch.setattr(TakeWriter, "flush", flush)
    file = unfinished(tmp_path / "squeeze.mcap")
    TakeWriter(tmp_path / "squeeze.mcap", header, b"s" * 300_000).abandon()
    assert seen[0] == 0
    assert seen[1] > 300_000


# --- never overwriting ------------------------------------------------------------------------


def test_a_take_is_never_overwritten(tmp_path, written, header):
    path = written(tmp_path / "squeeze.mcap")
    before = path.read_bytes()
    with pytest.raises(TakeError, match=r"exists already.*\n.*never overwritten"):
        TakeWriter(path, header)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["squeeze.mcap"]


def test_a_take_that_appeared_meanwhile_is_not_overwritten_either(tmp_path, header, chunks):
    path = tmp_path / "squeeze.mcap"
    writer = TakeWriter(path, header)
    writer.write(*chunks[0])
    path.write_bytes(b"of somebody else")
    with pytest.raises(TakeError, match="exists already"):
        writer.close()
    assert path.read_bytes() == b"of somebody else"
    assert unfinished(path).exists()


def test_an_interrupted_recording_is_not_overwritten(tmp_path, header, chunks):
    path = tmp_path / "squeeze.mcap"
    writer = TakeWriter(path, header)
    writer.write(*chunks[0])
    writer.flush()
    writer.abandon()
    before = unfinished(path).read_bytes()
    with pytest.raises(TakeError, match=r"interrupted recording.*\n.*handstudio recover"):
        TakeWriter(path, header)
    assert unfinished(path).read_bytes() == before


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path, header):
    (tmp_path / "S01").write_text("a file where a folder should be")
    with pytest.raises(TakeError, match=r"S01.*cannot be written.*\n.*permissions"):
        TakeWriter(tmp_path / "S01" / "squeeze.mcap", header)


# --- what is no take --------------------------------------------------------------------------


def mcap(path: Path, profile: str, metadata: dict[str, dict[str, str]]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile, "somebody else")
        for name, fields in metadata.items():
            writer.add_metadata(name, fields)
        channel = writer.register_channel("/imu", "json", 0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    return path


@pytest.mark.parametrize("content", [b"", b"\x89MC", b"time_s,a\n0,1\n", bytes(5000)])
def test_a_file_that_is_no_take_is_called_so(tmp_path, content):
    path = tmp_path / "photo.mcap"
    path.write_bytes(content)
    with pytest.raises(TakeError, match=r"photo\.mcap: not a take\.\n.*\.mcap"):
        open_take(path)


def test_a_file_that_is_not_there_and_a_folder_are_named(tmp_path):
    with pytest.raises(TakeError, match=r"gone\.mcap: cannot be opened \(No such file"):
        open_take(tmp_path / "gone.mcap")
    with pytest.raises(TakeError, match=r"cannot be opened"):
        open_take(tmp_path)


def test_a_recording_of_another_program_is_told_by_its_profile(tmp_path):
    path = mcap(tmp_path / "robot.mcap", "ros2", {})
    with pytest.raises(TakeError, match=r"profile 'ros2', not a take"):
        open_take(path)


def test_a_file_of_our_profile_without_a_header_is_no_take(tmp_path):
    path = mcap(tmp_path / "odd.mcap", PROFILE, {"something": {"json": "{}"}})
    with pytest.raises(TakeError, match="an MCAP file, but not a take"):
        open_take(path)


def test_a_take_of_a_newer_format_asks_for_an_update(tmp_path, header):
    newer = encode_header(msgspec.structs.replace(header, format=3), b"")
    path = mcap(tmp_path / "new.mcap", PROFILE, {HEADER_RECORD: newer})
    with pytest.raises(TakeError, match=r"format 3; this version reads up to 2\.\nUpdate"):
        open_take(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        '{"name": 5}',
        '{"type": "a filter of the future"}',
        "\N{SNOWMAN}",
    ],
)
def test_a_header_this_version_does_not_understand_is_refused(tmp_path, text):
    path = mcap(tmp_path / "odd.mcap", PROFILE, {HEADER_RECORD: {"json": text}})
    with pytest.raises(TakeError, match=r"odd\.mcap: the header.*cannot be read(?s:.*)update"):
        open_take(path)


def test_a_setup_that_names_an_unknown_filter_or_no_tree_is_refused(tmp_path, header):
    good = encode_header(header, b"")["json"]
    for wrong in (good.replace('"vqf"', '"crystal ball"'), good.replace('"SN11"', '"SN1"')):
        assert wrong != good
        path = mcap(tmp_path / "odd.mcap", PROFILE, {HEADER_RECORD: {"json": wrong}})
        with pytest.raises(TakeError, match=r"odd\.mcap: the header"):
            open_take(path)


def test_a_header_that_does_not_match_its_checksum_is_refused(tmp_path, header):
    record = encode_header(header, b"")
    record["json"] = record["json"].replace("S01", "S02")
    path = mcap(tmp_path / "odd.mcap", PROFILE, {HEADER_RECORD: record})
    with pytest.raises(TakeError, match=r"header.*checksum"):
        open_take(path)


def test_a_take_from_before_there_were_checksums_is_read(tmp_path, header):
    record = {"json": encode_header(header, b"")["json"]}
    path = mcap(tmp_path / "old.mcap", PROFILE, {HEADER_RECORD: record})
    assert open_take(path).header == header


def test_a_wire_take_that_does_not_name_its_decoder_says_so(tmp_path, header, chunks):
    setup = msgspec.structs.replace(header.setup, decoder=None)
    writer = TakeWriter(tmp_path / "t.mcap", msgspec.structs.replace(header, setup=setup))
    writer.write(*chunks[0])
    take = open_take(writer.close())
    with pytest.raises(TakeError, match=r"does not say which decoder"):
        list(take.events())


# --- imported samples -------------------------------------------------------------------------


def some_samples(n: int = 9, sensors: int = 2) -> ImuSamples:
    rng = np.random.default_rng(5)
    mag = rng.normal(size=(n, sensors, 3))
    mag[::2] = np.nan
    return ImuSamples(
        np.cumsum(rng.integers(1, 10_000, n)) - 5_000,
        rng.normal(size=(n, sensors, 3)),
        1e-300 * rng.normal(size=(n, sensors, 3)),
        mag,
        np.isfinite(mag).all(axis=-1),
        rng.random((n, sensors)) < 0.8,
        rng.random((n, sensors)) < 0.2,
    )


def test_samples_keep_every_bit(tmp_path):
    samples = some_samples()
    header = Header("t", "S", 10**18, Setup(glove("right", ["SN1", "SN11"]), 100.0), "samples", "f")
    writer = TakeWriter(tmp_path / "t.mcap", header)
    writer.write_samples(samples[:4], header.start_utc_ns)
    writer.write_samples(samples[4:], header.start_utc_ns)
    take = open_take(writer.close())
    assert list(take.events()) == [[samples[:4]], [samples[4:]]]
    assert [t for t, _ in take.chunks()] == [
        10**18 + 1000 * int(samples.time_us[k]) for k in (0, 4)
    ]


def test_a_message_of_another_length_than_it_says_is_refused():
    data = encode_samples(some_samples())
    assert decode_samples(data) == some_samples()
    for wrong in (b"", data[:7], data[:-1], data + b"\0"):
        with pytest.raises(ValueError, match=r"buffer|bytes"):
            decode_samples(wrong)
