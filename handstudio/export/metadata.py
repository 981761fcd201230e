"""What every export carries beside its numbers."""

from __future__ import annotations

from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np

from handstudio import __version__
from handstudio.arrays import Array
from handstudio.health.record import TakeHealth, Trouble
from handstudio.kinematics import has_start
from handstudio.pipeline import Doubt, Motion
from handstudio.recording.take import Take
from handstudio.recording.take_health import health_of_take
from handstudio.rooted import Root
from handstudio.setup import Setup

CONVENTION = (
    "one rotation per joint, intrinsic flexion (about x), deviation (about z), rotation (about y); "
    "clinical signs after ISB; quaternions scalar first; world z up, x to magnetic north"
)

_JUMP = 1.5  # usual steps: a longer one means that instants are missing
_MOST = 1000  # stretches that are listed


def of_take(take: Take, setup: Setup) -> dict[str, Any]:
    """What is the same for every window and format of a take."""
    header = take.header
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9, UTC)
    health = health_of_take(take)
    return {
        "take": header.name,
        "subject": header.subject,
        "hand_side": setup.layout.side,
        "start_utc": start.isoformat(timespec="milliseconds"),
        "device": msgspec.to_builtins(setup.device),
        "sensor_map": {place.sensor: place.segment for place in setup.layout.sensors},
        "nominal_rate_hz": setup.rate_hz,
        "loss_percent": _loss_percent(take, health),
        "findings": [_told(trouble, setup) for trouble in health.troubles],
        "calibration": setup.calibration,
        "calibration_made": _subject_made(setup),
        "calibration_residuals": _joint_residuals(setup),
        "zero": setup.zero,
        "zero_source": _zero_source(setup),
        "sensor_calibration": _sensors_made(setup),
        "heading_alignment_deg": _headings(setup),
        "convention": CONVENTION,
        "filter": msgspec.to_builtins(setup.filter),
        "hand_length_m": setup.hand.hand_length_m,
        "software": f"handstudio {__version__}",
        "recorded_with": f"handstudio {header.software}",
        "raw_file": take.path.name,
        "raw_sha256": take.sha256(),
    }


def of_part(setup: Setup, motion: Motion, start_us: int, content: str) -> dict[str, Any]:
    """What is of one window: its times, its gaps, what is in doubt where.

    Args:
        setup: What the motion was computed by.
        motion: The instants of the window, at least one.
        start_us: The take's first instant, from which seconds count.
        content: What of the motion is written.
    """
    time_s = _seconds(motion.time_us - start_us)
    fields: dict[str, Any] = {
        "content": content,
        "window_s": [time_s[0], time_s[-1]],
        "instants": len(motion),
        "measured_rate_hz": _measured_rate(motion),
        "missing": missing(setup, motion),
        "gaps_s": _gaps(motion, time_s),
        "doubtful_s": _doubtful(setup, motion, time_s),
    }
    if content in ("angles", "motion") and has_start(motion):
        fields["elbow_flexion and forearm_pronation"] = (
            "relative to the forearm's attitude at the start (palm down), the upper arm assumed "
            "still: no sensor is on it"
        )
    if content in ("positions", "skeleton", "motion") and setup.layout.is_hand:
        fields["origin"] = "the elbow, assumed still: its place cannot be observed"
    return fields


def of_root(root: Root, motion: Motion) -> dict[str, Any]:
    """What places in a tracker's room stand on; it takes the place of the elbow as origin."""
    inside = np.searchsorted(root.time_us, motion.time_us)
    unknown = ~np.isfinite(root.t_room_elbow[inside, 0])
    return {
        "origin": "the tracker's own, in its own frame: places are in its room",
        "track": msgspec.to_builtins(root.facts),
        "without_a_place_percent": round(100.0 * float(np.mean(unknown)), 2),
    }


def missing(setup: Setup, motion: Motion) -> list[str]:
    """What a reader might look for and not find, in English sentences; also why."""
    told = []
    if not setup.layout.is_hand:
        told.append(setup.layout.missing_for_hand)
    elif setup.subject is None:
        told.append(
            "No calibration of the wearer: sensors are taken to sit squarely on their segments, "
            "the hand to have mean proportions."
        )
    if setup.layout.is_hand and not has_start(motion):
        told.append(
            "No rest from which elbow_flexion and forearm_pronation could count: they are absent."
        )
    if gaps := _gaps(motion, _seconds(motion.time_us - motion.time_us[:1])):
        gone = sum(end - begin for begin, end in gaps)
        told.append(f"{len(gaps)} gaps, {gone:.2f} s in all: nothing is filled in for them.")
    return told


