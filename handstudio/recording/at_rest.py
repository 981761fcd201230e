"""Takes in which sensors lay still, as recordings from which their noise is told."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.course import NOISE
from handstudio.calibration.noise import StaticRecording
from handstudio.recording.notes import load_notes
from handstudio.recording.take import Take
from handstudio.samples import Gap, ImuSamples, Why

_GAP_S = 1.0  # what is missing for longer ends a recording


def static_recordings(
    take: Take, share: Callable[[float], None] = lambda _: None
) -> list[StaticRecording]:
    """The stretches of a take at rest, cut where much is missing.

    Args:
        take: Stretches labelled ``rest`` where there are any, else the whole.
        share: Told the share that is done.

    Raises:
        TakeError: the take cannot be read.
    """
    labels = [label for label in load_notes(take.path).labels if label.label == NOISE.name]
    spans = [(label.start_s, label.end_s) for label in labels] or [(0.0, math.inf)]
    rate_hz = take.header.setup.rate_hz
    whole_s = take.summary.duration_s if take.summary else math.inf
    pieces: dict[tuple[int, int], list[tuple[Array, Array, Array]]] = {}
    offset, piece, last = math.nan, 0, math.nan
    for events in take.events():
        for event in events:
            match event:
                case Gap(why=Why.RESTART, elapsed_us=elapsed):
                    # the clock begins anew: go on after what came last
                    offset, piece = last + max(elapsed * 1e-6, 1.0 / rate_hz), piece + 1
                    last = math.nan
                case ImuSamples() if len(event):
                    clock = event.time_us * 1e-6
                    if math.isnan(last):
                        offset = clock[0] - (0.0 if math.isnan(offset) else offset)
                    time_s = clock - offset
                    piece += int(time_s[0] - last > _GAP_S)
                    last = float(time_s[-1])
                    _keep(pieces, piece, spans, time_s, event)
                case _:
                    pass
        if not math.isnan(last):
            share(last / whole_s)
    return [_joined(parts, rate_hz) for parts in pieces.values()]


def _keep(
    pieces: dict[tuple[int, int], list[tuple[Array, Array, Array]]],
    piece: int,
    spans: Sequence[tuple[float, float]],
    time_s: Array,
    samples: ImuSamples,
) -> None:
    # float32 holds every count of a sensor
    silent = ~samples.valid[..., None]
    for index, (start, end) in enumerate(spans):
        inside = (time_s >= start) & (time_s <= end)
        if inside.any():
            gyr, acc = (
                np.where(silent, np.nan, each)[inside].astype(np.float32)
                for each in (samples.gyr, samples.acc)
            )
            pieces.setdefault((index, piece), []).append((time_s[inside], gyr, acc))


def _joined(parts: list[tuple[Array, Array, Array]], rate_hz: float) -> StaticRecording:
    time_s, gyr, acc = (np.concatenate(each) for each in zip(*parts, strict=True))
    parts.clear()  # an hour of twenty sensors is not held twice
    return StaticRecording(time_s, gyr, acc, rate_hz)
