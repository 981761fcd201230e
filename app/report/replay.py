"""The hand in motion, small enough to lie inside a page: points of its skeleton."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from app import colours
from handstudio.arrays import Array
from handstudio.hand.skeleton import DISTALS, PARENTS, SEGMENTS
from handstudio.hand_fit import fit_of
from handstudio.kinematics import pose_of
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup

FRAMES_HZ = 25.0
MOST_FRAMES = 6000
"""Four minutes; a longer take is shown so far."""

_UNIT_M = 1e-4  # of the numbers that stand in the page


def replay_of(setup: Setup, motion: Motion, start_us: int) -> dict[str, Any]:
    """What the player needs: bones as pairs of points, their colours, and where they are when.

    Places are seen from the wrist and turned by the forearm's mean heading, so that fingers point
    away from the viewer; 16-bit, tenths of a millimetre.
    """
    time_s = (np.asarray(motion.time_us) - start_us) * 1e-6
    wanted = np.arange(time_s[0], time_s[-1] + 1e-9, 1.0 / FRAMES_HZ)[:MOST_FRAMES]
    pick = np.searchsorted(time_s, wanted - 1e-9).clip(0, len(time_s) - 1)
    pose = pose_of(setup, np.asarray(motion.q_world_sensor[pick]), fit_of(setup))
    points = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1)
    along = points[:, SEGMENTS.index("hand")] - points[:, SEGMENTS.index("forearm")]
    heading = float(np.angle(np.nansum(along[:, 0] + 1j * along[:, 1])))
    turned = so3.rotate(so3.about_z(0.5 * np.pi - heading), points - points[:, 1:2])
    whole = np.nan_to_num(turned / _UNIT_M).round().clip(-32768, 32767).astype("<i2")
    bones, shades = _bones()
    return {
        "hz": FRAMES_HZ,
        "frames": len(pick),
        "points": points.shape[1],
        "unit": _UNIT_M,
        "begin": float(wanted[0]),
        "end": float(time_s[-1]),
        "bones": bones,
        "colours": shades,
        "palm": _palm(),
        "data": base64.b64encode(whole.tobytes()).decode(),
    }


def is_cut(replay: dict[str, Any]) -> bool:
    """Whether there is more of the take than is shown."""
    shown = replay["begin"] + replay["frames"] / replay["hz"]
    return bool(replay["end"] > shown + 1.0)


def _bones() -> tuple[list[list[int]], list[str]]:
    bones, shades = [], []
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            bones.append([parent, child])
            shades.append(_shade(SEGMENTS[parent], SEGMENTS[child]))
    for finger, name in enumerate(DISTALS):
        bones.append([SEGMENTS.index(name), len(SEGMENTS) + finger])
        shades.append(_shade(name, name))
    return bones, shades


def _shade(parent: str, child: str) -> str:
    inside = parent.startswith("hand") or child.startswith("hand")
    return colours.css(colours.of_part("forearm" if inside else parent), dark=False)


def _palm() -> list[int]:
    """Corners of the palm, around it."""
    around = ("hand", "thumb_metacarpal", *(f"{f}_proximal" for f in ("index", "middle", "ring")))
    return [SEGMENTS.index(name) for name in (*around, "little_proximal", "hand_ulnar")]


def points_of(replay: dict[str, Any]) -> Array:
    """The places again [m], (frame, point, 3): what the player draws."""
    whole = np.frombuffer(base64.b64decode(replay["data"]), dtype="<i2")
    out: Array = whole.reshape(replay["frames"], replay["points"], 3) * replay["unit"]
    return out
