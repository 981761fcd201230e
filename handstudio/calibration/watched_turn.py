"""Whether the whole rig was turned far, fast and stiffly enough."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.heard import ROOT, seconds_of
from handstudio.calibration.movement import STEP_S, Moved, moved_since
from handstudio.calibration.stillness import tremor_of
from handstudio.calibration.verdict import Reading
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_NAN = float("nan")
_CALM, _CALM_S = np.deg2rad(10.0), 0.25  # slower than this [rad/s], for so long, is laid down
_NEAR, _SLOW = np.deg2rad(8.0), np.deg2rad(45.0)  # so near and slow is down, lifted again or not


def watch_turn(
    rest: ImuSamples | None, done: ImuSamples, layout: Layout
) -> tuple[list[Reading], bool]:
    """How far, how stiffly and how fast the rig was turned; whether it is laid back."""
    angle, pace, apart, about, tremor, back = 0.0, 0.0, 0.0, "", 0.0, False
    if seconds_of(done) >= STEP_S:
        moved = moved_since(rest, done, layout)
        angle, pace = _lifted(moved)
        apart, about = _apart(moved)
        tremor, back = tremor_of(done), _laid_back(moved)
    least, slowest, most = demands.TURN_DEG, demands.TURN_PACE, demands.TOGETHER_DEG
    about = about if apart > most else ""
    readings = [
        Reading("turn", angle, least, "deg"),
        Reading("together", apart, most, "deg", at_least=False, about=about),
        Reading("pace", pace, slowest, "1/s"),
        Reading("stillness", tremor, demands.STIFF_DEG_S, "deg/s", at_least=False),
    ]
    return readings, back


def _lifted(moved: Moved) -> tuple[float, float]:
    """How far the rig was turned about a level axis [deg], and how often a second."""
    if not moved.q_world_sensor.shape[1]:
        return _NAN, _NAN
    angle = _angles(moved)
    above = angle > 0.5 * angle.max()
    lifts = int(above[0]) + int(np.count_nonzero(np.diff(above.astype(int)) > 0))
    step_s = float(moved.time_s[-1]) / len(moved.time_s)
    # half the time is spent above half the way
    return float(np.rad2deg(angle.max())), 0.5 * lifts / (step_s * max(1, int(above.sum())))


def _laid_back(moved: Moved) -> bool:
    """Whether the rig came back: it rests, or turns slowly, near where it began."""
    q, step_s = moved.q_world_sensor, float(moved.time_s[-1]) / len(moved.time_s)
    steps = round(_CALM_S / step_s)
    if not q.shape[1] or len(q) <= steps:
        return False
    stepped = so3.log(so3.multiply(so3.conjugate(q[-steps - 1 : -1]), q[-steps:]))
    fast = np.median(np.linalg.norm(stepped, axis=-1), axis=1) / step_s
    angle = _angles(moved)
    rests = fast.max() < _CALM and angle[-1] < 0.5 * angle.max()
    return bool(rests or (fast[-1] < _SLOW and angle[-1] < _NEAR))


def _angles(moved: Moved) -> Float[Array, " m"]:
    """How far the rig is turned about a level axis since the begin [rad]."""
    q = moved.q_world_sensor
    vectors = so3.log(so3.multiply(q, so3.conjugate(q[:1])))
    return np.asarray(np.median(np.linalg.norm(vectors[..., :2], axis=-1), axis=1))


def _apart(moved: Moved) -> tuple[float, str]:
    """How far the joint turned that should have kept still and did least [deg]."""
    inner = [k for k, joint in enumerate(moved.joints) if joint != ROOT[0]]
    if not inner:
        return 0.0, ""
    went = np.rad2deg(np.linalg.norm(moved.turned[:, inner], axis=-1).max(axis=0))
    worst = int(np.argmax(went))
    return float(went[worst]), moved.joints[inner[worst]]
