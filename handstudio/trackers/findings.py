"""What is wrong with tracks, and what can be made good: frozen, mirrored, upside down, no clock.

Numbers only in a finding; `said` makes the sentence of it, with what to do next.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Bool

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.trackers.track import Track

Kind: TypeAlias = Literal[
    "no_clock",  # instants do not rise: share of steps
    "never_seen",  # no pose at all
    "frozen",  # the same pose again and again: for how long [s]
    "hemisphere",  # the place jumped to the other half of the room: how often
    "upside_down",  # the terminal's z points down at the start: angle to up [rad]
    "drop_outs",  # unseen: share of instants
    "exchanged",  # two terminals took each other's place in the middle: how often
    "swapped",  # the upper one turns further than the lower: ratio
    "metal",  # what leads the joint apart goes with the place in the room [m]
]

FROZEN_S = 0.15
FROZEN_FRAMES = 8
"""No tracker tells the same digits so often: even at rest there is noise."""

_JUMP_M = 0.02  # between frames; a fist at 2 m/s and 120 Hz goes 17 mm
_FEW_STEPS = 0.02  # share that may stand still in a stream with a clock
_MANY_UNSEEN = 0.05
_UPSIDE_DOWN = float(np.deg2rad(120.0))
_FURTHER = 1.3


@dataclass(frozen=True, slots=True)
class TrackFinding:
    """Something is wrong.

    Attributes:
        kind: What.
        track: Name of the terminal; of two, ``upper and lower``.
        amount: How much, in the unit that `Kind` tells.
        since_us: When it began first.
        made_good: It was put right and needs nobody.
        stops: No joint can be found with it.
    """

    kind: Kind
    track: str
    amount: float
    since_us: int = 0
    made_good: bool = False
    stops: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """A track as far as it can be put right.

    Attributes:
        track: With what could be made good.
        findings: What is wrong, the gravest first.
        doubted: Instants that are not to be used.
    """

    track: Track
    findings: tuple[TrackFinding, ...]
    doubted: Bool[Array, " n"]


def checked(track: Track) -> Checked:
    """Look at one track by itself."""
    found, doubted = [], np.zeros(len(track.time_us), dtype=bool)
    clock, behind = _clock(track)
    doubted |= behind
    found += clock
    seen = seen_at(track)
    if not seen.any():
        found.append(TrackFinding("never_seen", track.name, 1.0, stops=True))
        return Checked(track, tuple(found), np.ones_like(doubted))
    track, flips = _unflipped(track, seen)
    frozen, still = _frozen(track, seen)
    return Checked(
        track,
        (*found, *frozen, *flips, *_drop_outs(track, seen), *_upside_down(track, seen)),
        doubted | still,
    )


def checked_pair(upper: Track, lower: Track) -> tuple[Checked, Checked, tuple[TrackFinding, ...]]:
    """Look at two tracks of one stream, each by itself and both together."""
    one, other = checked(upper), checked(lower)
    both: list[TrackFinding] = []
    if len(upper.time_us) == len(lower.time_us):
        a, b, exchanged = _unexchanged(one.track, other.track)
        one, other = replace(one, track=a), replace(other, track=b)
        both = [*exchanged, *_swapped(a, b)]
    return one, other, tuple(both)


def seen_at(track: Track) -> Bool[Array, " n"]:
    """Instants with a pose."""
    finite = np.isfinite(track.t_room_terminal).all(axis=1)
    finite &= np.isfinite(track.q_room_terminal).all(axis=1)
    return np.asarray(finite & (track.quality > 0.0))


def _clock(track: Track) -> tuple[list[TrackFinding], Array]:
    step = np.diff(track.time_us)
    behind = np.concatenate([[False], step <= 0])
    share = float(np.mean(step <= 0)) if len(step) else 1.0
    if share == 0.0:
        return [], behind
    first = int(track.time_us[np.argmax(behind)]) if behind.any() else 0
    stops = share > _FEW_STEPS
    return [
        TrackFinding("no_clock", track.name, share, first, made_good=not stops, stops=stops)
    ], behind


def _frozen(track: Track, seen: Array) -> tuple[list[TrackFinding], Array]:
    same = np.zeros(len(seen), dtype=bool)
    pose = np.concatenate([track.t_room_terminal, track.q_room_terminal], axis=1)
    same[1:] = np.all(pose[1:] == pose[:-1], axis=1) & seen[1:]
    still, longest, first = np.zeros_like(same), 0.0, 0
    for start, stop in _runs(same):
        lasts = 1e-6 * float(track.time_us[stop - 1] - track.time_us[start - 1])
        if stop - start >= FROZEN_FRAMES and lasts >= FROZEN_S:
            still[start - 1 : stop] = True
            if lasts > longest:
                longest, first = lasts, int(track.time_us[start - 1])
    if not longest:
        return [], still
    all_of_it = float(still.sum()) > 0.9 * float(seen.sum())
    return [TrackFinding("frozen", track.name, longest, first, stops=all_of_it)], still


def _unflipped(track: Track, seen: Array) -> tuple[Track, list[TrackFinding]]:
    """Places that jumped through the transmitter are put back to where most of them are."""
    at = np.flatnonzero(seen)
    t = track.t_room_terminal[at]
    here, before = t[1:], t[:-1]
    jumped = np.linalg.norm(here - before, axis=1) > _JUMP_M
    mirrored = np.linalg.norm(here + before, axis=1) < 0.3 * np.linalg.norm(here - before, axis=1)
    flips = jumped & mirrored
    if not flips.any():
        return track, []
    sign = np.concatenate([[1.0], np.where(np.cumsum(flips) % 2 == 1, -1.0, 1.0)])
    if np.sum(sign) < 0.0:
        sign = -sign
    place = track.t_room_terminal.copy()
    place[at] = sign[:, None] * t
    first = int(track.time_us[at[1 + int(np.argmax(flips))]])
    finding = TrackFinding("hemisphere", track.name, float(flips.sum()), first, made_good=True)
    return replace(track, t_room_terminal=place), [finding]


def _drop_outs(track: Track, seen: Array) -> list[TrackFinding]:
    share = 1.0 - float(seen.mean())
    if share <= _MANY_UNSEEN:
        return []
    return [TrackFinding("drop_outs", track.name, share, int(track.time_us[np.argmin(seen)]))]


def _upside_down(track: Track, seen: Array) -> list[TrackFinding]:
    """At the start a finger is straight and the palm down; a terminal's cable side is its back."""
    first = np.flatnonzero(seen)[: max(1, int(0.1 * seen.sum()))]
    up = so3.rotate(track.q_room_terminal[first], np.array([0.0, 0.0, 1.0]))[:, 2]
    angle = float(np.arccos(np.clip(np.median(up), -1.0, 1.0)))
    if angle < _UPSIDE_DOWN:
        return []
    # joints are found in the terminals' own frames, which may lie as they like
    return [TrackFinding("upside_down", track.name, angle, made_good=True)]


