"""What every export carries beside its numbers."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import msgspec
import numpy as np

from handstudio import __version__
from handstudio.kinematics import has_start
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.setup import Setup

CONVENTION = (
    "one rotation per joint, intrinsic flexion (about x), deviation (about z), rotation (about y); "
    "clinical signs after ISB; quaternions scalar first; world z up, x to magnetic north"
)


def metadata(take: Take, setup: Setup, motion: Motion, content: str) -> bytes:
    """The sidecar of an export, JSON."""
    header, summary = take.header, take.summary
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9, UTC)
    sent = (summary.packets + summary.missing) if summary else 0
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
        "loss_percent": round(100.0 * summary.missing / sent, 4) if summary and sent else None,
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


def _measured_rate(motion: Motion) -> float | None:
    if len(motion) < 2:
        return None
    return round(1e6 / float(np.median(np.diff(motion.time_us))), 3)
