"""A subject calibration: what is known of one hand and of how the glove sits on it.

A value, and readable text (JSON). Frames: a segment's frame is as in ``hand.skeleton``; metres,
radians, quaternions scalar first. Standard deviations stand beside what they belong to.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from handstudio.calibration.verdict import Verdict
from handstudio.errors import CalibrationError

FORMAT = 1
"""Version of the text."""

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]

Source: TypeAlias = Literal["measured", "with prior", "proportions"]
"""From signals alone; from signals and anatomy together; from mean proportions alone."""


class Centre(msgspec.Struct, frozen=True):
    """Where a joint's centre lies, seen from a sensor.

    Attributes:
        joint: Which joint.
        sensor: Seen from which sensor.
        from_centre_m: From the centre to the sensor, in the sensor's frame, at the flat hand.
        sd_m: Standard deviations along the sensor's axes.
        unseen: Direction, in the sensor's frame, along which the signals say nothing (a hinge's
            axis) and anatomy stands in; zero where there is none.
        residual: What is left of the accelerations [m/s²], RMS.
        excitation_deg: How far the joint was moved about its main and its second axis.
        condition: Condition number of the equations for the place.
    """

    joint: str
    sensor: str
    from_centre_m: Vector
    sd_m: Vector
    unseen: Vector
    residual: float
    excitation_deg: tuple[float, float]
    condition: float


class Axis(msgspec.Struct, frozen=True):
    """The functional flexion axis of a joint in the frame of a sensor, extension positive.

    Attributes:
        joint: Which joint.
        sensor: In whose frame.
        axis: Unit vector.
        sd_rad: How well its direction is known.
    """

    joint: str
    sensor: str
    axis: Vector
    sd_rad: float


class Rock(msgspec.Struct, frozen=True):
    """How the board of a sensor rocks on its skin with a joint beside it.

    Attributes:
        sensor: Which board.
        joint: The joint of its segment, or one that its segment carries.
        share: Turn of the board about the joint's axis per turn of the joint [rad/rad].
    """

    sensor: str
    joint: str
    share: float


class Segment(msgspec.Struct, frozen=True):
    """A segment of the skeleton, and how its sensor sits on it.

    Attributes:
        name: As in ``hand.skeleton``.
        sensor: The sensor that defines it; empty: none, it is carried along.
        q_sensor_segment: Attitude of the segment in that sensor.
        q_parent_rest: Attitude in its parent at the flat hand.
        t_parent_joint: Centre of its proximal joint in the parent's frame [m].
        sd_m: Standard deviations of that, along the parent's axes.
        length_m: From its joint to its far end.
        length_sd_m: And its standard deviation.
        source: Where the joint's centre is from.
        length_source: Where the length is from.
        plausible: How many standard deviations of a population the length is from its mean.
    """

    name: str
    sensor: str
    q_sensor_segment: Quaternion
    q_parent_rest: Quaternion
    t_parent_joint: Vector
    sd_m: Vector
    length_m: float
    length_sd_m: float
    source: Source
    length_source: Source
    plausible: float


class Tip(msgspec.Struct, frozen=True):
    """A fingertip in the frame of the distal segment [m]."""

    finger: str
    t_distal_tip: Vector
    sd_m: float
    source: Source


class SubjectCalibration(msgspec.Struct, frozen=True):
    """What is known of one hand, and of how the glove sits on it.

    Attributes:
        id: Name of this calibration; another calibration has another.
        made_utc: When, ISO 8601.
        software: With what.
        subject: Code of the person.
        side: Which hand.
        hand_length_m: Wrist to the tip of the middle finger, as given or as measured.
        hand_type: 1: one rigid palm; 2: two blocks from the wrist; 3: radial and hinged ulnar
            block.
        device: Serial number of the glove; its sensors sit as they sat then.
        segments: All segments of the skeleton, in its order.
        tips: All fingertips.
        centres: Joint centres seen from sensors.
        axes: Flexion axes seen from sensors.
        rocking: How boards rock, as far as the course could tell.
        verdicts: Of every step of the course.
        takes: Name and SHA-256 of the takes it was computed from.
        mirrored_from: Id of the other hand's calibration this one mirrors; empty: measured.
        format: Version of the text.
    """

    id: str
    made_utc: str
    software: str
    subject: str
    side: Literal["left", "right"]
    hand_length_m: float
    hand_type: Literal[1, 2, 3]
    device: str
    segments: tuple[Segment, ...]
    tips: tuple[Tip, ...]
    centres: tuple[Centre, ...] = ()
    axes: tuple[Axis, ...] = ()
    rocking: tuple[Rock, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    takes: tuple[tuple[str, str], ...] = ()
    mirrored_from: str = ""
    format: int = FORMAT


def encode(calibration: SubjectCalibration) -> bytes:
    """JSON that a person can read."""
    return msgspec.json.format(msgspec.json.encode(calibration))


def decode(text: bytes, name: str) -> SubjectCalibration:
    """Inverse of `encode`; ``name`` is what an error calls the text.

    Raises:
        CalibrationError: it is no subject calibration, is damaged, or of a newer version.
    """
    try:
        version = msgspec.json.decode(text, type=_Version).format
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise _unreadable(name, error) from error
    if version > FORMAT:
        raise CalibrationError(
            "{name}: a subject calibration of format {version}; this version reads up to {format}.",
            "Update handstudio, or calibrate again.",
            name=name,
            version=version,
            format=FORMAT,
        )
    try:
        return msgspec.json.decode(text, type=SubjectCalibration)
    except msgspec.MsgspecError as error:
        raise _unreadable(name, error) from error


class _Version(msgspec.Struct):
    format: int


def _unreadable(name: str, error: Exception) -> CalibrationError:
    return CalibrationError(
        "{name}: not a subject calibration ({reason}).",
        "Choose another file, or calibrate again; the calibration before is still there.",
        name=name,
        reason=error,
    )
