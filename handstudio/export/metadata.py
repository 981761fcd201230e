"""What every export carries beside its numbers."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import msgspec
import numpy as np

from handstudio import __version__
from handstudio.health.record import TakeHealth, Trouble
from handstudio.kinematics import has_start
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.recording.take_health import health_of_take
from handstudio.setup import Setup

CONVENTION = (
    "one rotation per joint, intrinsic flexion (about x), deviation (about z), rotation (about y); "
    "clinical signs after ISB; quaternions scalar first; world z up, x to magnetic north"
)


def metadata(take: Take, setup: Setup, motion: Motion, content: str) -> bytes:
    """The sidecar of an export, JSON."""
    header = take.header
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9, UTC)
    health = health_of_take(take)
    fields: dict[str, Any] = {
        "content": content,
        "take": header.name,
        "subject": header.subject,
        "hand_side": setup.layout.side,
        "start_utc": start.isoformat(timespec="milliseconds"),
        "device": msgspec.to_builtins(setup.device),
        "sensor_map": {place.sensor: place.segment for place in setup.layout.sensors},
        "nominal_rate_hz": setup.rate_hz,
        "measured_rate_hz": _measured_rate(motion),
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
    if content == "angles" and has_start(motion):
        fields["elbow_flexion and forearm_pronation"] = (
            "relative to the forearm's attitude at the start (palm down), the upper arm assumed "
            "still: no sensor is on it"
        )
    if content == "positions":
        fields["origin"] = "the elbow, assumed still: its place cannot be observed"
    return msgspec.json.format(msgspec.json.encode(fields))


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


def _measured_rate(motion: Motion) -> float | None:
    if len(motion) < 2:
        return None
    return round(1e6 / float(np.median(np.diff(motion.time_us))), 3)
