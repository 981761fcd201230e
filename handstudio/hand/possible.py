"""How far the joints of a hand go at most."""

from __future__ import annotations

from handstudio.hand.angles import Angle

POSSIBLE_DEG = {
    "mcp_flexion": (-65.0, 115.0),
    "pip_flexion": (-35.0, 135.0),
    "dip_flexion": (-45.0, 115.0),
    "ip_flexion": (-60.0, 115.0),
    "thumb_mcp_flexion": (-50.0, 90.0),
    "mcp_abduction": (-45.0, 45.0),
    "thumb_cmc_flexion": (-60.0, 60.0),
    "thumb_cmc_abduction": (-40.0, 95.0),
    "wrist_flexion": (-95.0, 105.0),
    "wrist_deviation_ulnar": (-45.0, 60.0),
}
"""What joints of healthy hands do not go beyond [deg]: the normal active ranges of AAOS and ASSH
with 20 degrees or more to each side, for lax joints and for an average hand's zero. Beyond, the
first suspect is a sensor that has slipped or a heading that is wrong."""


def possible(angle: Angle) -> tuple[float, float] | None:
    """Least and most [deg] of an angle, by its own name, else by its like on any finger."""
    _finger, _sep, like = angle.name.partition("_")
    return POSSIBLE_DEG.get(angle.name, POSSIBLE_DEG.get(like))
