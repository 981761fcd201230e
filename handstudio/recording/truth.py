"""What was true of a simulated take, in a file beside it: ``NAME.truth.npz``.

The pipeline never reads it; comparisons do. Angles in rad, places in m, frames as everywhere. What
there is of every instant is kept in single precision: attitudes to 1e-5 deg, places to 0.1 µm.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TakeError


@dataclass(frozen=True, slots=True, eq=False)
class TruthFile:
    """Truth of every instant, and of the person and the glove.

    Attributes:
        time_us: Device clock of every instant that was sampled, lost ones too.
        sensors: Names, in order.
        q_world_segment: Attitudes of the segments.
        q_world_sensor: Attitudes of the sensors, as they sat on the skin at that instant.
        t_world_joint: Places of the segments' origins, which are their proximal joints.
        t_world_sensor: Places of the sensors.
        t_world_tip: Places of the fingertips.
        angles: As `hand.angles.hand_angles`, by the same formula as the pipeline's.
        q_world_start: Attitude of the forearm that elbow and forearm angles count from.
        t_parent_joint: Link vectors: joint centres at the flat hand, in the parent's frame.
        q_parent_rest: Segment frames at the flat hand, in the parent's.
        t_distal_tip: Fingertips in the distal segments' frames.
        q_segment_sensor: Mounting: sensors in their segments at the flat hand, before skin moves.
        t_segment_sensor: Their places. Centre of the proximal joint in a sensor's frame:
            ``rotate(conjugate(q_segment_sensor), -t_segment_sensor)``.
        axes: Axes of flexion, deviation and rotation of every joint, in its rest frame.
        points: A point of each.
        q_world_held: Attitude of what the hand held, a pen's z along it to its end; NaN: nothing.
        t_world_held: Place of its origin: a pen's tip, the middle of anything else.
        pen_down: Whether a pen wrote.
        facts: JSON: person, motion, imperfections, seed, and whatever the motion held or wrote.
    """

    time_us: Int64[Array, " n"]
    sensors: tuple[str, ...]
    q_world_segment: Float[Array, "n k 4"]
    q_world_sensor: Float[Array, "n s 4"]
    t_world_joint: Float[Array, "n k 3"]
    t_world_sensor: Float[Array, "n s 3"]
    t_world_tip: Float[Array, "n 5 3"]
    angles: Float[Array, "n a"]
    q_world_start: Float[Array, " 4"]
    t_parent_joint: Float[Array, "k 3"]
    q_parent_rest: Float[Array, "k 4"]
    t_distal_tip: Float[Array, "5 3"]
    q_segment_sensor: Float[Array, "s 4"]
    t_segment_sensor: Float[Array, "s 3"]
    axes: Float[Array, "k 3 3"]
    points: Float[Array, "k 3 3"]
    q_world_held: Float[Array, "n 4"]
    t_world_held: Float[Array, "n 3"]
    pen_down: Bool[Array, " n"]
    facts: str


_OF_EVERY_INSTANT = (
    "q_world_segment",
    "q_world_sensor",
    "t_world_joint",
    "t_world_sensor",
    "t_world_tip",
    "angles",
    "q_world_held",
    "t_world_held",
)


def truth_path(take: Path) -> Path:
    """Where the truth of a simulated take lives."""
    return take.with_suffix(".truth.npz")


def save_truth(take: Path, truth: TruthFile) -> None:
    """Store the truth beside a take.

    Raises:
        TakeError: it cannot be written.
    """
    arrays: dict[str, Any] = {field.name: getattr(truth, field.name) for field in fields(truth)}
    arrays["sensors"] = np.array(truth.sensors)
    for name in _OF_EVERY_INSTANT:
        arrays[name] = arrays[name].astype(np.float32)
    try:
        np.savez(truth_path(take), **arrays)
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Free some space or check the folder's permissions, then simulate the take again.",
            path=truth_path(take),
            reason=error.strerror or error,
        ) from error


def load_truth(take: Path) -> TruthFile:
    """The truth of a simulated take.

    Raises:
        TakeError: there is none, or it cannot be read.
    """
    path = truth_path(take)
    try:
        # opened here: numpy leaves a file open that is no archive
        with path.open("rb") as stream, np.load(stream) as file:
            arrays: dict[str, Any] = {field.name: file[field.name] for field in fields(TruthFile)}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise TakeError(
            "{path}: cannot be read as the truth of a take ({reason}).",
            "Only simulated takes have one; simulate the take again.",
            path=path,
            reason=error,
        ) from error
    arrays["sensors"] = tuple(str(name) for name in arrays["sensors"])
    arrays["facts"] = str(arrays["facts"])
    return TruthFile(**arrays)
