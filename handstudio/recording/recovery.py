"""Getting back what was saved of an interrupted or damaged recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, McapRecord, Message, Metadata

from handstudio.errors import TakeError
from handstudio.recording.header import (
    HEADER_RECORD,
    STATE_ATTACHMENT,
    Header,
    decode_header,
    sound_state,
)
from handstudio.recording.naming import take_stem
from handstudio.recording.notes import copy_notes
from handstudio.recording.take import DAMAGE, Told, records_until_damage
from handstudio.recording.tracker_message import decode_poses
from handstudio.recording.writer import TakeWriter


@dataclass(frozen=True, slots=True)
class Recovered:
    """What came back."""

    path: Path
    chunks: int
    bytes: int
    duration_s: float


def recover(path: Path) -> Recovered:
    """Make a whole take of all that was flushed before a recording stopped.

    The damaged file stays where it is; the new one stands beside it, named
    ``NAME-recovered.mcap``, with a copy of the notes.

    Raises:
        TakeError: nothing of a take can be read from this file, or the new one exists already.
    """
    target = path.with_name(f"{take_stem(path)}-recovered.mcap")
    records = _readable(path)
    header, state = _beginning(records, path)
    writer = TakeWriter(target, header, state)
    first = last = None
    try:
        for record in records:
            if isinstance(record, Message):
                writer.write(record.log_time, record.data)
                first, last = first or record.log_time, record.log_time
            elif isinstance(record, Told):
                writer.write_poses(decode_poses(record.arrival_ns, record.data))
        writer.close()
    except BaseException:
        writer.discard()  # a copy of a part: the damaged file still has it all
        raise
    copy_notes(path, target)
    duration = (last - first) * 1e-9 if first is not None and last is not None else 0.0
    return Recovered(target, writer.chunks, writer.bytes, duration)


def _readable(path: Path) -> Iterator[McapRecord | Told]:
    try:
        with path.open("rb") as stream:
            yield from records_until_damage(stream)
    except DAMAGE:
        return  # the end of what can be read is what recovery is for
    except OSError as error:
        raise TakeError(
            "{path}: cannot be opened ({reason}).",
            "Check the path.",
            path=path,
            reason=error.strerror or error,
        ) from error


def _beginning(records: Iterator[McapRecord | Told], path: Path) -> tuple[Header, bytes]:
    header, about = None, dict[str, str]()
    for record in records:
        if isinstance(record, Metadata) and record.name == HEADER_RECORD:
            about = record.metadata
            header = decode_header(about, str(path))
        if isinstance(record, Attachment) and record.name == STATE_ATTACHMENT and header:
            return header, sound_state(about, record.data)
    if path.stat().st_size == 0:
        raise TakeError(
            "{path}: is empty, the recording was interrupted before anything was recorded.",
            "Nothing is lost: delete it.",
            path=path,
        )
    raise TakeError(
        "{path}: holds nothing of a take that can be read.",
        "If it was recorded elsewhere, copy it again: the copy may be cut short.",
        path=path,
    )