def _subject_made(setup: Setup) -> dict[str, Any] | None:
    """Where the subject calibration is from; None: proportions only."""
    subject = setup.subject
    if subject is None:
        return None
    return {
        "id": subject.id,
        "made_utc": subject.made_utc,
        "software": subject.software,
        "device": subject.device,
        "takes": dict(subject.takes),
        "mirrored_from": subject.mirrored_from or None,
    }


def _joint_residuals(setup: Setup) -> list[dict[str, Any]] | None:
    """What was left of the accelerations that joint centres were found by."""
    if setup.subject is None:
        return None
    return [
        {
            "joint": centre.joint,
            "sensor": centre.sensor,
            "residual_m_s2": centre.residual,
            "place_sd_mm": [round(1e3 * sd, 3) for sd in centre.sd_m],
        }
        for centre in setup.subject.centres
    ]


def _zero_source(setup: Setup) -> str:
    """What says where the zero of the angles is."""
    subject = setup.subject
    if subject is None:
        return "maker"
    return "mirror of the other hand" if subject.mirrored_from else "calibration"


def _sensors_made(setup: Setup) -> dict[str, Any] | None:
    """Where the sensors' corrections are from; None: sensors as shipped."""
    sensors = setup.sensors
    if sensors is None:
        return None
    return {
        "device": sensors.device,
        "made_utc": sensors.made_utc,
        "software": sensors.software,
        "takes": {source.take: source.sha256 for source in sensors.source},
        "sensors": [sensor.name for sensor in sensors.sensors],
        "residuals": {
            sensor.name: {
                "acc_m_s2": sensor.residuals.acc,
                "gyr_deg": float(np.rad2deg(sensor.residuals.gyr)),
                "mag_percent": None if sensor.residuals.mag is None else 100 * sensor.residuals.mag,
            }
            for sensor in sensors.sensors
        },
    }


def _headings(setup: Setup) -> dict[str, float] | None:
    """By how much each sensor was turned about the vertical; None: not at all."""
    if not setup.heading_rad:
        return None
    degrees = np.rad2deg(setup.heading_rad).tolist()
    return dict(zip(setup.layout.names, degrees, strict=True))


def _loss_percent(take: Take, health: TakeHealth) -> float | None:
    """None of an import, which does not tell. What was known live comes first."""
    if take.header.kind == "samples":
        return None
    summary = take.summary
    if summary is not None and summary.packets:
        lost, sent = summary.missing, summary.packets + summary.missing
        return round(100.0 * lost / sent, 4)
    return round(health.loss_percent, 4) if health.instants else None


def _told(trouble: Trouble, setup: Setup) -> dict[str, Any]:
    names = [setup.layout.names[sensor] for sensor in trouble.sensors]
    return {
        "kind": trouble.kind,
        "level": trouble.level,
        "sensors": names,
        "times": trouble.times,
        "seconds": trouble.seconds,
        "worst": round(trouble.worst, 3),
        "unit": trouble.unit,
    }


def _seconds(time_us: Array) -> list[float]:
    return [float(each) for each in np.round(time_us * 1e-6, 6)]


def _gaps(motion: Motion, time_s: list[float]) -> list[list[float]]:
    """The last instant before and the first after each stretch that is missing."""
    if len(motion) < 2:
        return []
    steps = np.diff(motion.time_us)
    after = np.flatnonzero(steps > _JUMP * np.median(steps)) + 1
    return [[time_s[k - 1], time_s[k]] for k in after[:_MOST]]


def _doubtful(setup: Setup, motion: Motion, time_s: list[float]) -> dict[str, Any]:
    """First and last instant of each stretch in which a sensor is in doubt, and why."""
    told: dict[str, Any] = {}
    for sensor, name in enumerate(setup.layout.names):
        doubt = np.asarray(motion.doubt[:, sensor])
        edges = np.flatnonzero(np.diff(doubt)) + 1
        bounds = [0, *edges.tolist(), len(doubt)]
        stretches = [
            [time_s[begin], time_s[end - 1], _why(int(doubt[begin]))]
            for begin, end in pairwise(bounds)
            if doubt[begin]
        ]
        if stretches:
            told[name] = stretches[:_MOST]
    return told


def _why(doubt: int) -> str:
    return ", ".join(flag.name.lower() for flag in Doubt if flag in Doubt(doubt) and flag.name)


def _measured_rate(motion: Motion) -> float | None:
    if len(motion) < 2:
        return None
    return round(1e6 / float(np.median(np.diff(motion.time_us))), 3)
