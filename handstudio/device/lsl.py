"""Trackers that stream by the Lab Streaming Layer: poses as they come, on the host's clock.

The stream's channels must be labelled as the columns of `trackers.columns`, in its description as
the layer's own conventions have it (``channels/channel/label``). Needs the extra ``trackers``.
"""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from handstudio.arrays import Array
from handstudio.device.host_clock import now_ns
from handstudio.errors import DeviceError, TrackError
from handstudio.trackers.columns import tracks_of
from handstudio.trackers.track import Track

CLOCK_AGAIN_S = 5.0
"""How often the sender's clock is compared with ours anew."""

_LEAST_CHANNELS = 6  # of a pose: three of place, three angles or more


class LslTracker:
    """An open stream. One thread owns it."""

    def __init__(self, name: str, timeout_s: float = 5.0) -> None:
        """Find a stream by its name and open it.

        Raises:
            DeviceError: the layer is not installed, or no such stream is there.
            TrackError: its channels are no poses.
        """
        self._lsl = library()
        found = self._lsl.resolve_byprop("name", name, timeout=timeout_s)
        if not found:
            raise DeviceError(
                "No stream called {name!r} was found within {seconds:.0f} s.",
                "Start the tracker's streaming, on this machine or in this network, and check "
                "its name. A firewall must let UDP port 16571 pass.",
                name=name,
                seconds=timeout_s,
            )
        self._name = name
        self._inlet: Any = self._lsl.StreamInlet(found[0], max_buflen=60)
        self._inlet.open_stream(timeout_s)
        self._labels = _labels(self._inlet.info(timeout_s))
        self._offset_s = float(self._inlet.time_correction(timeout_s))
        self._corrected_s = float(self._lsl.local_clock())
        self._host_us = now_ns() / 1000 - 1e6 * self._corrected_s  # both clocks are steady
        self.tracks_of(np.empty(0), np.empty((0, len(self._labels))))

    def read(self, timeout_s: float) -> tuple[Track, ...]:
        """Poses since the last time, waiting up to a time for the first; tracks may be empty.

        Raises:
            DeviceError: the stream went away for good.
        """
        try:
            # a chunk with a time to wait would wait until it is full
            first, at = self._inlet.pull_sample(timeout=timeout_s)
            rows, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=4096)
            if first is not None:
                rows, stamps = [first, *rows], [at, *stamps]
            self._compare_clocks()
        except self._lsl.LostError as error:
            raise DeviceError(
                "The stream {name!r} went away.", "Start it anew, then connect.", name=self._name
            ) from error
        values = np.asarray(rows, dtype=float).reshape(len(stamps), len(self._labels))
        return self.tracks_of(np.asarray(stamps, dtype=float) + self._offset_s, values)

    def tracks_of(self, time_s: Array, values: Array) -> tuple[Track, ...]:
        """Rows of the stream's channels as tracks.

        Args:
            time_s: By this machine's clock of the layer [s]; the tracks have the host's.
            values: One column a channel. Where they are no pose, nothing was seen.
        """
        columns = dict(zip(self._labels, values.T, strict=True))
        time_us = np.round(1e6 * time_s + self._host_us).astype(np.int64)
        return tracks_of(self._name, columns, time_us, refuse=False)

    def close(self) -> None:
        """Let go; never raises."""
        self._inlet.close_stream()

    def _compare_clocks(self) -> None:
        now = float(self._lsl.local_clock())
        if now - self._corrected_s > CLOCK_AGAIN_S:
            # a measurement that is there already; waiting for one would hold up poses
            with contextlib.suppress(RuntimeError):  # it is away: the last one holds
                self._offset_s = float(self._inlet.time_correction(0.2))
            self._corrected_s = now


def stream_names(wait_s: float = 1.0) -> list[str]:
    """Names of the streams that are there and have enough numeric channels for a pose.

    Raises:
        DeviceError: the layer is not installed.
    """
    lsl = library()
    found = lsl.resolve_streams(wait_s)
    numbers = lsl.cf_float32, lsl.cf_double64
    return sorted(
        {
            one.name()
            for one in found
            if one.channel_count() >= _LEAST_CHANNELS and one.channel_format() in numbers
        }
    )


def library() -> Any:
    """The layer's own module.

    Raises:
        DeviceError: it is not installed.
    """
    try:
        import pylsl  # noqa: PLC0415 - an extra
    except (ImportError, RuntimeError, OSError) as error:  # the last two: its library is missing
        raise DeviceError(
            "The Lab Streaming Layer is not installed.",
            "Install it: pip install 'handstudio[trackers]'.",
        ) from error
    return pylsl


def _labels(info: Any) -> list[str]:
    labels, channel = [], info.desc().child("channels").child("channel")
    while not channel.empty():
        labels.append(channel.child_value("label"))
        channel = channel.next_sibling("channel")
    if len(labels) != info.channel_count():
        raise TrackError(
            "The stream {name!r} labels {count} of its {channels} channels.",
            "Label each in the stream's description. docs/trackers.md shows the names.",
            name=info.name(),
            count=len(labels),
            channels=info.channel_count(),
        )
    return labels
