"""Commands of calibration: of subjects, of sensors, what there is, and the other hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import tyro

from handstudio.calibrate import Calibrated
from handstudio.calibrate import calibrate as calibrate_takes
from handstudio.calibrate_sensors import calibrate_sensors as sensors_of
from handstudio.calibration.agreement import Agreement
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.mirrored import mirrored
from handstudio.calibration.subject import SubjectCalibration, decode
from handstudio.commands.arguments import Json, Sessions
from handstudio.commands.readings import show_verdicts, told
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import HandSide, HandType
from handstudio.recording.calibrations import (
    SubjectVersion,
    history,
    load_calibration,
    new_id,
    restore,
    save_calibration,
)
from handstudio.recording.device_calibrations import (
    DeviceVersion,
    device_history,
    load_device_calibration,
    named,
    restore_device_calibration,
    save_device_calibration,
)
from handstudio.recording.library import sessions_folder
from handstudio.recording.subjects import existing
from handstudio.recording.take import Take, open_take
from handstudio.setup import Setup, calibrated
from handstudio.shell import err, out, print_error, print_json, print_table, progress

Takes = Annotated[tuple[Path, ...], tyro.conf.Positional]
Code = Annotated[str, tyro.conf.Positional]

_SIDES: tuple[HandSide, HandSide] = ("left", "right")
_UNUSUAL, _UNLIKELY = 2.0, 3.0  # standard deviations of a population
_NONE = "none"


def calibrate(
    takes: Takes = (),
    *,
    subject: str = "",
    hand_type: HandType | None = None,
    dry_run: bool = False,
    anyway: bool = False,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """Calibrate a subject from takes of the course, and say how good it is.

    Args:
        takes: The takes; their labels say what was done when.
        subject: Keep it for this subject; for that of the takes unless given.
        hand_type: How the palm is divided: 1, one block; 2, two from the wrist; 3, one hinged to
            the other. As the takes have it unless given: 3, and 1 without a sensor on the edge.
        dry_run: Keep nothing.
        anyway: Keep it also where steps were done badly and nothing better is there.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    opened = _opened(takes, "calibrate")
    with progress("calibrating", quiet=json) as share:
        found = calibrate_takes(opened, share, hand_type)
    calibration = found.calibration
    if subject:
        calibration = msgspec.structs.replace(calibration, subject=subject)
    refused = _refused(found)
    if not json:  # also where it then cannot be kept
        show_verdicts(found.verdicts)
        _show_subject(calibration)
        _show_what_to_repeat(found, refused)
    kept = None
    if not dry_run and (anyway or not refused):
        kept = save_calibration(sessions_folder(sessions), calibration)
    if json:
        print_json(
            {
                "calibration": calibration,
                "verdicts": told(found.verdicts),
                "to_repeat": found.to_repeat,
                "refused": refused,
                "kept": None if kept is None else str(kept),
            }
        )
    else:
        _say_kept(kept, dry_run)
    return 1 if refused and not anyway else 0


