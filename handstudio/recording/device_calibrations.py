"""Sensor errors of devices, by serial number; they lie with the takes, so that they move along.

``<sessions>/.devices/<serial>.json`` is in use, ``<sessions>/.devices/<serial>/<id>.json`` is every
one there ever was.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TypeAlias

import numpy as np

from handstudio.calibration.course import TUMBLE
from handstudio.calibration.device import DeviceCalibration, decode, encode
from handstudio.errors import CalibrationError
from handstudio.recording.calibrations import Loaded, Shelf, Version, new_id
from handstudio.recording.naming import file_name
from handstudio.recording.notes import load_notes
from handstudio.recording.take import Take
from handstudio.samples import Gap, ImuSamples, Why

FOLDER = ".devices"

_BETWEEN_US = 60_000_000  # from one tumble to the next: no turn that could be followed

LoadedDevice: TypeAlias = Loaded[DeviceCalibration]
DeviceVersion: TypeAlias = Version[DeviceCalibration]


def save_device_calibration(sessions: Path, calibration: DeviceCalibration) -> Path:
    """Put a calibration of sensors in use, and in the history; the file in use.

    Raises:
        CalibrationError: it does not say of which device or when, another one of that device was
            made in the same millisecond, or it cannot be written; what was in use still is.
    """
    shelf = _shelf(sessions, calibration.device)
    return shelf.keep(_id(calibration), encode(calibration).encode())


def load_device_calibration(sessions: Path, serial: str) -> LoadedDevice:
    """The calibration in use of a device; the last good one, and why, where that cannot be read.

    Raises:
        CalibrationError: there are some, and each is broken, foreign or of a newer version; or the
            device has no serial number.
    """
    return _shelf(sessions, serial).load()


def device_history(sessions: Path, serial: str) -> list[DeviceVersion]:
    """Every calibration of a device, newest first; then those that cannot be read.

    Raises:
        CalibrationError: the device has no serial number.
    """
    return _shelf(sessions, serial).versions()


def restore_device_calibration(sessions: Path, serial: str, id: str) -> DeviceCalibration:
    """Put a calibration of the history in use again; the one it is.

    Raises:
        CalibrationError: there is none of this id, it cannot be read or written, or the device has
            no serial number.
    """
    return _shelf(sessions, serial).use(id)


def named(text: bytes, path: Path) -> DeviceCalibration:
    """The calibration of sensors in a file's text.

    Raises:
        CalibrationError: it is none, or of a newer version.
    """
    try:
        return decode(text)
    except CalibrationError as error:
        raise CalibrationError("{path}: {why}", "{why.remedy}", path=path, why=error) from error


def device_of(takes: Sequence[Take], told: str = "") -> tuple[str, tuple[str, ...]]:
    """Serial number and names of the sensors of takes.

    Args:
        takes: At least one.
        told: The serial number, where the takes do not know it.

    Raises:
        CalibrationError: they are not of one device.
    """

    def of(take: Take) -> tuple[str, tuple[str, ...]]:
        setup = take.header.setup
        return told or (setup.device.serial_number if setup.device else ""), setup.layout.names

    for take in takes:
        if of(take) != of(takes[0]):
            raise CalibrationError(
                "{path}: not of the device of {first}.",
                "Name takes of one device.",
                path=take.path,
                first=takes[0].path,
            )
    return of(takes[0])


def tumbled(takes: Sequence[Take], share: Callable[[float], None] = lambda _: None) -> ImuSamples:
    """What takes hold for a calibration of sensors, one after the other.

    Args:
        takes: Of one device; stretches labelled ``tumble`` where there are any, else the whole.
        share: Told the share that is done.

    Raises:
        CalibrationError: there is nothing in it.
        TakeError: a take cannot be read.
    """
    parts: list[ImuSamples] = []
    next_us = 0
    for index, take in enumerate(takes):
        runs = list(_runs(take))
        share((index + 1) / len(takes))
        if not runs:
            continue
        labels = [each for each in load_notes(take.path).labels if each.label == TUMBLE.name]
        spans = [(each.start_s, each.end_s) for each in labels] or [(0.0, math.inf)]
        whole = _joined(runs)
        since_us = whole.time_us - whole.time_us[0]
        for start, end in spans:
            # whole microseconds: 0.3 s is an instant, 300000 times 1e-6 a little less
            last_us = since_us[-1] if end == math.inf else round(end * 1e6)
            first = int(np.searchsorted(since_us, round(start * 1e6), side="left"))
            part = whole[first : int(np.searchsorted(since_us, last_us, side="right"))]
            if len(part):
                parts.append(_moved_to(part, next_us))
                next_us = int(parts[-1].time_us[-1]) + _BETWEEN_US
    if not parts:
        raise CalibrationError(
            "The takes hold no instant of a tumble.", "Record the tumble, then name its take."
        )
    return _joined(parts)


def _shelf(sessions: Path, serial: str) -> Shelf[DeviceCalibration]:
    name = _file(serial)

    def foreign(calibration: DeviceCalibration, path: Path) -> CalibrationError | None:
        if calibration.device == serial:
            return None
        return CalibrationError(
            "{path}: is a calibration of the device {other}, not of {serial}.",
            "Calibrate the sensors of this device: handstudio calibrate-sensors.",
            path=path,
            other=calibration.device,
            serial=serial,
        )

    home = sessions / FOLDER
    return Shelf(home / f"{name}.json", home / name, named, foreign, lambda _: True)


def _file(serial: str) -> str:
    """The serial number as a file's name; what no name can hold is told apart by a hash."""
    if not serial.strip():
        raise CalibrationError(
            "The device has no serial number, so nobody can tell whose calibration it is.",
            "Give the calibration as a file: --sensors FILE.",
        )
    clean = file_name(f"d{serial}", "take")[1:]
    if clean == serial:
        return clean
    return f"{clean}-{hashlib.sha256(serial.encode()).hexdigest()[:8]}"


def _id(calibration: DeviceCalibration) -> str:
    try:
        return new_id(datetime.fromisoformat(calibration.made_utc))
    except ValueError as error:
        raise CalibrationError(
            "The calibration of {device} does not say when it was made: “{made}”.",
            "Calibrate the sensors again.",
            device=calibration.device,
            made=calibration.made_utc,
        ) from error


def _runs(take: Take) -> list[ImuSamples]:
    """Its samples; what comes after a device began anew goes on after what came before."""
    runs: list[ImuSamples] = []
    offset_us, restarted_us = 0, -1
    for event in itertools.chain.from_iterable(take.events()):
        match event:
            case Gap(why=Why.RESTART, elapsed_us=elapsed):
                restarted_us = max(elapsed, _BETWEEN_US)
            case ImuSamples() if len(event):
                if restarted_us >= 0 and runs:
                    offset_us = int(runs[-1].time_us[-1]) + restarted_us - int(event.time_us[0])
                restarted_us = -1
                runs.append(_moved_to(event, int(event.time_us[0]) + offset_us))
            case _:
                pass
    return runs


def _moved_to(samples: ImuSamples, begin_us: int) -> ImuSamples:
    time_us = samples.time_us - samples.time_us[0] + begin_us
    return ImuSamples(time_us, *(getattr(samples, name) for name in ImuSamples.__slots__[1:]))


def _joined(runs: Sequence[ImuSamples]) -> ImuSamples:
    columns = ImuSamples.__slots__
    return ImuSamples(*(np.concatenate([getattr(run, name) for run in runs]) for name in columns))
