"""The other hand by mirror: what one hand was measured to be, taken for the other one too.

The mirror is the plane that divides the body: x becomes -x in every segment's and every sensor's
frame, as ``hand.skeleton`` makes the left hand of the right one. A place (x, y, z) becomes
(-x, y, z); a turn axis, which has a sense of rotation, (x, -y, -z); an attitude (w, x, y, z)
becomes (w, x, -y, -z). Flexion stays flexion about +x, and boards that rock with it rock alike.
"""

from __future__ import annotations

import msgspec

from handstudio.calibration.subject import (
    Axis,
    Centre,
    Quaternion,
    Segment,
    SubjectCalibration,
    Tip,
    Vector,
)


def mirrored(calibration: SubjectCalibration, new_id: str, made_utc: str) -> SubjectCalibration:
    """The calibration of the other hand, sensors sitting on it in mirror image.

    Standard deviations are those of the measured hand: how alike the two hands are, nobody knows.
    Verdicts, takes and the device stay those of the hand that was measured.

    Args:
        calibration: Of one hand.
        new_id: Of the calibration that is made.
        made_utc: Now, ISO 8601.
    """
    return msgspec.structs.replace(
        calibration,
        id=new_id,
        made_utc=made_utc,
        side="right" if calibration.side == "left" else "left",
        segments=tuple(_segment(segment) for segment in calibration.segments),
        tips=tuple(_tip(tip) for tip in calibration.tips),
        centres=tuple(_centre(centre) for centre in calibration.centres),
        axes=tuple(_axis(axis) for axis in calibration.axes),
        mirrored_from=calibration.id,
    )


def _segment(segment: Segment) -> Segment:
    return msgspec.structs.replace(
        segment,
        q_sensor_segment=_attitude(segment.q_sensor_segment),
        q_parent_rest=_attitude(segment.q_parent_rest),
        t_parent_joint=_place(segment.t_parent_joint),
    )


def _tip(tip: Tip) -> Tip:
    return msgspec.structs.replace(tip, t_distal_tip=_place(tip.t_distal_tip))


def _centre(centre: Centre) -> Centre:
    return msgspec.structs.replace(
        centre,
        from_centre_m=_place(centre.from_centre_m),
        unseen=_turn(centre.unseen),
    )


def _axis(axis: Axis) -> Axis:
    return msgspec.structs.replace(axis, axis=_turn(axis.axis))


def _place(t: Vector) -> Vector:
    return 0.0 - t[0], t[1], t[2]  # no minus before a zero


def _turn(axis: Vector) -> Vector:
    return axis[0], 0.0 - axis[1], 0.0 - axis[2]


def _attitude(q: Quaternion) -> Quaternion:
    return q[0], q[1], 0.0 - q[2], 0.0 - q[3]
