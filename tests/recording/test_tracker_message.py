"""What a tracker told, in the file of a take: whole, cut anywhere, and in takes without one."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.recording.header import Summary, with_tracker
from handstudio.recording.recovery import recover
from handstudio.recording.take import open_take
from handstudio.recording.tracker_message import (
    Poses,
    TrackerFacts,
    decode_poses,
    encode_poses,
    joined,
)
from handstudio.recording.writer import UNFINISHED, TakeWriter

FACTS = TrackerFacts("lsl:room", "wrist", "SN4", (0.01, 0.0, 0.005))


def told(arrival_ns: int, count: int, seed: int = 0) -> Poses:
    rng = np.random.default_rng(seed)
    own = arrival_ns // 1000 - 4000 + 1000 * np.arange(count)
    arrival = np.full(count, arrival_ns)
    q, t = rng.normal(size=(count, 4)), rng.normal(size=(count, 3))
    t[0], q[0] = np.nan, np.nan
    return Poses(arrival, own, t, q, rng.random(count))


def same(a: Poses, b: Poses) -> None:
    for name in Poses.__slots__:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.fixture
def batches(chunks):
    return [told(at_ns + 1_000_000, k % 3 + 1, k) for k, (at_ns, _) in enumerate(chunks)]


@pytest.fixture
def writer(tmp_path, header, chunks, batches):
    writer = TakeWriter(tmp_path / "with.mcap", with_tracker(header, FACTS), b"")
    for chunk, poses in zip(chunks, batches, strict=True):
        writer.write(*chunk)
        writer.write_poses(poses)
        writer.flush()
    return writer


def test_a_message_comes_back_to_the_last_bit():
    poses = told(1_700_000_000_000_000_000, 3)
    same(decode_poses(1_700_000_000_000_000_000, encode_poses(poses)), poses)
    with pytest.raises(ValueError, match="bytes for 3 poses"):
        decode_poses(0, encode_poses(poses)[:-1])


def test_poses_and_bytes_of_a_take_do_not_mix(writer, chunks, batches):
    take = open_take(writer.close(Summary(0, 0, 0.35)))
    assert (take.header.format, take.header.tracker) == (2, FACTS)
    assert list(take.chunks()) == chunks
    same(take.poses(), joined(batches))
    assert take.summary.poses == len(take.poses())


def test_what_was_flushed_of_a_tracker_is_recovered(writer, chunks, batches, tmp_path):
    writer.abandon()
    unfinished = tmp_path / f"with.mcap{UNFINISHED}"
    unfinished.write_bytes(unfinished.read_bytes()[:-200])  # the last flush is cut
    take = open_take(recover(unfinished).path)
    assert list(take.chunks()) == chunks[:-1]
    same(take.poses(), joined(batches[:-1]))
    assert take.header.tracker == FACTS


def test_a_take_without_a_tracker_is_of_the_format_of_before(written, tmp_path):
    take = open_take(written(tmp_path / "bare.mcap"))
    assert take.header.format == 1
    assert len(take.poses()) == 0
