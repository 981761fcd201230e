"""Reading a take."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from io import SEEK_END
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import msgspec
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    SummaryOffset,
)
from mcap.records import Header as McapHeader
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from handstudio.errors import TakeError
from handstudio.protocol.packets import Packet
from handstudio.recording.header import (
    HEADER_RECORD,
    PROFILE,
    STATE_ATTACHMENT,
    SUMMARY_RECORD,
    TRACKER_TOPIC,
    Header,
    Summary,
    decode_header,
    decode_summary,
    sound_state,
)
from handstudio.recording.naming import UNFINISHED
from handstudio.recording.samples_message import decode_samples
from handstudio.recording.tracker_message import Poses, decode_poses, joined
from handstudio.samples import Event, ImuSamples
from handstudio.stream import EventStream

RECORD_LIMIT = 1 << 28
"""No record of ours is longer [bytes]; a length beyond it is damage, not a reason to wait."""

DAMAGE = (
    *(McapError, ZstdError, struct.error),
    *(ValueError, EOFError, KeyError, MemoryError, OverflowError),
)
"""What reading a damaged file may raise."""


@dataclass(frozen=True, slots=True)
class Told:
    """A message of a tracker, `tracker_message`."""

    arrival_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class FirstState:
    """What decoder and pipeline knew at the first byte; empty where the take has its own start."""

    stream: bytes = b""
    pipeline: bytes = b""


class _PackedFirstState(msgspec.Struct):
    stream: bytes
    pipeline: bytes


def pack_first_state(state: FirstState) -> bytes:
    """The attachment that holds a first state."""
    return msgspec.msgpack.encode(_PackedFirstState(state.stream, state.pipeline))


_FOOTER = 1 + 8 + 20 + 8
"""Bytes of the last record, with its kind and length, and of the mark that every file ends with."""

_CHUNKS = 32
"""Decoded at a time: a few make short runs of instants, and these cost more each."""


@dataclass(frozen=True, slots=True)
class Take:
    """A closed recording; `open_take` makes one."""

    path: Path
    header: Header
    first_state: FirstState
    summary: Summary | None

    def chunks(self) -> Iterator[tuple[int, bytes]]:
        """Messages in order: host time of arrival [ns UTC] and data.

        Raises:
            TakeError: the file is damaged; all before the damage has been given.
        """
        count = 0
        for record in _records(self.path):
            if isinstance(record, Message):
                count += 1
                yield record.log_time, record.data
        if self.summary is not None and count != self.summary.chunks:
            raise _damaged(self.path, ValueError(f"{self.summary.chunks - count} chunks missing"))

    def poses(self) -> Poses:
        """What a tracker told meanwhile, as it came; nothing in a take without one.

        Raises:
            TakeError: the file is damaged.
        """
        if self.header.tracker is None:
            return joined([])
        told = (record for record in _records(self.path) if isinstance(record, Told))
        return joined([decode_poses(one.arrival_ns, one.data) for one in told])

    def events(self, from_start: bool = False) -> Iterator[list[Event]]:
        """Events in the order they came, some seconds at a time; memory does not grow with length.

        Args:
            from_start: Decode as if nothing was known before the first byte.
        """
        if self.header.kind == "samples":
            for _, data in self.chunks():
                yield [decode_samples(data)]
            return
        stream = self.stream(from_start)
        chunks = self.chunks()
        while some := list(islice(chunks, _CHUNKS)):
            yield stream.feed_all(some)

    def runs(self) -> list[ImuSamples]:
        """All its samples, run by run, gaps between them."""
        return [run for events in self.events() for run in events if isinstance(run, ImuSamples)]

    def decoded(self) -> Iterator[tuple[int | None, list[Packet], list[Event]]]:
        """Arrival [ns UTC], packets and events of every chunk; an import has events alone."""
        if self.header.kind == "samples":
            for _, data in self.chunks():
                yield None, [], [decode_samples(data)]
            return
        stream = self.stream(from_start=False)
        for arrival_ns, chunk in self.chunks():
            yield arrival_ns, *stream.feed(chunk, arrival_ns)

    def sha256(self) -> str:
        """Hash of the raw file, read once as long as the file is the same."""
        about = self.path.stat()
        return _sha256(self.path, about.st_size, about.st_mtime_ns)

    def stream(self, from_start: bool = False) -> EventStream:
        """What makes packets and events of its chunks, as it was at the first byte.

        Raises:
            TakeError: nobody knows which decoder the bytes need.
        """
        setup = self.header.setup
        if setup.decoder is None:
            raise TakeError(
                "{path}: the take does not say which decoder its bytes need.",
                "It was not written by handstudio; import it instead.",
                path=self.path,
            )
        if from_start or not self.first_state.stream:
            return EventStream(setup.decoder, setup.ranges)
        return EventStream.resumed(setup.decoder, setup.ranges, self.first_state.stream)


@lru_cache(maxsize=256)
def _sha256(path: Path, _size: int, _mtime_ns: int) -> str:
    """What is kept beside a take is called by this, so that a page asks for it again and again."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def open_take(path: Path) -> Take:
    """Open a take; its data is read when asked for.

    Raises:
        TakeError: there is no such file, it is no take, or its recording was interrupted.
    """
    if path.name.endswith(UNFINISHED):
        raise TakeError(
            "{path}: this recording was interrupted.",
            "Get back what was saved: handstudio recover '{path}'.",
            path=path,
        )
    header, about, state = None, dict[str, str](), FirstState()
    for record in _records(path):
        match record:
            case Metadata(name=name, metadata=about) if name == HEADER_RECORD:
                header = decode_header(about, str(path))
            case Attachment(name=name, data=data) if name == STATE_ATTACHMENT:
                state = unpack_first_state(sound_state(about, data))
            case Chunk() | Message() | DataEnd():
                break  # the data follows; it is read when asked for
            case _:
                pass
    if header is None:
        raise TakeError(
            "{path}: an MCAP file, but not a take.", "Choose a file handstudio wrote.", path=path
        )
    return Take(path, header, state, _summary(path))