def _unexchanged(a: Track, b: Track) -> tuple[Track, Track, list[TrackFinding]]:
    both = np.flatnonzero(seen_at(a) & seen_at(b))
    if len(both) < 2:
        return a, b, []
    ta, tb = a.t_room_terminal[both], b.t_room_terminal[both]
    own = np.linalg.norm(np.diff(ta, axis=0), axis=1) + np.linalg.norm(np.diff(tb, axis=0), axis=1)
    other = np.linalg.norm(ta[1:] - tb[:-1], axis=1) + np.linalg.norm(tb[1:] - ta[:-1], axis=1)
    apart = np.linalg.norm(ta - tb, axis=1)[:-1]
    exchanged = (other < 0.3 * own) & (own > apart)
    if not exchanged.any():
        return a, b, []
    odd = np.zeros(len(a.time_us), dtype=bool)
    for index in both[1:][exchanged]:
        odd[index:] = ~odd[index:]
    at = int(a.time_us[both[1:][exchanged][0]])
    one, two = _crossed(a, b, odd), _crossed(b, a, odd)
    name = f"{a.name}, {b.name}"
    count = float(exchanged.sum())
    return one, two, [TrackFinding("exchanged", name, count, at, made_good=True)]


def _crossed(a: Track, b: Track, odd: Array) -> Track:
    return replace(
        a,
        t_room_terminal=np.where(odd[:, None], b.t_room_terminal, a.t_room_terminal),
        q_room_terminal=np.where(odd[:, None], b.q_room_terminal, a.q_room_terminal),
        quality=np.where(odd, b.quality, a.quality),
    )


def _swapped(upper: Track, lower: Track) -> list[TrackFinding]:
    """The terminal beyond the joint turns further than the one before it."""
    both = seen_at(upper) & seen_at(lower)
    if np.count_nonzero(both) < FROZEN_FRAMES:
        return []
    ratio = _turning(upper, both) / max(_turning(lower, both), 1e-6)
    if ratio < _FURTHER:
        return []
    return [TrackFinding("swapped", f"{upper.name}, {lower.name}", ratio)]


def _turning(track: Track, used: Array) -> float:
    q = track.q_room_terminal[used]
    return float(np.sqrt(np.mean(so3.angle_between(q[:1], q) ** 2)))


def _runs(flags: Array) -> list[tuple[int, int]]:
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    return list(
        zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)
    )
