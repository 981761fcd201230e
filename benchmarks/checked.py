"""Whether a calibration is said to hold where it does, and not where a board has slipped.

The person whose calibration it is does the check some times more, the glove left on. Then the
board of one sensor after the other is turned, as if it had slipped before the check.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.checking import check
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import PARENTS, SEGMENTS
from handstudio.maths import so3

CHECK = "quick_start+flat_hand+open_close"
CHECKS = 4
"""How often each person does the check."""

SLIPS_DEG = (5.0, 10.0)
AXES = 3
"""How many directions each board slips in, at random."""


class Slipped(msgspec.Struct, frozen=True):
    """A check with one board turned.

    Attributes:
        deg: By how much.
        most_deg: What is read of the segment that is furthest off.
        near_deg: And of the slipped board's own and those it carries.
    """

    deg: float
    most_deg: float
    near_deg: float


class Checks(msgspec.Struct, frozen=True):
    """What checks of one calibration read [deg].

    Attributes:
        held: By segment, every time, the glove left on.
        slipped: With boards turned.
    """

    held: tuple[dict[str, float], ...]
    slipped: tuple[Slipped, ...]


def checks(calibration: SubjectCalibration, takes: Sequence[tuple[Swings, slice]]) -> Checks:
    """Hold checks against a calibration, with all boards where they were and with one turned.

    Args:
        calibration: The one in question.
        takes: Each check, prepared, and where in it the hand opened and closed.
    """
    rng = np.random.default_rng(len(takes))
    held = tuple(_read(swings, grasp, calibration) for swings, grasp in takes)
    slipped = []
    for segment in calibration.segments:
        if not segment.sensor or segment.name == "forearm":
            continue
        for swings, grasp in takes[:1]:
            sensor = swings.layout.names.index(segment.sensor)
            for deg in SLIPS_DEG:
                for axis in rng.standard_normal((AXES, 3)):
                    by = so3.from_axis_angle(axis / np.linalg.norm(axis), np.deg2rad(deg))
                    seen = _read(turned(swings, sensor, by), grasp, calibration)
                    near = [seen[name] for name in _near(segment.name) if name in seen]
                    slipped.append(Slipped(deg, max(seen.values()), max(near)))
    return Checks(held, tuple(slipped))


def turned(swings: Swings, sensor: int, by: Array) -> Swings:
    """As if a sensor sat turned on its segment: ``q_world_sensor by``."""
    q, vectors = swings.q_world_sensor.copy(), []
    q[:, sensor] = so3.multiply(q[:, sensor], by)
    for known in (swings.gyr, swings.dgyr, swings.acc):
        other = known.copy()
        other[:, sensor] = so3.rotate(so3.conjugate(by), other[:, sensor])
        vectors.append(other)
    gyr, dgyr, acc = vectors
    return replace(swings, q_world_sensor=q, gyr=gyr, dgyr=dgyr, acc=acc)


def figures(found: Sequence[Checks], limit_deg: float) -> dict[str, Any]:
    """False alarms and slips noticed under a limit [%], and what limits would be had from these."""
    most = np.array([max(one.values()) for each in found for one in each.held])
    every = np.array([x for each in found for one in each.held for x in one.values()])
    slips = [slip for each in found for slip in each.slipped]
    out: dict[str, Any] = {
        "limit_deg": limit_deg,
        "checks": len(most),
        "false_alarm_pct": _share(most > limit_deg),
        "false_alarm_of_segments_pct": _share(every > limit_deg),
        "held_median_deg": float(np.median(most)),
        "held_most_deg": float(most.max()),
    }
    for deg in SLIPS_DEG:
        mine = [slip for slip in slips if slip.deg == deg]
        near = np.array([slip.near_deg for slip in mine])
        out[f"slipped_{deg:.0f}_deg"] = {
            "slips": len(mine),
            "noticed_pct": _share(np.array([slip.most_deg for slip in mine]) > limit_deg),
            "at_the_right_place_pct": _share(near > limit_deg),
            "near_deg": [float(x) for x in np.percentile(near, (10, 50, 90))],
        }
    return out


def _read(swings: Swings, grasp: slice, calibration: SubjectCalibration) -> dict[str, float]:
    return {r.about: r.value for r in check(swings, swings, grasp, calibration).readings}


def _near(segment: str) -> list[str]:
    k = SEGMENTS.index(segment)
    return [segment, *(SEGMENTS[child] for child, parent in enumerate(PARENTS) if parent == k)]


def _share(yes: Array) -> float:
    return float(100.0 * np.mean(yes))
