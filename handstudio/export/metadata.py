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
        "zero": setup.zero,
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
