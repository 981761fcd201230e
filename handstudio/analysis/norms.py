"""Normal active ranges [deg]: what adults reach by their own force.

Rounded as clinicians are taught them (American Academy of Orthopaedic Surgeons; American Society
for Surgery of the Hand); hand/CONVENTIONS.md has the table. A single healthy person may be 10 to 20
deg off.
"""

from __future__ import annotations

from handstudio.hand.skeleton import FINGERS

NORMAL_DEG: dict[str, tuple[float, float]] = {
    "thumb_cmc_flexion": (-20.0, 15.0),
    "thumb_cmc_abduction": (0.0, 70.0),
    "thumb_mcp_flexion": (0.0, 50.0),
    "thumb_ip_flexion": (-20.0, 80.0),
    "wrist_flexion": (-70.0, 80.0),
    "wrist_deviation_ulnar": (-20.0, 30.0),
    **{f"{finger}_mcp_flexion": (-45.0, 90.0) for finger in FINGERS[1:]},
    **{f"{finger}_mcp_abduction": (-20.0, 20.0) for finger in FINGERS[1:]},
    **{f"{finger}_pip_flexion": (0.0, 100.0) for finger in FINGERS[1:]},
    **{f"{finger}_dip_flexion": (0.0, 90.0) for finger in FINGERS[1:]},
}
"""From and to, by angle."""

NORMAL_RANGE_DEG: dict[str, float] = {"forearm_pronation": 160.0}
"""Of angles whose zero is not the clinician's: how far from end to end. Pronation and supination
count from the thumb pointing up there, from the start of the recording here."""


def norms_of(angle: str) -> tuple[float | None, float | None, float | None]:
    """Normal least, most and range [deg] of an angle; None: no figure."""
    if angle in NORMAL_DEG:
        least, most = NORMAL_DEG[angle]
        return least, most, most - least
    return None, None, NORMAL_RANGE_DEG.get(angle)
