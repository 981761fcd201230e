"""Cutting a stream into windows by the device's clock, wherever its events were cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.health.limits import LEAST_INSTANTS, WINDOW_S
from handstudio.samples import Event, Gap, ImuSamples, Why


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """What came within one window; at least one instant."""

    samples: ImuSamples  # time of the device, of one epoch
    breaks: tuple[int, ...]  # indices of the samples before which instants are missing
    missing: int  # instants missing before or between these
    restarts: int  # of the device, right before these
    start_us: int  # of the first instant, on an axis that goes on over restarts
    end_us: int  # of the last


class Windows:
    """Collects events until their window is over.

    The edges lie on multiples of the window in the device's own time, so that a stream that is
    joined later has the same ones.
    """

    def __init__(self, sensors: int, rate_hz: float) -> None:
        self._sensors = sensors
        self._period_us = round(1e6 / rate_hz)
        self._window_us = round(max(WINDOW_S, LEAST_INSTANTS / rate_hz) * 1e6)
        self._last_us: int | None = None  # the newest instant, on the axis that goes on
        self._offset_us = 0  # from the device's time to that axis
        self._away_us = 0
        self._number: int | None = None  # of the window that is collected
        self._missing = self._restarts = 0  # told, but not yet followed by an instant
        self._clear()

    def add(self, event: Event) -> list[Window]:
        """Take the next event; the windows it ends, oldest first."""
        match event:
            case Gap(why=Why.RESTART, elapsed_us=elapsed):
                self._restarts += 1
                self._away_us = elapsed
            case Gap(missing=missing):
                self._missing += missing
            case ImuSamples() if event.gyr.shape[1] == self._sensors and len(event):
                return self._add_samples(event)
            case ImuSamples():
                pass  # of a device that came back with other sensors
        return []

    def flush(self) -> Window | None:
        """The window that is not over yet, as it is; the next instant begins another."""
        if not self._parts:
            return None
        whole = _joined(self._parts)
        first = int(whole.time_us[0]) + self._offset_us
        last = int(whole.time_us[-1]) + self._offset_us
        window = Window(
            whole, tuple(self._breaks), self._missing_here, self._restarts_here, first, last
        )
        self._clear()
        return window

    def _add_samples(self, samples: ImuSamples) -> list[Window]:
        ended: list[Window] = []
        if self._restarts:
            ended += self._ended()
            self._go_on_after_restart(int(samples.time_us[0]))
        numbers = samples.time_us // self._window_us
        done, count = 0, len(samples)
        while done < count:
            number = int(numbers[done])
            if self._number != number:
                ended += self._ended()
                self._number = number
            end = int(np.searchsorted(numbers, number, side="right"))
            self._keep(samples if end - done == count else samples[done:end])
            done = end
        self._last_us = int(samples.time_us[-1]) + self._offset_us
        return ended

    def _keep(self, samples: ImuSamples) -> None:
        if self._missing:
            self._breaks.append(self._count)
        self._missing_here += self._missing
        self._restarts_here += self._restarts
        self._missing = self._restarts = 0
        self._parts.append(samples)
        self._count += len(samples)

    def _ended(self) -> list[Window]:
        window = self.flush()
        return [] if window is None else [window]

    def _go_on_after_restart(self, first_us: int) -> None:
        if self._last_us is not None:
            away_us = max(self._away_us, self._period_us)
            self._offset_us = self._last_us + away_us - first_us
        self._away_us = 0

    def _clear(self) -> None:
        self._parts: list[ImuSamples] = []
        self._breaks: list[int] = []
        self._count = 0
        self._missing_here = self._restarts_here = 0
        self._number = None


def _joined(parts: list[ImuSamples]) -> ImuSamples:
    if len(parts) == 1:
        return parts[0]
    names = ImuSamples.__slots__
    return ImuSamples(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
