"""The way a hand went in a tracker's room, to be looked at: kept beside the take's motion.

A tracker's room may lie on its side, and begin anywhere. The way is told in a world that stands
still in the room, upright, its origin where the elbow first was: there the hand begins as it is
seen without a room.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.process import Progress, kept_folder, process
from handstudio.recording.take import Take
from handstudio.rooted import Root, root_of, track_key
from handstudio.setup import Setup

_VERSION = 1
_Q, _T, _KNOWN = slice(0, 4), slice(4, 7), 7
_BLOCK = 65536


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """Where the hand stands at one instant.

    Attributes:
        q_still_world: From the world of the motion into the one that stands still in the room.
        t_still_elbow: [m].
        known: False: where it was last known, or will be for the first time.
    """

    q_still_world: Float[Array, "4"]
    t_still_elbow: Float[Array, "3"]
    known: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Every instant of a motion; no number in it is NaN.

    Attributes:
        rows: q_still_world, t_still_elbow [m], and whether that is known; memory-mapped.
        low: The lowest corner of the box that the elbow stayed in [m].
        high: And the highest.
    """

    rows: Float[Array, "n 8"]
    low: Float[Array, "3"]
    high: Float[Array, "3"]

    def at(self, index: int) -> Stand:
        """Where it stands at an instant."""
        row = np.array(self.rows[index], dtype=float)
        return Stand(so3.normalize(row[_Q]), row[_T], bool(row[_KNOWN]))

    def middle(self, first: int, last: int) -> Stand:
        """Where it stood from one instant to another, what is known before all else."""
        rows = np.array(self.rows[first : last + 1], dtype=float)
        known: Bool[Array, " n"] = rows[:, _KNOWN] > 0.0
        rows = rows[known] if known.any() else rows
        # of attitudes that hardly differ, all of one sign
        q = so3.normalize(np.median(rows[:, _Q] * np.sign(rows[:, :1]), axis=0))
        return Stand(q, np.median(rows[:, _T], axis=0), bool(known.any()))


def find_way(
    take: Take, setup: Setup | None = None, progress: Progress = lambda _share: None
) -> None:
    """Find the way of a take's hand, by its own setup or another: `kept_way` then has it.

    Raises:
        TakeError: the take or its track cannot be read, or the disk does not take the motion.
        TrackError: the track is not of this glove's layout.
        CalibrationError: by this setup the track cannot be aligned.
    """
    chosen = setup or take.header.setup
    motion = process(take, setup, progress=progress)
    if track_key(take, chosen) is None or kept_way(take, setup) is not None:
        return
    root = root_of(take, chosen, motion)
    if root is None:
        return
    path = _path(take, setup)
    fresh = path.with_name(path.name + ".new")
    with suppress(OSError):  # a full disk: it is shown at its elbow, as without a track
        with fresh.open("wb") as file:
            np.save(file, _filled(root))
        fresh.replace(path)


def kept_way(take: Take, setup: Setup | None = None) -> Way | None:
    """The way where it was found before, else None."""
    try:
        rows = np.load(_path(take, setup), mmap_mode="r")
    except (OSError, ValueError, EOFError):
        return None
    parts = [rows[at : at + _BLOCK, _T] for at in range(0, len(rows), _BLOCK)]
    if not parts:
        return None
    low = np.min([part.min(axis=0) for part in parts], axis=0).astype(float)
    high = np.max([part.max(axis=0) for part in parts], axis=0).astype(float)
    return Way(rows, low, high)


def last_known(known: Bool[Array, " n"]) -> Int64[Array, " n"]:
    """Of every instant the last known one up to it; before the first known one that one."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
    out: Array = np.maximum(last, np.argmax(known))
    return out


def _filled(root: Root) -> Float[Array, "n 8"]:
    """The place before is held where none is known, at the beginning the first one."""
    count = len(root.time_us)
    known = np.isfinite(root.t_room_elbow[:, 0])
    rows = np.zeros((count, 8), dtype=np.float32)
    rows[:, _Q] = so3.IDENTITY
    if not known.any():
        return rows
    first = int(np.argmax(known))
    held = last_known(known)
    q_still_room = so3.conjugate(root.q_room_world[first])
    q = so3.multiply(q_still_room, root.q_room_world[held])
    rows[:, _Q] = q * np.where(q[:, :1] < 0.0, -1.0, 1.0)
    rows[:, _T] = so3.rotate(q_still_room, root.t_room_elbow[held] - root.t_room_elbow[first])
    rows[:, _KNOWN] = known
    return rows


def _path(take: Take, setup: Setup | None) -> Path:
    key = track_key(take, setup or take.header.setup)
    return kept_folder(take, setup) / f"way-{_VERSION}-{'none' if key is None else key[:16]}.npy"
