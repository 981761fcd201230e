"""A part of a take as a take of its own; the whole one stays as it is.

What decoder and pipeline knew at the cut goes with the part, so that its motion is, to the last
bit, that of the same instants of the whole take.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, pairwise
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from handstudio import pipeline
from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.health.watch import Watch
from handstudio.process import Progress, first_state, process
from handstudio.protocol.packets import Packet
from handstudio.recording.header import Summary
from handstudio.recording.naming import file_name, free_path
from handstudio.recording.notes import Label, Mark, Notes, load_notes, save_notes
from handstudio.recording.samples_message import encode_samples
from handstudio.recording.take import FirstState, Take, pack_first_state
from handstudio.recording.take_track import load_track, save_track
from handstudio.recording.tracker_message import Poses
from handstudio.recording.writer import TakeWriter
from handstudio.samples import Event, ImuSamples
from handstudio.stream import EventStream

_BATCH = 256  # events of what comes before the part, fused at a time
_POSES_BESIDE_NS = 1_000_000_000  # a tracker is late: poses of so long around the part come along


def trim(
    take: Take,
    begin_s: float,
    end_s: float | None = None,
    *,
    name: str = "",
    progress: Progress | None = None,
) -> Path:
    """Write the instants from one time to another, both counted in, as a take beside the whole.

    Labels and marks inside come along, and the words about the whole take.

    Args:
        take: The whole one.
        begin_s: Where the part begins, from the first instant [s].
        end_s: Where it ends; the end of the take unless told.
        name: Of the part; ``NAME-part`` unless given.
        progress: Told how far it is.

    Returns:
        The new take's path.

    Raises:
        TakeError: there is no instant in the part, the take is damaged, or the disk is full.
    """
    time_us = process(take).time_us
    time_s = (time_us - time_us[:1]) * 1e-6
    first = int(np.searchsorted(time_s, begin_s - 1e-9))
    stop = len(time_s) if end_s is None else int(np.searchsorted(time_s, end_s + 1e-9))
    if stop <= first:
        raise TakeError(
            "There is no instant of {name} in this part.",
            "Choose another begin or end.",
            name=take.path.name,
        )
    stem = file_name(name, "take") if name else f"{take.path.stem}-part"
    target = free_path(take.path.with_name(f"{stem}.mcap"))
    _write(take, target, first, time_s[first:stop], progress or (lambda _share: None))
    _take_notes_along(take.path, target, float(time_s[first]), float(time_s[stop - 1]))
    kept = load_track(take.path)
    if kept is not None:  # all of it: the part's time axis is the whole take's
        save_track(target, kept)
    return target


@dataclass(frozen=True, slots=True)
class _Piece:
    """A chunk of the whole take, or what of it belongs to the part.

    Attributes:
        log_ns: When it came; of an import, when it was measured.
        data: As it is written.
        packets: What is in it; none in an import.
        events: Likewise.
    """

    log_ns: int
    data: bytes
    packets: list[Packet]
    events: list[Event]


class _Before:
    """What comes before the part: it is fused, as the part goes on from there."""

    def __init__(self, take: Take) -> None:
        self._setup = take.header.setup
        self._state = first_state(take, self._setup)
        self._events: list[Event] = []

    def add(self, events: Iterable[Event]) -> None:
        """The next events."""
        self._events += events
        if len(self._events) >= _BATCH:
            self.state()

    def state(self) -> bytes:
        """What the pipeline knows after them."""
        if self._events:
            _motion, self._state = pipeline.run(self._setup, self._state, self._events)
            self._events = []
        return pipeline.pack(self._setup, self._state)


def _write(
    take: Take, target: Path, first: int, time_s: Float[Array, " n"], progress: Progress
) -> None:
    start_ns = take.header.start_utc_ns + round(float(time_s[0]) * 1e9)
    header = msgspec.structs.replace(take.header, name=target.stem, start_utc_ns=start_ns)
    imported = take.header.kind == "samples"
    known, pieces = (_of_import if imported else _of_wire)(take, first, first + len(time_s))
    watch, done = Watch(), 0
    watch.begin(header.setup)
    watch.begin_take()
    told, newest_ns = _told(take, start_ns - _POSES_BESIDE_NS), start_ns
    writer = TakeWriter(target, header, pack_first_state(known))
    try:
        for piece in pieces:
            newest_ns = piece.log_ns
            while told and told[0].arrival_ns[0] <= newest_ns:
                writer.write_poses(told.popleft())
            writer.write(newest_ns, piece.data)
            watch.note(piece.packets, piece.events, None if imported else piece.log_ns)
            done += _instants(piece.events)
            progress(min(1.0, done / len(time_s)))
        while told and told[0].arrival_ns[0] <= newest_ns + _POSES_BESIDE_NS:
            writer.write_poses(told.popleft())
        health = watch.end_take()
        assert health is not None  # a take was begun
        seconds = float(time_s[-1] - time_s[0])
        counts = health.instants, health.missing, health.damaged
        writer.close(Summary(0, 0, seconds, *counts, health=health))
    except BaseException:
        writer.discard()  # a copy of a part: the whole take still has it
        raise


def _told(take: Take, from_ns: int) -> deque[Poses]:
    """What a tracker told from then on, by arrival."""
    poses = take.poses()
    poses = poses[poses.arrival_ns >= from_ns]
    _, first = np.unique(poses.arrival_ns, return_index=True)
    return deque(poses[a:b] for a, b in pairwise([*sorted(first.tolist()), len(poses)]))


def _of_wire(take: Take, first: int, stop: int) -> tuple[FirstState, Iterator[_Piece]]:
    """What was known at an instant, and the bytes from it to another that is not of the part."""
    chunks, before, stream, count = take.chunks(), _Before(take), take.stream(), 0
    for arrival_ns, chunk in chunks:
        saved = stream.save()
        events = stream.feed(chunk, arrival_ns)[1]
        if count + _instants(events) <= first:
            before.add(events)
            count += _instants(events)
            continue
        stream = _resumed(take, saved)
        cut = _bytes_before(take, saved, chunk, first - count)
        before.add(stream.feed(chunk[:cut], arrival_ns)[1])
        known = FirstState(stream.save(), before.state())
        rest = chain([(arrival_ns, chunk[cut:])], chunks)
        return known, _until(take, stream, rest, stop - first)
    raise _ended(take)


def _until(
    take: Take, stream: EventStream, chunks: Iterable[tuple[int, bytes]], left: int
) -> Iterator[_Piece]:
    """Chunks until so many instants were in them."""
    for arrival_ns, whole in chunks:
        saved, chunk = stream.save(), whole
        packets, events = stream.feed(chunk, arrival_ns)
        if _instants(events) > left:
            chunk = whole[: _bytes_before(take, saved, whole, left)]
            packets, events = _resumed(take, saved).feed(chunk, arrival_ns)
        if chunk:
            yield _Piece(arrival_ns, chunk, packets, events)
        left -= _instants(events)
        if left == 0:
            return


def _bytes_before(take: Take, saved: bytes, chunk: bytes, instants: int) -> int:
    """How much of a chunk comes before the last byte of its instant of this number."""
    stream, count = _resumed(take, saved), 0
    for at in range(len(chunk)):
        count += _instants(stream.feed(chunk[at : at + 1], 0)[1])
        if count > instants:
            return at
    return len(chunk)


def _resumed(take: Take, saved: bytes) -> EventStream:
    setup = take.header.setup
    assert setup.decoder is not None  # or it would not have been read so far
    return EventStream.resumed(setup.decoder, setup.ranges, saved)


def _of_import(take: Take, first: int, stop: int) -> tuple[FirstState, Iterator[_Piece]]:
    """What was known at an instant, and the samples from it to another that is not of the part."""
    before, count = _Before(take), 0
    inside: list[ImuSamples] = []
    for events in take.events():
        for run in events:
            if isinstance(run, ImuSamples):
                head, tail = max(0, first - count), max(0, stop - count)
                before.add([run[:head]] if head else [])
                inside += [run[head:tail]] if head < min(tail, len(run)) else []
                count += len(run)
    if not inside:
        raise _ended(take)
    start_ns = take.header.start_utc_ns
    pieces = (
        _Piece(start_ns + int(run.time_us[0]) * 1000, encode_samples(run), [], [run])
        for run in inside
    )
    return FirstState(b"", before.state()), pieces


def _instants(events: Iterable[Event]) -> int:
    return sum(len(event) for event in events if isinstance(event, ImuSamples))


def _ended(take: Take) -> TakeError:
    return TakeError(
        "{path}: the take holds less than its motion.",
        "Process it again: handstudio process '{path}'.",
        path=take.path,
    )


def _take_notes_along(whole: Path, part: Path, begin_s: float, end_s: float) -> None:
    notes = load_notes(whole)
    labels = tuple(
        Label(max(label.start_s, begin_s) - begin_s, min(label.end_s, end_s) - begin_s, label.label)
        for label in notes.labels
        if label.start_s < end_s and label.end_s > begin_s
    )
    marks = tuple(
        Mark(mark.at_s - begin_s, mark.text)
        for mark in notes.marks
        if begin_s <= mark.at_s <= end_s
    )
    kept = Notes(labels, notes.text, marks)
    if kept != Notes():
        save_notes(part, kept)
