"""What came of a check, a quick start, the sensors or their noise, as the page shows it. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from app.views.pieces import AMBER, GREEN, RED, big, line, sentence, small, table
from app.views.steps import failing_of, figure_of, joint_name
from app.words import _
from app.work.solving import Answer
from handstudio.calibrate import Calibrated
from handstudio.calibrate_sensors import SensorsFound
from handstudio.calibration.allan import AxisNoise, Density, mean_of
from handstudio.calibration.heading import HeadingAlignment
from handstudio.calibration.noise import Noise
from handstudio.calibration.verdict import Verdict
from handstudio.check import Checked
from handstudio.samples import STANDARD_GRAVITY


def answer_of(answer: Answer) -> str:
    """The sheet of a result, as HTML; a hand's calibration has one of its own."""
    match answer:
        case Checked():
            return _checked(answer)
        case HeadingAlignment():
            return _aligned(answer)
        case SensorsFound():
            return _sensors(answer)
        case Noise():
            return _noise(answer)
        case Calibrated():
            return ""


def _checked(checked: Checked) -> str:
    verdict, made = checked.verdict, checked.calibration.made_utc
    of = small(_("The calibration of {made} was checked.").format(made=day_of(made)))
    if verdict.ok:
        head = big("✓", GREEN, sentence(_("It still holds."), GREEN) + of)
    else:
        advice = _("Move the sensors back to where they were, or calibrate this hand again.")
        words = sentence(_("It does not hold any more."), AMBER)
        head = big("✗", AMBER, words + line(advice) + of)
    rows = [
        (
            "" if reading.ok else AMBER,
            (
                joint_name(reading.about),
                figure_of(reading.value, reading.unit),
                f"≤ {figure_of(reading.limit, reading.unit)}",
                "✓" if reading.ok else "✗",
            ),
        )
        for reading in verdict.readings
    ]
    return head + table((_("Segment"), _("Moved by"), _("Limit"), ""), rows)


def _aligned(found: HeadingAlignment) -> str:
    turns = np.rad2deg(np.array(found.psi_cor))
    known = [sd for sd in found.sd if math.isfinite(sd)]
    middle = np.rad2deg(float(np.median(known))) if known else math.nan
    told = _("Compasses disagreed by {scatter} (SD); headings are now known to {sd}.").format(
        scatter=figure_of(float(np.std(turns)), "deg"), sd=figure_of(float(middle), "deg")
    )
    good = _("Headings aligned."), _("Headings are as before.")
    head = _head(found.verdict, good, line(told) if found.verdict.ok else "")
    rows = [
        (
            AMBER if out else "",
            (name, f"{turn:+.1f}°", f"± {figure_of(float(np.rad2deg(sd)), 'deg')}")
            if math.isfinite(sd)
            else (name, "–", _("did not answer")),
        )
        for name, turn, sd, out in zip(found.names, turns, found.sd, found.outlying, strict=True)
    ]
    return head + table((_("Sensor"), _("Turned by"), _("Standard deviation")), rows)


def _sensors(found: SensorsFound) -> str:
    words = _("The sensors are calibrated."), _("The sensors stay as they were known before.")
    head = _head(found.verdict, words, "")
    entries = found.calibration.by_name
    rows = [
        (
            "" if name in entries else AMBER,
            (
                name,
                f"{_two(before.acc)} → {_two(after.acc)} m/s²",
                f"{_two(before.gyr)} → {_two(after.gyr)}°",
                _("yes") if name in entries else _("no"),
            ),
        )
        for name, before, after in zip(found.names, found.before, found.after, strict=True)
    ]
    titles = (_("Sensor"), _("Gravity, off by"), _("After turns, off by"), _("Calibrated"))
    return head + table(titles, rows)


def _noise(noise: Noise) -> str:
    minutes = sum(noise.durations_s) / 60.0
    told = _("{minutes:.0f} min at {rate:g} Hz; means of three axes, with 95 % intervals.").format(
        minutes=minutes, rate=noise.rate_hz
    )
    head = big("✓", GREEN, sentence(_("Noise of the sensors."), GREEN) + line(told))
    rows = [
        (
            "",
            (
                sensor.sensor,
                _density([axis.white for axis in sensor.gyr], 180.0 / math.pi),
                _density([axis.walk for axis in sensor.gyr], 180.0 / math.pi),
                _density([axis.white for axis in sensor.acc], 1e3 / STANDARD_GRAVITY),
                f"{_misfit(sensor.gyr):.1f}, {_misfit(sensor.acc):.1f}",
            ),
        )
        for sensor in noise.sensors
    ]
    rows += [(AMBER, (name, _("silent or stuck"), "", "", "")) for name in noise.left_out]
    titles = (
        _("Sensor"),
        _("Gyroscope, white [°/√s]"),
        _("walk [°/s√s]"),
        _("Accelerometer [mg√s]"),
        _("Misfit"),
    )
    return head + table(titles, rows)


def _head(verdict: Verdict, words: tuple[str, str], told: str) -> str:
    """Good or not, and why not."""
    if verdict.ok:
        return big("✓", GREEN, sentence(words[0], GREEN) + told)
    why = "".join(line(failing_of(reading)) for reading in verdict.failing[:3])
    return big("✗", RED, sentence(words[1], RED) + why)


def day_of(made_utc: str) -> str:
    """A time of a file as people read it, to the minute."""
    return made_utc[:16].replace("T", " ")


def _two(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3f}" if value < 0.1 else f"{value:.2f}"


def _density(axes: Sequence[Density], unit: float) -> str:
    mean = mean_of(axes)
    if not mean.distinct:
        return f"< {unit * mean.high:.2g}"
    return f"{unit * mean.value:.3g} ({unit * mean.low:.2g}–{unit * mean.high:.2g})"


def _misfit(axes: Sequence[AxisNoise]) -> float:
    return max(axis.misfit for axis in axes)
