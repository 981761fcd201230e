"""Processing: one result however it is come by, kept beside the take, and mended where damaged."""

from __future__ import annotations

import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from handstudio import pipeline
from handstudio import process as process_module
from handstudio.errors import SetupError, TakeError
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.layout import Layout, SensorPlace, glove
from handstudio.pipeline import Doubt, Motion
from handstudio.process import kept_motion, process
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import ImuPacket
from handstudio.recording import take as take_module
from handstudio.recording.header import Header, Summary
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import FirstState, Take, open_take, pack_first_state
from handstudio.recording.writer import TakeWriter
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.setup import Setup
from handstudio.stream import EventStream


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """Three seconds of a virtual glove."""
    return simulate(tmp_path_factory.mktemp("recorded"), rehearse(seed=3), seconds=3.0)


@pytest.fixture
def take(recorded, tmp_path) -> Take:
    """The same, with nothing computed yet."""
    return open_take(Path(shutil.copy(recorded, tmp_path / "showcase.mcap")))


def same(a: Motion, b: Motion) -> None:
    for name in Motion.__slots__:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)


def at_once(take: Take, setup: Setup | None = None) -> Motion:
    """All events in one go, as no program would do it."""
    setup = setup or take.header.setup
    events = [event for events in take.events() for event in events]
    return pipeline.run(setup, pipeline.begin(setup), events)[0]


def no_more(*_: object, **__: object) -> None:
    raise AssertionError("it was computed again")


def cache_of(take: Take) -> Path:
    (folder,) = take.path.with_suffix(".motion").iterdir()
    return folder


# --- one result -------------------------------------------------------------------------------


def test_a_processed_take_is_its_events_through_the_pipeline(take):
    same(process(take), at_once(take))


def test_a_take_with_losses_and_a_restart_is_its_events_too(take, tmp_path):
    chunks = list(take.chunks())
    writer = TakeWriter(tmp_path / "lossy.mcap", take.header)
    for k, chunk in enumerate(chunks):
        if k not in (7, 20, 21, 26):
            writer.write(*chunk)
    for arrival_ns, chunk in chunks[:5]:
        packets = [p for p in V1Decoder().feed(chunk) if isinstance(p, ImuPacket)]
        anew = b"".join(encode(replace(packet, epoch=packet.epoch + 1)) for packet in packets)
        writer.write(arrival_ns + 5_000_000_000, anew)
    lossy = open_take(writer.close())
    motion = process(lossy)
    same(motion, at_once(lossy))
    assert (np.diff(motion.time_us) > 0).all()
    assert (motion.doubt & Doubt.AFTER_GAP).any(axis=1).sum() == 3
    assert (np.diff(motion.time_us) > 1_000_000).sum() == 1  # of silence


def test_what_was_computed_once_is_found_and_not_computed_again(take, monkeypatch):
    assert kept_motion(take) is None
    first = process(take)
    monkeypatch.setattr(pipeline, "run", no_more)
    same(process(take), first)
    same(kept_motion(take), first)
    same(process(open_take(take.path)), first)


def test_a_computed_motion_cannot_be_written_to(take):
    with pytest.raises(ValueError, match="read-only"):
        process(take).q_world_sensor[0] = 0.0


def test_another_setup_is_another_motion_beside_the_first(take):
    first = process(take)
    setup = msgspec.structs.replace(take.header.setup, filter=VqfFilter(tau_acc_s=0.5))
    other = process(take, setup)
    same(other, at_once(take, setup))
    assert np.any(other.q_world_sensor != first.q_world_sensor)
    same(process(take), first)
    assert len(list(take.path.with_suffix(".motion").iterdir())) == 2
    same(kept_motion(take), first)


def test_a_setup_of_other_sensors_is_refused(take):
    setup = msgspec.structs.replace(take.header.setup, layout=glove("right", ["SN1"]))
    with pytest.raises(SetupError, match=r"has 1 sensors, the take 20.*\n.*sensors of the take"):
        process(take, setup)


