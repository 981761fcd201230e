"""How a tracker's terminal sits on a glove: on which sensor, and in which attitude and place."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from handstudio.arrays import Array
from handstudio.errors import CalibrationError
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup
from handstudio.trackers import late_root
from handstudio.trackers.late_align import Alignment, align
from handstudio.trackers.late_root import RootFilter
from handstudio.trackers.track import Track

AGAIN_S = (-0.1, 0.1)
"""A track that is aligned already may be shifted by so much by another setup."""

_FIXED_RAD = 0.1  # a terminal whose attitude differs by more is not on that sensor
_BAD = np.uint8(Doubt.UNPLACED | Doubt.SILENT)
_ALIKE_RAD = 0.005
_LEVER_SD_M = 0.03


def best_sensor(
    setup: Setup,
    motion: Motion,
    track: Track,
    wanted: str | None,
    search_s: tuple[float, float],
) -> tuple[Alignment, str]:
    """The sensor whose attitude stays with the terminal's, and how the two are aligned.

    The first that turns alike tells the clock; the others are held against it with that.
    """
    names, found = setup.layout.names, dict[str, Alignment]()
    first = [] if wanted is None else [wanted]
    refused: CalibrationError | None = None
    for name in [*first, *(n for n in names if n not in first)]:
        if wanted in found and found[wanted].residual_rad <= _FIXED_RAD:
            break
        try:
            found[name] = align(*attitudes(setup, motion, names.index(name)), track, search_s)
            if len(found) == 1:
                clock_s = found[name].delay_s
                search_s = clock_s + AGAIN_S[0], clock_s + AGAIN_S[1]
        except CalibrationError as error:
            refused = refused or error
    if not found:
        assert refused is not None  # there is a sensor
        raise refused
    least = min(each.residual_rad for each in found.values())
    # boards beside each other turn alike: of those that nothing tells apart, nearest to the root
    best = min(
        (name for name, each in found.items() if each.residual_rad <= least + _ALIKE_RAD),
        key=lambda name: _depth(setup, name),
    )
    chosen = wanted or best
    if chosen not in found or found[chosen].residual_rad > _FIXED_RAD:
        raise CalibrationError(
            "The terminal {terminal} does not stay with {sensor}; of all it stays best with "
            "{best}, within {degrees:.1f} deg.",
            "Name the sensor it sits on; were two terminals exchanged?",
            terminal=track.name,
            sensor=chosen,
            best=best,
            degrees=float(np.rad2deg(found[best].residual_rad)),
        )
    return found[chosen], chosen


def _depth(setup: Setup, sensor: str) -> int:
    """How far a sensor's segment is from the root, in the order of segments."""
    segment = setup.layout.sensors[setup.layout.names.index(sensor)].segment
    return SEGMENTS.index(segment) if segment in SEGMENTS else len(SEGMENTS)


def filter_of(found: Alignment, lever: tuple[float, float, float] | None) -> RootFilter:
    """The filter that goes on from an alignment; a lever that is not known is estimated."""
    sd = _LEVER_SD_M if lever is None else 0.0
    like = RootFilter(t_sensor_terminal=lever or (0.0, 0.0, 0.0), lever_sd=sd, delay_sd=0.01)
    return late_root.filter_for(found, like)


def tells(motion: Motion, k: int) -> Bool[Array, " n"]:
    """Whether the attitude of one sensor tells something, instant by instant."""
    told: Array = (motion.doubt[:, k] & _BAD) == 0
    return told


def attitudes(setup: Setup, motion: Motion, k: int) -> tuple[Array, Array]:
    """Times [us] and attitudes of one sensor, as far as they tell something."""
    placed = tells(motion, k)
    return np.array(motion.time_us[placed]), in_time(setup, motion.q_world_sensor[:, k])[placed]


def in_time(setup: Setup, q: Array) -> Array:
    """Attitudes of the instants they are said to be of.

    VQF adds the newest rate for the whole interval that it ends, so it is half an interval ahead
    where rates are of an instant; at 10 rad/s and 100 Hz that is 3 degrees.
    """
    q = np.array(q)
    if is_in_time(setup) or len(q) < 2:
        return q
    before, now = q[:-1], q[1:]
    near = np.sum(before * now, axis=-1, keepdims=True) < 0.0
    q[1:] = so3.normalize(now + np.where(near, -before, before))
    return q


def is_in_time(setup: Setup) -> bool:
    """Whether the filter's attitudes are of their instants as they come."""
    return not isinstance(setup.filter, VqfFilter) or setup.mean_rates
