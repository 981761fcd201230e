"""From two tracks to joints: checked, found by any of the methods, judged; what a page can draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.estimate import (
    JointEstimate,
    apart_m,
    at_each,
    functional_axis,
    independent,
)
from handstudio.trackers.findings import TrackFinding, checked_pair
from handstudio.trackers.methods import METHODS, Method, estimated
from handstudio.trackers.pair import Pair, pair_of
from handstudio.trackers.poses import placed
from handstudio.trackers.said import said
from handstudio.trackers.steady_axis import WIDTH, SteadyAxis, steady_axis
from handstudio.trackers.track import Track

REST_S = 3.0
"""How long a finger is held straight where nobody says."""

FAR_APART_M = 0.003
UNSURE_M = 0.002
LITTLE_BEND = float(np.deg2rad(35.0))
METAL_M = 0.0005

_CLOUD = 2000  # points that are enough to draw


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A joint by one method, with what tells how good it is.

    Attributes:
        estimate: Where it is.
        apart_m: Mean distance from P_U to P_L over all frames.
        from_upper_m: P_U from the upper terminal, in the room's axes, the finger straight.
        lower_from_upper_m: P_L likewise.
    """

    estimate: JointEstimate
    apart_m: float
    from_upper_m: Float[Array, "3"]
    lower_from_upper_m: Float[Array, "3"]


@dataclass(frozen=True, slots=True, eq=False)
class JointStudy:
    """Everything there is to show of a joint that was bent.

    Attributes:
        upper: Name of the terminal nearer to the hand.
        lower: Of the one beyond the joint.
        frames: How many were used.
        bend_rad: How far the joint was bent, from the 5th to the 95th percentile.
        axis_cloud: Unit axes of turns in the room's axes at rest, across the finger positive.
        angle_cloud: Turn of each [rad].
        class_counts: Frames by the axis' share across the finger, 0 to 1 in equal classes.
        fullest: Index of the fullest class.
        found: By method, in the order asked for.
        refused: Methods that refuse, and why.
        findings: What is wrong with the tracks.
        poor: What makes the chosen (first) one doubtful; empty: it is good.
        width: Unit axis across the finger that shares and signs of axes are by.
    """

    upper: str
    lower: str
    frames: int
    bend_rad: float
    axis_cloud: Float[Array, "m 3"]
    angle_cloud: Float[Array, " m"]
    class_counts: Int64[Array, " c"]
    fullest: int
    found: dict[str, Found]
    refused: dict[str, TrackError]
    findings: tuple[TrackFinding, ...]
    poor: tuple[TrackError, ...]
    width: Float[Array, "3"]

    @property
    def ok(self) -> bool:
        """Whether the first method's joint can be used as it is."""
        return bool(self.found) and not self.poor


def study(
    upper: Track,
    lower: Track,
    *,
    rest: Bool[Array, " n"] | None = None,
    moving: Bool[Array, " n"] | None = None,
    methods: Sequence[Method] = tuple(METHODS.values()),
    width: Float[Array, "3"] = WIDTH,
) -> JointStudy:
    """Find the joint between two terminals.

    Args:
        upper: The terminal nearer to the hand.
        lower: The one beyond the joint.
        rest: While the finger was straight: the first three seconds unless told.
        moving: While it was bent: all after that unless told.
        methods: Ways to find it; the verdict is on the first.
        width: Across the finger in the tracker's axes while it is straight.

    Raises:
        TrackError: what is wrong with the tracks leaves nothing to find a joint from.
    """
    one, other, both = checked_pair(upper, lower)
    findings = (*one.findings, *other.findings, *both)
    for finding in findings:
        if finding.stops:
            raise said(finding)
    time_us = one.track.time_us
    rest = time_us < time_us[0] + round(1e6 * REST_S) if rest is None else rest
    moving = ~rest if moving is None else moving
    doubted = one.doubted | other.doubted if len(one.doubted) == len(other.doubted) else None
    pair = pair_of(one.track, other.track, rest, moving, doubted)
    axes = steady_axis(pair, width=width)
    found: dict[str, Found] = {}
    refused: dict[str, TrackError] = {}
    for method in methods:
        try:
            found[method.name] = _found(pair, estimated(pair, method, width=width))
        except TrackError as error:
            refused[method.name] = error
    best = next(iter(found.values()), None)
    if best is not None:
        findings = (*findings, *_metal(pair, best.estimate, upper.name, lower.name))
    across = np.asarray(width / np.linalg.norm(width))
    return _put_together(
        pair, axes, (upper.name, lower.name), (found, refused), findings, width=across
    )


