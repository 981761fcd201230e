"""The command that tells the noise of sensors from takes in which they lay still."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tyro

from handstudio.calibration.allan import AxisNoise, Density, mean_of
from handstudio.calibration.noise import LEAST_S, Noise, StaticRecording, noise_of
from handstudio.commands.arguments import Json
from handstudio.errors import CalibrationError
from handstudio.export.noise_picture import DEG, THESIS_WALK, THESIS_WHITE, G, draw
from handstudio.recording.at_rest import static_recordings
from handstudio.recording.take import Take, open_take
from handstudio.shell import out, print_json, print_table, progress

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
            recordings += static_recordings(take, _part(share, _READING, index, len(opened)))
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