def calibrate_sensors(
    takes: Takes = (),
    *,
    device: str = "",
    dry_run: bool = False,
    anyway: bool = False,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """Find the errors of a device's sensors from takes in which it was laid down in all directions.

    Args:
        takes: The takes; stretches labelled tumble where there are any, else the whole of each.
        device: Serial number, where the takes do not know it.
        dry_run: Keep nothing.
        anyway: Keep it also where something is not as it should be.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    opened = _opened(takes, "calibrate-sensors")
    with progress("calibrating the sensors", quiet=json) as share:
        found = sensors_of(opened, device, share)
    names, verdict, before, after = found.names, found.verdict, found.before, found.after
    if not json:
        show_verdicts([verdict])
        _show_sensors(found.calibration, names, before, after)
    kept = None
    if not dry_run and (anyway or verdict.ok):
        kept = save_device_calibration(sessions_folder(sessions), found.calibration)
    if json:
        print_json(
            {
                "calibration": found.calibration,
                "verdicts": told([verdict]),
                "before": dict(zip(names, before, strict=True)),
                "after": dict(zip(names, after, strict=True)),
                "units": {"acc": "m/s^2", "gyr": "deg"},
                "kept": None if kept is None else str(kept),
            }
        )
    else:
        _say_kept(kept, dry_run)
    return 0 if verdict.ok or anyway else 1


def calibrations(
    subject: Code,
    *,
    restore: str = "",
    device: bool = False,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """List the calibrations of a subject, or put one of them in use again.

    Args:
        subject: Code of the person; with --device a serial number.
        restore: Put the one of this id in use again; the others stay.
        device: List the calibrations of a device's sensors instead.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    folder = sessions_folder(sessions)
    if device:
        return _device_calibrations(folder, subject, restore, json)
    code = existing(folder, subject).name
    if restore:
        _restored(folder, code, restore)
    in_use = [load_calibration(folder, code, side) for side in _SIDES]
    used = [each.calibration for each in in_use if each.calibration is not None]
    listed = _unique([each for side in _SIDES for each in history(folder, code, side)])
    for each in in_use:
        if each.problem is not None:
            print_error(each.problem)
    if json:
        print_json([_row(each, each.calibration in used) for each in listed])
        return 0
    rows = [
        [each.id, *_facts(each.calibration), _state(each, each.calibration in used)]
        for each in listed
    ]
    columns = ["id", "made", "hand", "length", "device", "from", ""]
    print_table(f"Calibrations of {code}", columns, rows)
    return 0


def mirror(
    subject: Code,
    *,
    side: HandSide | None = None,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """Calibrate the other hand of a subject by mirror.

    Args:
        subject: Code of the person.
        side: The hand that was measured; the one that is calibrated unless given.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    folder = sessions_folder(sessions)
    code = existing(folder, subject).name
    measured = _measured(folder, code, side)
    now = datetime.now(UTC)
    other = mirrored(measured, new_id(now), now.isoformat(timespec="milliseconds"))
    kept = save_calibration(folder, other)
    if json:
        print_json({"calibration": other, "kept": str(kept)})
    else:
        out.print(f"{kept}  ({other.side} hand, from {measured.id} of the {measured.side} one)")
    return 0


def chosen(setup: Setup, calibration: str | None, sensors: str | None) -> Setup:
    """A setup with other calibrations than it has.

    Args:
        setup: As it is.
        calibration: File of a subject calibration, ``none`` for none; None: as it is.
        sensors: The same of a calibration of sensors.

    Raises:
        CalibrationError: a file holds none, or one of another hand or device.
    """
    if calibration is None and sensors is None:
        return setup
    subject, errors = setup.subject, setup.sensors
    if calibration is not None:
        subject = None if calibration == _NONE else read_calibration(calibration)
    if sensors is not None:
        errors = None if sensors == _NONE else named(_bytes(sensors), Path(sensors))
        _refuse_other_device(setup, errors, sensors)
    return calibrated(setup, subject=subject, sensors=errors)


def read_calibration(file: str) -> SubjectCalibration:
    """The subject calibration in a file.

    Raises:
        CalibrationError: there is none in it.
    """
    return decode(_bytes(file), file)


# --- reading --------------------------------------------------------------------------------------


def _opened(takes: Sequence[Path], command: str) -> list[Take]:
    if not takes:
        raise CalibrationError(
            "No take was named.", "Name them: handstudio {command} TAKE.mcap ...", command=command
        )
    return [open_take(path) for path in takes]


def _bytes(file: str) -> bytes:
    try:
        return Path(file).read_bytes()
    except OSError as error:
        raise CalibrationError(
            "{path}: cannot be read ({reason}).",
            "Check the path, or say none for no calibration.",
            path=file,
            reason=error.strerror or error,
        ) from error


def _refuse_other_device(setup: Setup, errors: DeviceCalibration | None, file: str) -> None:
    own = "" if setup.device is None else setup.device.serial_number
    if errors is not None and errors.device and own and errors.device != own:
        raise CalibrationError(
            "{path}: the sensors of {other}, and the take is of {device}.",
            "Choose the calibration of this device, or none.",
            path=file,
            other=errors.device,
            device=own,
        )


# --- judging --------------------------------------------------------------------------------------


def _refused(found: Calibrated) -> list[str]:
    """Steps to repeat that were done, and badly each time: skipped ones cost, but are allowed."""
    done = {verdict.step for verdict in found.verdicts}
    good = {verdict.step for verdict in found.verdicts if verdict.ok}
    return [step for step in found.to_repeat if step in done - good]


def _measured(folder: Path, code: str, side: HandSide | None) -> SubjectCalibration:
    """The calibration that is to be mirrored."""
    sides = _SIDES if side is None else (side,)
    loaded = [load_calibration(folder, code, each) for each in sides]
    for each in loaded:
        if each.problem is not None:
            print_error(each.problem)
    known = [each.calibration for each in loaded if each.calibration is not None]
    measured = [each for each in known if not each.mirrored_from] or known
    if len(measured) > 1:
        raise CalibrationError(
            "Both hands of {code} are calibrated.",
            "Say which one to mirror: --side left or --side right.",
            code=code,
        )
    if not measured:
        raise CalibrationError(
            "No hand of {code} that could be mirrored is calibrated.",
            "Calibrate one first: handstudio calibrate TAKE.mcap ...",
            code=code,
        )
    return measured[0]


def _unique(versions: Sequence[SubjectVersion]) -> list[SubjectVersion]:
    """Each once: those that cannot be read are of either hand, and stand last."""
    once = {each.id: each for each in versions}
    return sorted(once.values(), key=lambda each: each.calibration is None)


def _restored(folder: Path, code: str, id: str) -> None:
    found = restore(folder, code, id)
    err.print(f"{found.id} is in use again for the {found.side} hand of {code}.")


# --- showing --------------------------------------------------------------------------------------


def _show_subject(calibration: SubjectCalibration) -> None:
    rows = [
        [
            segment.name,
            f"{segment.length_m * 1e3:.1f} ± {segment.length_sd_m * 1e3:.1f} mm",
            segment.length_source,
            segment.source,
            _plausibility(segment.plausible),
        ]
        for segment in calibration.segments
    ]
    out.print()
    columns = ["segment", "length", "length from", "joint from", "against a population"]
    print_table(f"Hand of {calibration.subject}, {calibration.side}", columns, rows)
    rows = [
        [
            centre.joint,
            centre.sensor,
            f"{centre.residual:.2f} m/s²",
            f"{1e3 * math.hypot(*centre.sd_m):.1f} mm",
            " and ".join(f"{each:.0f}" for each in centre.excitation_deg) + " deg",
            f"{centre.condition:.0f}",
        ]
        for centre in calibration.centres
    ]
    out.print()
    columns = ["joint", "from sensor", "left over", "place ±", "moved about two axes", "condition"]
    print_table("Joint centres", columns, rows)


def _plausibility(deviations: float) -> str:
    said = f"{abs(deviations):.1f} SD {'longer' if deviations >= 0.0 else 'shorter'} than the mean"
    if abs(deviations) > _UNLIKELY:
        return f"{said}: hardly any hand, measure it with a ruler"
    return f"{said}: unusual" if abs(deviations) > _UNUSUAL else said


def _show_what_to_repeat(found: Calibrated, refused: Sequence[str]) -> None:
    out.print()
    if refused:
        out.print(f"Repeat, for they were done badly: {', '.join(refused)}")
    better = [step for step in found.to_repeat if step not in refused]
    if better:
        out.print(f"Would make it better: {', '.join(better)}")
    if not found.to_repeat:
        out.print("Nothing needs to be repeated.")


def _say_kept(kept: Path | None, dry_run: bool) -> None:
    if kept is not None:
        out.print(f"Kept: {kept}")
    elif dry_run:
        out.print("Nothing was kept: a dry run.")
    else:
        err.print("Nothing was kept. Repeat these steps and name all takes, or keep it: --anyway.")


def _show_sensors(
    found: DeviceCalibration,
    names: Sequence[str],
    before: Sequence[Agreement],
    after: Sequence[Agreement],
) -> None:
    known = found.by_name
    rows = []
    for name, was, now in zip(names, before, after, strict=True):
        entry = known.get(name)
        field = entry.residuals.mag if entry is not None and entry.mag_matrix else None
        rows.append(
            [
                name,
                *(_figure(each) for each in (was.acc, now.acc if entry else math.nan)),
                *(_figure(each) for each in (was.gyr, now.gyr if entry else math.nan)),
                "-" if field is None else f"{100.0 * field:.1f} %",
                "found" if entry is not None else "not found: as shipped",
            ]
        )
    out.print()
    columns = ["sensor", "acc before [m/s²]", "after", "gyr before [deg]", "after", "field after"]
    print_table(f"Sensors of {found.device}: what is left, RMS", [*columns, ""], rows)
    out.print(
        "acc: length of gravity over the rests. gyr: where turns carry gravity, bias at rest taken "
        "off. field: length of the magnetic field."
    )


def _figure(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3f}"


def _facts(calibration: SubjectCalibration | None) -> list[str]:
    if calibration is None:
        return ["?"] * 5
    takes = ", ".join(name for name, _ in calibration.takes) or "?"
    origin = f"mirror of {calibration.mirrored_from}" if calibration.mirrored_from else takes
    length = f"{calibration.hand_length_m * 1e3:.0f} mm"
    return [calibration.made_utc, calibration.side, length, calibration.device, origin]


def _state(version: SubjectVersion | DeviceVersion, in_use: bool) -> str:
    if version.problem is not None:
        return version.problem.what
    return "in use" if in_use else ""


def _row(version: SubjectVersion | DeviceVersion, in_use: bool) -> dict[str, object]:
    return {
        "id": version.id,
        "in_use": in_use,
        "problem": None if version.problem is None else version.problem.what,
        "calibration": version.calibration,
    }


def _device_calibrations(folder: Path, serial: str, restore: str, json: bool) -> int:
    if restore:
        restore_device_calibration(folder, serial, restore)
        err.print(f"{restore} is in use again for the sensors of {serial}.")
    loaded, listed = load_device_calibration(folder, serial), device_history(folder, serial)
    if loaded.problem is not None:
        print_error(loaded.problem)
    shown = [
        (each, each.calibration is not None and each.calibration == loaded.calibration)
        for each in listed
    ]
    if json:
        print_json([_row(each, in_use) for each, in_use in shown])
        return 0
    rows = []
    for each, in_use in shown:
        known = each.calibration
        made = ["?", "?", "?"]
        if known is not None:
            takes = ", ".join(source.take for source in known.source)
            made = [known.made_utc, str(len(known.sensors)), takes]
        rows.append([each.id, *made, _state(each, in_use)])
    print_table(
        f"Calibrations of the sensors of {serial}", ["id", "made", "sensors", "from", ""], rows
    )
    return 0