def bend_of(pair: Pair) -> float:
    """How far the joint was bent [rad]."""
    flexion = functional_axis(pair)[2]
    low, high = np.percentile(flexion, [5.0, 95.0])
    return float(high - low)


def _found(pair: Pair, estimate: JointEstimate) -> Found:
    lower = placed(pair.rest_q_upper_lower, pair.rest_t_upper_lower, estimate.p_lower)
    upper, lower = (
        so3.rotate(pair.rest_q_room_upper, point) for point in (estimate.p_upper, lower)
    )
    return Found(estimate, apart_m(estimate, pair), upper, lower)


def _metal(pair: Pair, estimate: JointEstimate, upper: str, lower: str) -> tuple[TrackFinding, ...]:
    """How much of what leads P_U and P_L apart goes with where the terminals are in the room.

    Only of an arm that moves: in one place metal turns and shifts both terminals for good, and
    nothing in their poses tells.
    """
    one, other = at_each(estimate, pair)
    left = one - other
    place = pair.t_room_upper - pair.t_room_upper.mean(axis=0)
    flexion = (pair.turn @ functional_axis(pair)[0])[:, None]
    own = np.concatenate([np.ones_like(flexion), flexion, flexion**2, flexion**3], axis=1)
    left = left - own @ np.linalg.lstsq(own, left, rcond=None)[0]
    place = place - own @ np.linalg.lstsq(own, place, rcond=None)[0]
    slopes = np.linalg.lstsq(place, left, rcond=1e-3)[0]
    explained = place @ slopes
    amount = float(np.sqrt(np.mean(np.sum(explained**2, axis=1))))
    rest = float(np.sqrt(np.mean(np.sum((left - explained) ** 2, axis=1))))
    # three slopes explain that much of any residual
    by_chance = rest * np.sqrt(9.0 / max(independent(left), 9.0))
    if amount < max(METAL_M, 2.0 * by_chance):
        return ()
    return (TrackFinding("metal", f"{upper}, {lower}", amount),)


def _put_together(
    pair: Pair,
    axes: SteadyAxis,
    names: tuple[str, str],
    results: tuple[dict[str, Found], dict[str, TrackError]],
    findings: tuple[TrackFinding, ...],
    *,
    width: Float[Array, "3"],
) -> JointStudy:
    shown = np.flatnonzero(np.isfinite(axes.along))
    shown = shown[:: max(1, -(-len(shown) // _CLOUD))]
    bend = bend_of(pair)
    found, refused = results
    return JointStudy(
        *names,
        len(pair),
        bend,
        axes.axes[shown],
        axes.angle[shown],
        axes.counts,
        axes.fullest,
        found,
        refused,
        findings,
        tuple(_poor(bend, next(iter(found.values()), None), refused)),
        width,
    )


def _poor(bend: float, best: Found | None, refused: dict[str, TrackError]) -> list[TrackError]:
    if best is None:
        return list(refused.values())[:1]
    out = []
    if bend < LITTLE_BEND:
        out.append(
            TrackError(
                "The joint was bent by {found:.0f} deg; {least:.0f} would tell its place well.",
                "Bend it as far as it goes, and stretch it, for 20 s.",
                found=float(np.rad2deg(bend)),
                least=float(np.rad2deg(LITTLE_BEND)),
            )
        )
    if best.apart_m > FAR_APART_M:
        out.append(
            TrackError(
                "The two terminals place the joint {found:.1f} mm apart; up to {most:.0f} mm is "
                "usual.",
                "Fix the terminals better, keep cables off them, and bend slowly.",
                found=1e3 * best.apart_m,
                most=1e3 * FAR_APART_M,
            )
        )
    if best.estimate.sd_m > UNSURE_M:
        out.append(
            TrackError(
                "The joint's place is known to {found:.1f} mm only; {most:.0f} mm is usual.",
                "Bend it further and for longer.",
                found=1e3 * best.estimate.sd_m,
                most=1e3 * UNSURE_M,
            )
        )
    return out
