"""What a take says of itself, in the first records of its file."""

from __future__ import annotations

import zlib
from typing import Literal

import msgspec

from handstudio import __version__
from handstudio.errors import LayoutError, TakeError
from handstudio.health.record import TakeHealth
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.setup import Setup

PROFILE = "handstudio"
HEADER_RECORD = "handstudio.take"
SUMMARY_RECORD = "handstudio.summary"
STATE_ATTACHMENT = "first_state"
WIRE_TOPIC = "/wire"
SAMPLES_TOPIC = "/samples"
TRACKER_TOPIC = "/tracker"
FORMAT = 2
"""The newest that is read. What is written says 2 only where a tracker is with it, so that
versions before trackers read all else."""


class Header(msgspec.Struct, frozen=True):
    """Who, what and when.

    Attributes:
        name: The take's name, as its file's.
        subject: Code of the person, no name needed.
        start_utc_ns: Host time of the start, nanoseconds since 1970 UTC.
        setup: Everything that decides the output besides the events.
        kind: ``wire`` for bytes of a device, ``samples`` for imports.
        source: Address of the device, or the imported folder's name.
        software: Version of handstudio that recorded it.
        format: Version of this layout of the file: 1, or 2 with a tracker.
        tracker: What was chosen as such; None: nothing.
    """

    name: str
    subject: str
    start_utc_ns: int
    setup: Setup
    kind: Literal["wire", "samples"]
    source: str
    software: str = __version__
    format: int = 1
    tracker: TrackerFacts | None = None


class Summary(msgspec.Struct, frozen=True):
    """What was known when the recording ended; absent in a recovered take."""

    chunks: int
    bytes: int
    duration_s: float
    packets: int = 0
    missing: int = 0
    damaged: int = 0
    clock_offset_ns: int | None = None  # host minus device clock, at the end
    clock_drift_ppm: float | None = None
    health: TakeHealth | None = None  # also absent in takes of before it was kept
    poses: int = 0  # of a tracker


def with_tracker(header: Header, tracker: TrackerFacts | None) -> Header:
    """The header of a take that a tracker's poses go into."""
    if tracker is None:
        return header
    return msgspec.structs.replace(header, tracker=tracker, format=2)


def encode_header(header: Header, first_state: bytes) -> dict[str, str]:
    """The metadata record of a header, which also vouches for the first state."""
    return {**_vouched(header), _STATE_CHECKSUM: _checksum(first_state)}


def decode_header(record: dict[str, str], place: str) -> Header:
    """Inverse of `encode_header`; ``place`` names the file in errors.

    Raises:
        TakeError: the record is damaged or of another version.
    """
    try:
        header = msgspec.json.decode(_checked(record), type=Header)
    except (KeyError, msgspec.MsgspecError, LayoutError, _DamagedError) as error:
        raise TakeError(
            "{path}: the header of the take cannot be read ({reason}).",
            "Open it with the version of handstudio that recorded it, or update handstudio.",
            path=place,
            reason=error,
        ) from error
    if header.format > FORMAT:
        raise TakeError(
            "{path}: a take of format {format}; this version reads up to {newest}.",
            "Update handstudio.",
            path=place,
            format=header.format,
            newest=FORMAT,
        )
    return header


def sound_state(record: dict[str, str], first_state: bytes) -> bytes:
    """A first state as its header's record knows it; empty where it was damaged."""
    known = record.get(_STATE_CHECKSUM, _checksum(first_state))
    return first_state if known == _checksum(first_state) else b""


def encode_summary(summary: Summary) -> dict[str, str]:
    """The metadata record of a summary."""
    return _vouched(summary)


def decode_summary(record: dict[str, str]) -> Summary:
    """Inverse of `encode_summary`.

    Raises:
        ValueError: the record is damaged.
    """
    return msgspec.json.decode(_checked(record), type=Summary)


# The container has checksums for its chunks, but none for metadata.
_CHECKSUM, _STATE_CHECKSUM = "crc32", "first_state_crc32"


class _DamagedError(ValueError):
    """A record is not what was written."""


def _vouched(value: Header | Summary) -> dict[str, str]:
    data = msgspec.json.encode(value)
    return {"json": data.decode(), _CHECKSUM: _checksum(data)}


def _checked(record: dict[str, str]) -> str:
    text = record["json"]
    if record.get(_CHECKSUM, _checksum(text.encode())) != _checksum(text.encode()):
        raise _DamagedError("it is damaged: its checksum is wrong")
    return text


def _checksum(data: bytes) -> str:
    return f"{zlib.crc32(data):08x}"
