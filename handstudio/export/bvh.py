"""BVH: the hand as a skeleton, degrees, centimetres, y up.

At zero the hand lies flat, palm down, and points along -z. The channels X, Y, Z of a finger's joint
are then its turns in the order of ours: minus flexion, deviation, rotation about the axis -z (for
the thumb they are about the hand's axes). The format knows no gaps: the pose before is held, and
the place before where a room is known but not the place.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from handstudio.arrays import Array
from handstudio.export.bones import CHILDREN, in_parents, rest_in_forearm, tips
from handstudio.export.frames import Frames, blocks, frames_of
from handstudio.export.part import Part
from handstudio.export.room import Placer
from handstudio.export.y_up import turned_points
from handstudio.hand.angles import decompose
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.hand_fit import fit_of
from handstudio.maths import so3

_CM = 100.0
_PLACE, _TURNS = "Xposition Yposition Zposition", "Xrotation Yrotation Zrotation"


def write(part: Part, file: BinaryIO) -> None:
    """Write every frame from the window's first instant to its last."""
    frames, fit = frames_of(part), fit_of(part.setup)
    order = list(_depth_first(0))
    file.write(_hierarchy(fit.skeleton).encode())
    file.write(_motion_head(frames).encode())
    placer = Placer(part, fit)
    held = np.zeros((1, 3 + 3 * len(SEGMENTS)))
    for _first, count, motion, rows in blocks(part, frames):
        hand = placer.at(motion)
        turns = _turns(fit.skeleton, hand.q_frame_segment)[:, order].reshape(len(motion), -1)
        places = _CM * turned_points(hand.t_frame_root)
        newest = np.searchsorted(rows, np.arange(count), side="right")  # 0: of the block before
        values = np.concatenate([held, np.hstack([places, turns])])[newest]
        held = values[-1:]
        lines = (" ".join(f"{v:.5f}" for v in row) for row in values)
        file.write(("\n".join(lines) + "\n").encode())


def _turns(skeleton: Skeleton, q_world_segment: Array) -> Array:
    """Turns about x, y and z [deg] of each segment in its parent, from the flat hand."""
    rest = rest_in_forearm(skeleton)
    local = so3.multiply(
        so3.multiply(rest[list(PARENTS)], in_parents(q_world_segment)), so3.conjugate(rest)
    )
    local[:, 0] = so3.multiply(q_world_segment[:, 0], so3.conjugate(rest[0]))
    about_x, about_z, about_y = np.moveaxis(decompose(local), -1, 0)
    # of a world that is turned y up: its y is our z, its z our -y
    turns: Array = np.rad2deg(np.stack([about_x, about_z, -about_y], axis=-1))
    return turns


def _hierarchy(skeleton: Skeleton) -> str:
    return "\n".join(["HIERARCHY", *_joint(skeleton, 0, 0)]) + "\n"


def _joint(skeleton: Skeleton, segment: int, depth: int) -> Iterator[str]:
    pad = "  " * depth
    parent = PARENTS[segment]
    rest = rest_in_forearm(skeleton)
    kind, channels, offset = "ROOT", f"6 {_PLACE} {_TURNS}", np.zeros(3)
    if parent >= 0:
        kind, channels = "JOINT", f"3 {_TURNS}"
        offset = so3.rotate(rest[parent], skeleton.t_parent_joint[segment])
    yield f"{pad}{kind} {SEGMENTS[segment]}"
    yield f"{pad}{{"
    yield f"{pad}  OFFSET {_numbers(offset)}"
    yield f"{pad}  CHANNELS {channels}"
    for child in CHILDREN[segment]:
        yield from _joint(skeleton, child, depth + 1)
    tip = tips(skeleton).get(segment)
    if tip is not None:
        end = so3.rotate(rest[segment], tip)
        yield from (f"{pad}  End Site", f"{pad}  {{")
        yield from (f"{pad}    OFFSET {_numbers(end)}", f"{pad}  }}")
    yield f"{pad}}}"


def _numbers(vector: Array) -> str:
    """A vector of ours [m] as this file's [cm]."""
    return " ".join(f"{value:.5f}" for value in _CM * turned_points(vector) + 0.0)


def _motion_head(frames: Frames) -> str:
    return f"MOTION\nFrames: {frames.count}\nFrame Time: {1.0 / frames.rate_hz:.10g}\n"


def _depth_first(segment: int) -> Iterator[int]:
    """Segments in the order in which the hierarchy names them."""
    yield segment
    for child in CHILDREN[segment]:
        yield from _depth_first(child)
