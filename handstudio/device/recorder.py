"""The writer thread: owns the file of a take, so that a slow disk never slows the capture."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from handstudio.errors import HandstudioError, TakeError
from handstudio.pipeline import Motion
from handstudio.process import MotionWriter, motion_folder
from handstudio.recording.header import Header, Summary
from handstudio.recording.take import open_take
from handstudio.recording.tracker_message import Poses
from handstudio.recording.writer import FLUSH_S, TakeWriter

BACKLOG_LIMIT = 256 << 20  # bytes waiting for the disk before a recording counts as failed


@dataclass(frozen=True, slots=True)
class _Chunk:
    arrival_ns: int
    data: bytes


@dataclass(frozen=True, slots=True)
class _End:
    summary: Summary


def _motion_writer(path: Path, sensors: int) -> MotionWriter | None:
    try:
        return MotionWriter(path, sensors)
    except OSError:  # the bytes are what counts; the motion can be computed from them
        return None


class Recorder:
    """Records one take; `put` and `put_motion` from the capture thread, `put_poses` from the
    tracker's, the rest from anywhere.

    Args:
        path: The file to become.
        header: What the take says of itself.
        first_state: Decoder and pipeline state at the first chunk.

    Raises:
        TakeError: the file cannot be created.
    """

    def __init__(self, path: Path, header: Header, first_state: bytes) -> None:
        self.path = path
        self.header = header
        self.started = time.monotonic()
        self.failure: HandstudioError | None = None
        self.bytes = 0  # these three by the capture thread alone
        self.chunks = 0
        self.first_us: int | None = None  # device time of the take's first instant
        self._written = 0  # bytes; by the writer thread alone
        self._queue: queue.SimpleQueue[_Chunk | Motion | Poses | _End] = queue.SimpleQueue()
        self._writer = TakeWriter(path, header, first_state)
        self._motion = _motion_writer(path, len(header.setup.layout.sensors))
        self._thread = threading.Thread(target=self._run, name="take writer")
        self._thread.start()

    @property
    def seconds(self) -> float:
        """How long this recording has been going on."""
        return time.monotonic() - self.started

    def put(self, arrival_ns: int, chunk: bytes) -> bool:
        """Hand over bytes; returns at once. False: it failed, and these are not in the take."""
        if self.failure is not None:
            return False
        waiting = self.bytes - self._written
        if waiting + len(chunk) > BACKLOG_LIMIT:
            self.failure = TakeError(
                "{path}: the disk is {megabytes:.0f} MB behind.",
                "Record to a faster disk. The take is kept up to here.",
                path=self.path,
                megabytes=waiting / 1e6,
            )
            return False
        self.bytes += len(chunk)
        self.chunks += 1
        self._queue.put(_Chunk(arrival_ns, chunk))
        return True

    def put_motion(self, motion: Motion) -> None:
        """Hand over the live result, so that the take opens at once."""
        if self.first_us is None and len(motion):
            self.first_us = int(motion.time_us[0])
        if self.failure is None:
            self._queue.put(motion)

    def put_poses(self, poses: Poses) -> None:
        """Hand over what a tracker told; what comes after the end is not of the take."""
        if self.failure is None and self.header.tracker is not None:
            self._queue.put(poses)

    def stop(self, summary: Summary) -> None:
        """End the take; the file closes soon after, see `finished`."""
        self._queue.put(_End(summary))

    def wait(self) -> None:
        """Wait until the file is closed."""
        self._thread.join()

    @property
    def finished(self) -> bool:
        """Whether the file is closed, whole or failed."""
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._write_until_the_end()
            self._keep_live_motion()
        except HandstudioError as error:
            self.failure = error
            self._writer.abandon()
        except Exception as error:  # a thread must not die unseen
            self.failure = HandstudioError(
                "{path}: writing stopped ({kind}: {reason}).",
                "What was written until now is kept: handstudio recover '{path}.recording'.",
                path=self.path,
                kind=type(error).__name__,
                reason=error,
            )
            self._writer.abandon()
        finally:
            self._forget_motion()

    def _write_until_the_end(self) -> None:
        while True:
            try:
                item = self._queue.get(timeout=FLUSH_S)
            except queue.Empty:
                self._writer.flush()
                continue
            match item:
                case _Chunk(arrival_ns=arrival_ns, data=data):
                    self._writer.write(arrival_ns, data)
                    self._written += len(data)
                case Poses():
                    self._writer.write_poses(item)
                case Motion():
                    self._append_motion(item)
                case _End(summary=summary):
                    self._writer.close(summary)
                    return

    def _append_motion(self, motion: Motion) -> None:
        if self._motion is None:
            return
        try:
            self._motion.append(motion)
        except OSError:  # the bytes are what counts; the motion can be computed from them
            self._forget_motion()

    def _keep_live_motion(self) -> None:
        """Live and processed motion are equal to the last bit: keep it where `process` looks."""
        if self._motion is not None:
            with contextlib.suppress(OSError):
                take = open_take(self.path)
                self._motion.finish(motion_folder(take, self.header.setup, from_start=False))

    def _forget_motion(self) -> None:
        if self._motion is not None:
            self._motion.discard()
            self._motion = None