# --- where a take begins ----------------------------------------------------------------------


@pytest.fixture
def continued(take, tmp_path) -> tuple[Take, Motion]:
    """A recording that began while the glove was streaming, and what was seen live of it."""
    setup = take.header.setup
    stream, state = EventStream(setup.decoder, setup.ranges), pipeline.begin(setup)
    chunks = list(take.chunks())
    for arrival_ns, chunk in chunks[:30]:
        _, state = pipeline.run(setup, state, stream.feed(chunk[:-7], arrival_ns)[1])
        _, state = pipeline.run(setup, state, stream.feed(chunk[-7:], arrival_ns)[1])
    # the take begins within a frame
    stream.feed(chunks[30][1][:50], chunks[30][0])
    first = FirstState(stream.save(), pipeline.pack(setup, state))
    header = msgspec.structs.replace(take.header, name="later")
    writer = TakeWriter(tmp_path / "later.mcap", header, pack_first_state(first))
    live = []
    for k, (arrival_ns, chunk) in enumerate(chunks[30:]):
        rest = chunk[50:] if k == 0 else chunk
        writer.write(arrival_ns, rest)
        motion, state = pipeline.run(setup, state, stream.feed(rest, arrival_ns)[1])
        live.append(motion)
    return open_take(writer.close()), pipeline.join(live)


def test_from_its_first_state_a_take_gives_what_was_seen_live(continued):
    later, live = continued
    same(process(later), live)
    assert not (live.doubt[0] & Doubt.UNPLACED).any()


def test_from_the_start_a_take_knows_nothing_of_what_was_before(continued):
    later, live = continued
    motion = process(later, from_start=True)
    assert (motion.doubt[0] & Doubt.UNPLACED).all()
    assert np.isnan(motion.q_world_start[0]).all()
    assert len(motion) in (len(live), len(live) - 1)  # the instant whose frame was cut
    same(process(later), live)


def test_another_setup_cannot_go_on_from_a_state_it_never_had(continued):
    later, _ = continued
    setup = msgspec.structs.replace(later.header.setup, filter=VqfFilter(tau_acc_s=0.5))
    same(process(later, setup), process(later, setup, from_start=True))


def test_a_first_state_of_another_version_says_how_to_go_on(take, tmp_path):
    first = pack_first_state(FirstState(b"", b"of the future"))
    writer = TakeWriter(tmp_path / "odd.mcap", take.header, first)
    for chunk in take.chunks():
        writer.write(*chunk)
    odd = open_take(writer.close())
    with pytest.raises(SetupError, match="--from-start"):
        process(odd)
    same(process(odd, from_start=True), process(take))


# --- damage -----------------------------------------------------------------------------------


