"""What the calibrations of a take say of themselves: where from, how old, how well they fit."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from app.report.names import about_name
from app.words import _
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.setup import Setup


@dataclass(frozen=True, slots=True)
class Listing:
    """Facts, and tables of figures below them."""

    title: str
    facts: tuple[tuple[str, str], ...]
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    warning: str = ""


def certificate_of(setup: Setup, recorded: datetime | None) -> list[Listing]:
    """Of the hand, its joints and segments, the sensors, and the headings."""
    out = []
    if setup.subject is None:
        nothing = _(
            "No calibration of the hand: joint centres and axes are those of an average hand of "
            "this length, and sensors count as mounted along their segments. Angles may be off by "
            "8° and more."
        )
        out.append(Listing(_("The hand"), (), warning=nothing))
    else:
        out += [_hand(setup, setup.subject, recorded), _joints(setup.subject)]
        out.append(_segments(setup.subject))
    out.append(_sensors(setup.sensors, recorded))
    return out


def _hand(setup: Setup, subject: SubjectCalibration, recorded: datetime | None) -> Listing:
    steps = subject.verdicts
    bad = [verdict.step for verdict in steps if not verdict.ok]
    good = _("{good} of {all} steps were good").format(good=len(steps) - len(bad), all=len(steps))
    facts = [
        (_("Calibration"), subject.id),
        (_("Made"), f"{_day(subject.made_utc)} ({_age(subject.made_utc, recorded)})"),
        (_("Glove"), subject.device or "–"),
        (_("From"), ", ".join(Path(name).stem for name, _sha in subject.takes) or "–"),
        (_("Software"), subject.software or "–"),
    ]
    if subject.mirrored_from:
        facts.append((_("Mirrored from"), subject.mirrored_from))
    if steps:
        facts.append((_("Steps"), good))
    warnings = []
    worn = setup.device.serial_number if setup.device is not None else ""
    if subject.device and worn and subject.device != worn:
        other = _(
            "The take is of the glove {worn}, the calibration of {other}: sensors sit otherwise."
        )
        warnings.append(other.format(worn=worn, other=subject.device))
    if bad:
        warnings.append(_("Not as it should be: {steps}.").format(steps=", ".join(bad)))
    return Listing(_("The hand"), tuple(facts), warning=" ".join(warnings))


def _joints(subject: SubjectCalibration) -> Listing:
    """Of each joint the sensor that sees its centre best."""
    best = dict[str, tuple[float, float, float, str]]()
    for centre in subject.centres:
        sd = 1e3 * float(np.linalg.norm(centre.sd_m))
        found = sd, centre.residual, centre.excitation_deg[0], centre.sensor
        if centre.joint not in best or found[0] < best[centre.joint][0]:
            best[centre.joint] = found
    axes = dict[str, float]()
    for axis in subject.axes:
        axes[axis.joint] = min(np.rad2deg(axis.sd_rad), axes.get(axis.joint, np.inf))
    rows = tuple(
        (
            _joint(joint),
            sensor,
            f"{sd:.1f}",
            f"{axes[joint]:.1f}" if joint in axes else "–",
            f"{residual:.2f}",
            f"{moved:.0f}",
        )
        for joint, (sd, residual, moved, sensor) in best.items()
    )
    columns = (
        _("Joint"),
        _("Seen by"),
        _("Centre, SD [mm]"),
        _("Axis, SD [°]"),
        _("Residual [m/s²]"),
        _("Moved by [°]"),
    )
    return Listing(_("Joint centres and axes"), (), columns, rows)


def _segments(subject: SubjectCalibration) -> Listing:
    sources = {
        "measured": _("measured"),
        "with prior": _("measured, with proportions"),
        "proportions": _("proportions"),
    }
    rows = tuple(
        (
            _segment(each.name),
            each.sensor or "–",
            f"{1e3 * each.length_m:.1f} ± {1e3 * each.length_sd_m:.1f}",
            sources[each.length_source],
            f"{each.plausible:+.1f}".replace("-", "−"),
        )
        for each in subject.segments
    )
    columns = (
        _("Segment"),
        _("Sensor"),
        _("Length [mm]"),
        _("Source"),
        _("From the mean [SD of people]"),
    )
    return Listing(_("Segments"), (), columns, rows)


def _sensors(sensors: DeviceCalibration | None, recorded: datetime | None) -> Listing:
    title = _("The sensors")
    if sensors is None:
        shipped = _("No calibration of the sensors: as they were shipped, scales may be 3 % off.")
        return Listing(title, (), warning=shipped)
    facts = (
        (_("Glove"), sensors.device or "–"),
        (_("Made"), f"{_day(sensors.made_utc)} ({_age(sensors.made_utc, recorded)})"),
    )
    rows = tuple(
        (
            each.name,
            f"{each.residuals.acc:.3f}",
            f"{np.rad2deg(each.residuals.gyr):.2f}",
            "–" if each.residuals.mag is None else f"{100.0 * each.residuals.mag:.1f}",
        )
        for each in sensors.sensors
    )
    columns = (
        _("Sensor"),
        _("Gravity, residual [m/s²]"),
        _("Turn, residual [°]"),
        _("Field, residual [%]"),
    )
    return Listing(title, facts, columns, rows)


def _joint(joint: str) -> str:
    return about_name(f"{joint}_")


def _segment(name: str) -> str:
    first, _sep, rest = name.partition("_")
    if name == "hand_ulnar":
        return _("Edge of the palm")
    parts = {
        "metacarpal": _("metacarpal"),
        "proximal": _("proximal"),
        "intermediate": _("middle phalanx"),
        "distal": _("distal"),
    }
    whole = {"hand": _("Palm")}.get(name)
    return whole or " ".join(filter(None, [about_name(f"{first}_"), parts.get(rest, rest)]))


def _day(utc: str) -> str:
    return utc[:10] or "–"


def _age(made_utc: str, recorded: datetime | None) -> str:
    """How old it was when the take was recorded."""
    try:
        made = datetime.fromisoformat(made_utc)
    except ValueError:
        made = None
    if made is None or made.tzinfo is None or recorded is None:
        return _("of unknown age")
    days = (recorded - made).days
    if days < 0:
        return _("made after this take")
    return _("{days} d before this take").format(days=days)
