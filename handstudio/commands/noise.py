"""The command that tells the noise of sensors from takes in which they lay still."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tyro

from handstudio.arrays import Array
from handstudio.calibration.noise import (
    LEAST_S,
    AxisNoise,
    Density,
    Noise,
    StaticRecording,
    mean_of,
    noise_of,
)
from handstudio.commands.arguments import Json
from handstudio.errors import CalibrationError
from handstudio.export.noise_picture import DEG, THESIS_WALK, THESIS_WHITE, G, draw
from handstudio.recording.notes import load_notes
from handstudio.recording.take import Take, open_take
from handstudio.samples import Gap, ImuSamples, Why
from handstudio.shell import out, print_json, print_table, progress

REST = "rest"
"""Label of the stretches that are looked at; without any the whole take is."""

_GAP_S = 1.0  # what is missing for longer ends a recording
_READING = 0.4  # share of the time that reading takes


def noise(
    takes: Annotated[tuple[Path, ...], tyro.conf.Positional] = (),
    *,
    picture: Path | None = None,
    json: Json = False,
) -> int:
    """Tell the noise of sensors from takes in which they lay still: Allan deviation.

    Args:
        takes: The takes; stretches labelled rest where there are any, else the whole of each.
        picture: Draw the Allan deviations into this file (.png, .svg or .pdf).
        json: Print JSON in SI for a program instead of words.
    """
    if not takes:
        raise CalibrationError("No take was named.", "Name them: handstudio noise TAKE.mcap ...")
    opened = [open_take(path) for path in takes]
    names = _names(opened)
    with progress("reading and averaging", quiet=json) as share:
        recordings: list[StaticRecording] = []
        for index, take in enumerate(opened):
            recordings += _recordings(take, _part(share, _READING, index, len(opened)))
        long = [each for each in recordings if len(each.time_s) >= LEAST_S * each.rate_hz]
        found = noise_of(
            long or recordings, names, lambda done: share(_READING + (1.0 - _READING) * done)
        )
    if picture is not None:
        draw(found, picture)
    if json:
        print_json(msgspec.to_builtins(found) | {"units": _UNITS})
        return 0
    _show(found)
    if picture is not None:
        out.print(str(picture))
    return 0


_UNITS = {
    "gyr": {"white": "rad/sqrt(s)", "walk": "rad/s^1.5", "sigma": "rad/s"},
    "acc": {"white": "m/s^1.5", "walk": "m/s^2.5", "sigma": "m/s^2"},
}


def _names(takes: Sequence[Take]) -> tuple[str, ...]:
    first, *others = [take.header.setup.layout.names for take in takes]
    for take, names in zip(takes[1:], others, strict=True):
        if names != first:
            raise CalibrationError(
                "{path}: not the sensors of {first}.",
                "Name takes of one glove.",
                path=take.path,
                first=takes[0].path,
            )
    return tuple(first)


def _part(
    share: Callable[[float], None], of: float, index: int, count: int
) -> Callable[[float], None]:
    return lambda done: share(of * (index + min(done, 1.0)) / count)


def _recordings(take: Take, share: Callable[[float], None]) -> list[StaticRecording]:
    """The stretches at rest, cut where much is missing; float32 holds every count of a sensor."""
    labels = [label for label in load_notes(take.path).labels if label.label == REST]
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


def _show(found: Noise) -> None:
    minutes = ", ".join(f"{seconds / 60.0:.1f}" for seconds in found.durations_s)
    rows = [
        [
            sensor.sensor,
            _words(mean_of([axis.white for axis in sensor.gyr]), DEG),
            _words(mean_of([axis.walk for axis in sensor.gyr]), DEG),
            _words(mean_of([axis.white for axis in sensor.acc]), G),
            _words(mean_of([axis.walk for axis in sensor.acc]), G),
            f"{_misfit(sensor.gyr):.1f}, {_misfit(sensor.acc):.1f}",
        ]
        for sensor in found.sensors
    ]
    ranges = [THESIS_WHITE["gyr"], THESIS_WALK["gyr"], THESIS_WHITE["acc"], THESIS_WALK["acc"]]
    rows.append(["thesis", *(f"{low:.3g} to {high:.3g}" for low, high in ranges), ""])
    print_table(
        f"Noise at rest, {minutes} min at {found.rate_hz:g} Hz: means of three axes and their 95 % "
        "interval",
        [
            "sensor",
            "gyroscope Q [deg/sqrt(s)]",
            "gyroscope K [deg/s^1.5]",
            "accelerometer Q [G sqrt(s)]",
            "accelerometer K [G/sqrt(s)]",
            "misfit",
        ],
        rows,
    )
    out.print(
        "Q: white noise, read at 1 s. K: walk, read at 3 s; <: not distinct, and below this. "
        "Misfit: about 1 where these two are all the noise there is.\n"
        "thesis: table 4.1, from the lowest to the highest of 20 sensors."
    )
    if found.left_out:
        out.print(f"Left out, silent or constant: {', '.join(found.left_out)}")


def _misfit(axes: Sequence[AxisNoise]) -> float:
    return float(np.mean([axis.misfit for axis in axes]))


def _words(density: Density, unit: float) -> str:
    if not density.distinct:
        return f"< {density.high / unit:.2g}"
    low, value, high = (each / unit for each in (density.low, density.value, density.high))
    return f"{value:.3g} ({low:.3g} to {high:.3g})"