def shorten(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def lengthen(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


DAMAGE = {
    "an array is short": lambda folder: shorten(folder / "q_world_sensor"),
    "an array is long": lambda folder: lengthen(folder / "doubt"),
    "an array is gone": lambda folder: (folder / "time_us").unlink(),
    "an array is empty": lambda folder: (folder / "q_world_start").write_bytes(b""),
    "the description is gone": lambda folder: (folder / "meta.json").unlink(),
    "the description is cut": lambda folder: shorten(folder / "meta.json"),
    "the description is empty": lambda folder: (folder / "meta.json").write_bytes(b""),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_result_is_computed_again(take, damage):
    expected = at_once(take)
    process(take)
    DAMAGE[damage](cache_of(take))
    assert kept_motion(take) is None
    same(process(take), expected)
    same(kept_motion(take), expected)
    assert len(list(take.path.with_suffix(".motion").iterdir())) == 1


def test_a_damaged_take_is_refused_and_no_part_of_it_kept(take):
    data = bytearray(take.path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    take.path.write_bytes(data)
    with pytest.raises(TakeError, match=r"damaged.*\n.*handstudio recover"):
        process(take)
    assert kept_motion(take) is None
    assert list(take.path.with_suffix(".motion").iterdir()) == []


def test_who_is_interrupted_leaves_nothing_behind_and_can_begin_again(take):
    def interrupt(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        process(take, progress=interrupt)
    assert list(take.path.with_suffix(".motion").iterdir()) == []
    same(process(take), at_once(take))


def test_who_was_slower_finds_the_others_result(take, monkeypatch):
    expected = at_once(take)
    compute = process_module._fill

    def meanwhile(*args: object) -> None:
        monkeypatch.setattr(process_module, "_fill", compute)
        process(take)
        compute(*args)

    monkeypatch.setattr(process_module, "_fill", meanwhile)
    same(process(take), expected)
    assert len(list(take.path.with_suffix(".motion").iterdir())) == 1


def test_where_the_result_cannot_be_kept_it_says_so(take):
    take.path.with_suffix(".motion").write_text("a file where a folder should be")
    with pytest.raises(TakeError, match=r"cannot be kept.*\n.*permissions"):
        process(take)


def test_a_take_of_nothing_is_a_motion_of_nothing(take, tmp_path):
    nothing = open_take(TakeWriter(tmp_path / "nothing.mcap", take.header).close())
    motion = process(nothing)
    assert len(motion) == 0
    assert motion.q_world_sensor.shape == (0, 20, 4)
    same(kept_motion(nothing), motion)


# --- long takes -------------------------------------------------------------------------------


def resting(n: int, first: int) -> ImuSamples:
    flags = np.ones((n, 1), dtype=bool)
    acc = np.tile([0.0, 0.0, STANDARD_GRAVITY], (n, 1, 1))
    return ImuSamples(
        (first + np.arange(n)) * 10_000,
        np.zeros((n, 1, 3)),
        acc,
        np.full((n, 1, 3), np.nan),
        ~flags,
        flags,
        ~flags,
    )


def long_take(path: Path, instants: int, block: int = 1000) -> Take:
    setup = Setup(Layout("unknown", (SensorPlace("IMU", "body"),), ()), 100.0)
    writer = TakeWriter(path, Header("long", "S", 10**18, setup, "samples", "made here"))
    for first in range(0, instants, block):
        writer.write_samples(resting(block, first), 10**18)
    return open_take(writer.close(Summary(0, 0, instants / 100.0)))


def peak_bytes(take: Take) -> int:
    tracemalloc.start()
    process(take)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_memory_does_not_grow_with_the_length_of_a_take(tmp_path):
    process(long_take(tmp_path / "first.mcap", 1_000))  # whatever is loaded only once
    short = peak_bytes(long_take(tmp_path / "short.mcap", 20_000))
    long = peak_bytes(long_take(tmp_path / "long.mcap", 200_000))
    result = 200_000 * (8 + 32 + 32 + 1)
    assert long < 1.2 * short
    assert short < result / 4  # or the comparison says nothing


@pytest.mark.parametrize("kind", ["wire", "samples"])
def test_progress_goes_steadily_from_nothing_to_all(kind, take, tmp_path, monkeypatch):
    monkeypatch.setattr(process_module, "_BATCH", 25)
    monkeypatch.setattr(take_module, "_CHUNKS", 1)
    told: list[float] = []
    one = take if kind == "wire" else long_take(tmp_path / "long.mcap", 10_000)
    process(one, progress=told.append)
    assert told[-1] == 1.0
    steps = np.diff([0.0, *told])
    assert (steps >= 0.0).all()
    assert len(steps) >= 10
    assert steps.max() < 0.3


def test_equal_motions_are_equal_however_short_the_batches(take, monkeypatch):
    expected = at_once(take)
    for batch in (1, 7, 100_000):
        monkeypatch.setattr(process_module, "_BATCH", batch)
        same(process(take), expected)
        shutil.rmtree(take.path.with_suffix(".motion"))
