"""The poses that were recorded with a take, on the time axis of its motion.

Bytes of the device have arrivals too, so that the least delayed tell how the device's clock stands
to the host's; the delays that remain, of the tracker and of the bytes, are one number, which
alignment finds.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.recording.take import Take
from handstudio.recording.tracker_message import Poses
from handstudio.samples import ImuSamples
from handstudio.trackers.clocks import TrackerClock, clock_of
from handstudio.trackers.track import Track

_DRIFT = 1e-4  # of clocks that are sound; a busy host's delays grow faster, and are not followed


@dataclass(slots=True)
class LeastDelayed:
    """Host minus device time by the least delayed arrivals, as far as clocks may drift.

    A minimum over some seconds would step by what a busy machine delays all that comes in them.

    Attributes:
        offset_us: None before the first arrival.
    """

    offset_us: float | None = None
    _device_us: int = 0

    def observe(self, device_us: int, arrival_ns: int) -> None:
        """The newest instant in a chunk and when the chunk arrived."""
        difference = arrival_ns / 1000 - device_us
        if self.offset_us is not None:
            slack = _DRIFT * (device_us - self._device_us)
            difference = min(difference, self.offset_us + slack)
        self.offset_us, self._device_us = difference, device_us


def recorded_track(take: Take, time_us: Int64[Array, " n"]) -> Track | None:
    """What a tracker told while the take was recorded; None of a take without one.

    Args:
        take: The recording.
        time_us: Of all instants of its motion.

    Returns:
        Poses with the times when they were told, on the motion's axis; none where there are too
        few to tell the tracker's clock.

    Raises:
        TakeError: the file is damaged.
    """
    facts = take.header.tracker
    if facts is None:
        return None
    poses, name = take.poses(), facts.terminal or "terminal"
    clock = clock_of(poses.arrival_ns // 1000, poses.own_us)
    if clock is None or not len(time_us):
        return on_axis(poses[:0], TrackerClock(sound=False), np.zeros(0, dtype=np.int64), name)
    arrivals, offsets = _offsets(take, time_us)
    if not arrivals:
        return on_axis(poses[:0], clock, np.zeros(0, dtype=np.int64), name)
    at = [max(bisect_right(arrivals, ns) - 1, 0) for ns in poses.arrival_ns.tolist()]
    return on_axis(poses, clock, np.array(offsets, dtype=np.int64)[at], name)


def on_axis(
    poses: Poses, clock: TrackerClock, host_minus_device_us: Int64[Array, "*#n"], name: str
) -> Track:
    """Poses with the times when they were told on the device's axis, rising."""
    told = clock.told_us(poses.arrival_ns // 1000, poses.own_us) - host_minus_device_us
    return Track(name, rising(told), poses.t_room_terminal, poses.q_room_terminal, poses.quality)


def rising(time_us: Int64[Array, " n"]) -> Int64[Array, " n"]:
    """The same times, none before or at the one before it."""
    step = np.arange(len(time_us))
    return np.maximum.accumulate(time_us - step) + step if len(time_us) else time_us


def _offsets(take: Take, time_us: Array) -> tuple[list[int], list[int]]:
    """Host minus device time [µs] after every arrival of an instant [ns]."""
    clock, count = LeastDelayed(), 0
    arrivals, offsets = list[int](), list[int]()
    for arrival_ns, _packets, events in take.decoded():
        fresh = sum(len(event) for event in events if isinstance(event, ImuSamples))
        count += fresh
        if not fresh or arrival_ns is None or count > len(time_us):
            continue
        clock.observe(int(time_us[count - 1]), arrival_ns)
        assert clock.offset_us is not None  # one was observed
        arrivals.append(arrival_ns)
        offsets.append(round(clock.offset_us))
    return arrivals, offsets
