"""Writing a take: append-only, chunked, checksummed; what was flushed survives a crash."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import msgspec
from mcap.writer import Writer

from handstudio import __version__
from handstudio.errors import TakeError
from handstudio.recording.header import (
    HEADER_RECORD,
    PROFILE,
    SAMPLES_TOPIC,
    STATE_ATTACHMENT,
    SUMMARY_RECORD,
    TRACKER_TOPIC,
    WIRE_TOPIC,
    Header,
    Summary,
    encode_header,
    encode_summary,
)
from handstudio.recording.held import hold
from handstudio.recording.naming import UNFINISHED
from handstudio.recording.samples_message import encode_samples
from handstudio.recording.tracker_message import Poses, encode_poses
from handstudio.samples import ImuSamples

FLUSH_S = 0.25
"""How often a recording is handed to the operating system, by the clock and by the times of what is
written: the most a crash can cost."""

_BUFFER = 1 << 20  # [byte] more than a beginning is long, so that a file has all of it or nothing


class TakeWriter:
    """Writes one take; not to be shared between threads.

    The file is called ``NAME.mcap.recording`` until `close` gives it its name: a file called
    ``NAME.mcap`` is always whole, and never changes again.

    Args:
        path: The file to become, ending in ``.mcap``.
        header: What the take says of itself.
        first_state: Decoder and pipeline state at the first byte (empty: from the start).

    Raises:
        TakeError: the file exists already, or cannot be written.
    """

    def __init__(self, path: Path, header: Header, first_state: bytes = b"") -> None:
        self.path = path
        self.bytes = 0
        self.chunks = 0
        self.poses = 0
        self._pose_messages = 0
        self._unfinished = path.with_name(path.name + UNFINISHED)
        self._flushed_at = time.monotonic()
        self.start_utc_ns = header.start_utc_ns
        self._flushed_until_ns = header.start_utc_ns
        self._stream = self._create()
        try:
            self._begin(header, first_state)
        except BaseException:
            self.discard()  # nothing is in it, and it would stand in the way of the next try
            raise

    def write(self, arrival_ns: int, chunk: bytes) -> None:
        """Append bytes as they arrived; flushes when it is time.

        Raises:
            TakeError: the disk is full or gone. What was flushed before is safe.
        """
        with self._saying_what_to_do():
            self._writer.add_message(self._channel, arrival_ns, chunk, arrival_ns, self.chunks)
            self.bytes += len(chunk)
            self.chunks += 1
            self._flush_in_time(arrival_ns)

    def write_poses(self, poses: Poses) -> None:
        """Append what a tracker told, all of which arrived together; flushed as bytes are.

        Only into a take whose header names a tracker.

        Raises:
            TakeError: the disk is full or gone. What was flushed before is safe.
        """
        if self._tracker is None or not len(poses):
            return
        with self._saying_what_to_do():
            at_ns, data = int(poses.arrival_ns[0]), encode_poses(poses)
            self._writer.add_message(self._tracker, at_ns, data, at_ns, self._pose_messages)
            self.poses += len(poses)
            self._pose_messages += 1
            self._flush_in_time(at_ns)

    def write_samples(self, samples: ImuSamples, start_utc_ns: int) -> None:
        """Append imported samples."""
        self.write(start_utc_ns + int(samples.time_us[0]) * 1000, encode_samples(samples))

    def flush(self) -> None:
        """Hand everything to the operating system."""
        with self._saying_what_to_do():
            self._writer.flush()
            self._flushed_at = time.monotonic()

    def close(self, summary: Summary | None = None) -> Path:
        """Finish the file and give it its name.

        What the summary says of chunks, bytes and poses is what was written here.
        """
        with self._saying_what_to_do():
            if summary is not None:
                counted = {"chunks": self.chunks, "bytes": self.bytes, "poses": self.poses}
                told = msgspec.structs.replace(summary, **counted)
                self._writer.add_metadata(SUMMARY_RECORD, encode_summary(told))
            self._writer.finish()
            self._stream.flush()
            os.fsync(self._stream.fileno())
            self._stream.close()
            _refuse_existing(self.path)
            self._unfinished.rename(self.path)
        return self.path

    def abandon(self) -> None:
        """Let go of the file as it is; `recover` makes a take of it."""
        with contextlib.suppress(OSError, ValueError):
            self._stream.close()

    def discard(self) -> None:
        """Let go of the file and remove it: for copies of what is safe elsewhere."""
        self.abandon()
        with contextlib.suppress(OSError):
            self._unfinished.unlink(missing_ok=True)

    def _create(self) -> BinaryIO:
        _refuse_existing(self.path)
        with self._saying_what_to_do():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            try:
                stream = self._unfinished.open("xb", buffering=_BUFFER)
            except FileExistsError as error:
                raise TakeError(
                    "{path} is there already: an interrupted recording.",
                    "Recover it first (handstudio recover '{path}'), or record under another name.",
                    path=self._unfinished,
                ) from error
            hold(stream)  # so that nobody takes it for an interrupted one
            return stream

    def _begin(self, header: Header, first_state: bytes) -> None:
        with self._saying_what_to_do():
            self._writer = Writer(self._stream, chunk_size=1 << 20)
            self._writer.start(PROFILE, f"handstudio {__version__}")
            self._writer.add_metadata(HEADER_RECORD, encode_header(header, first_state))
            self._writer.add_attachment(
                header.start_utc_ns,
                header.start_utc_ns,
                STATE_ATTACHMENT,
                "application/octet-stream",
                first_state,
            )
            topic = WIRE_TOPIC if header.kind == "wire" else SAMPLES_TOPIC
            self._channel = self._writer.register_channel(topic, "application/octet-stream", 0)
            self._tracker: int | None = None
            if header.tracker is not None:
                self._tracker = self._writer.register_channel(
                    TRACKER_TOPIC, "application/octet-stream", 0
                )
            self.flush()

    def _flush_in_time(self, arrival_ns: int) -> None:
        late = time.monotonic() - self._flushed_at >= FLUSH_S
        if late or arrival_ns - self._flushed_until_ns >= FLUSH_S * 1e9:
            self.flush()
            self._flushed_until_ns = arrival_ns

    @contextlib.contextmanager
    def _saying_what_to_do(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise TakeError(
                "{path}: cannot be written ({reason}).",
                "Free some space or check the folder's permissions. What was recorded until now "
                "is kept: handstudio recover '{path}'.",
                path=self._unfinished,
                reason=error.strerror or error,
            ) from error


def _refuse_existing(path: Path) -> None:
    if path.exists():
        raise TakeError(
            "{path} exists already.", "Takes are never overwritten: choose a name.", path=path
        )