def _summary(path: Path) -> Summary | None:
    """The closing record, found through the file's index; fails where the file has no end."""
    try:
        with path.open("rb") as stream:
            for index in _metadata_indexes(stream):
                if index.name == SUMMARY_RECORD:
                    stream.seek(index.offset)
                    record = next(StreamReader(stream, skip_magic=True).records)
                    if not isinstance(record, Metadata):
                        raise McapError("the index of the closing record points elsewhere")
                    return decode_summary(record.metadata)
    except (OSError, *DAMAGE) as error:  # OSError: an index that points nowhere
        raise _damaged(path, error) from error
    return None


def _metadata_indexes(stream: BinaryIO) -> Iterator[MetadataIndex]:
    """Where the metadata of a closed file lies; the index of chunks, as long as the take, is left.

    A reader that decodes all of the index needs seconds for an hour's.
    """
    stream.seek(-_FOOTER, SEEK_END)
    footer = next(StreamReader(stream, skip_magic=True).records)
    if not isinstance(footer, Footer):
        raise McapError("the file has no end")
    start = footer.summary_start
    if start == 0:
        return
    if footer.summary_offset_start:
        stream.seek(footer.summary_offset_start)
        offsets = StreamReader(stream, skip_magic=True).records
        groups = {g.group_opcode: g for g in offsets if isinstance(g, SummaryOffset)}
        if Opcode.METADATA_INDEX not in groups:
            return
        start = groups[Opcode.METADATA_INDEX].group_start
    stream.seek(start)
    for record in StreamReader(stream, skip_magic=True, record_size_limit=RECORD_LIMIT).records:
        if isinstance(record, MetadataIndex):
            yield record


def unpack_first_state(data: bytes) -> FirstState:
    """Inverse of `pack_first_state`; an unreadable state counts as none."""
    if not data:
        return FirstState()
    try:
        packed = msgspec.msgpack.decode(data, type=_PackedFirstState)
    except msgspec.MsgspecError:
        return FirstState()
    return FirstState(packed.stream, packed.pipeline)


def records_until_damage(stream: BinaryIO) -> Iterator[McapRecord | Told]:
    """Records in order, checksums verified; chunks are followed by their messages, none missing.

    What a tracker told is given as `Told`, so that no message is mistaken for bytes of the device.

    Raises:
        One of `DAMAGE`, where the file stops making sense.
    """
    reader = StreamReader(stream, emit_chunks=True, record_size_limit=RECORD_LIMIT)
    turns, trackers = dict[int, int](), set[int]()
    for record in reader.records:
        inside: list[McapRecord] = []
        match record:
            case Message():
                raise ValueError("a message outside a chunk, where none was written")
            case Chunk():
                inside = breakup_chunk(record, validate_crc=True)
        yield record
        for each in inside:
            match each:
                case Channel(id=channel, topic=topic) if topic == TRACKER_TOPIC:
                    trackers.add(channel)
                case Message(channel_id=channel, sequence=sequence):
                    turn = turns.get(channel, 0)
                    if sequence != turn:
                        raise ValueError(f"message {sequence} where {turn} belongs")
                    turns[channel] = turn + 1
                    yield Told(each.log_time, each.data) if channel in trackers else each


def _records(path: Path) -> Iterator[McapRecord | Told]:
    try:
        with path.open("rb") as stream:
            for record in records_until_damage(stream):
                if isinstance(record, McapHeader) and record.profile != PROFILE:
                    raise TakeError(
                        "{path}: an MCAP file of profile {profile!r}, not a take.",
                        "Choose a file handstudio wrote, or import a folder.",
                        path=path,
                        profile=record.profile,
                    )
                yield record
    except OSError as error:
        raise TakeError(
            "{path}: cannot be opened ({reason}).",
            "Check the path.",
            path=path,
            reason=error.strerror or error,
        ) from error
    except DAMAGE as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> TakeError:
    with path.open("rb") as stream:
        ours = stream.read(8) == b"\x89MCAP0\r\n"
    if not ours:
        return TakeError("{path}: not a take.", "Choose a file that ends in .mcap.", path=path)
    return TakeError(
        "{path}: the file is damaged or cut short ({kind}: {reason}).",
        "Get back what is readable: handstudio recover '{path}'.",
        path=path,
        kind=type(error).__name__,
        reason=error,
    )
