"""How far an estimated hand is from the true one: figures of an accuracy bench.

A glove knows north only as well as its compass does, so one heading offset, common to all
sensors and instants, is taken out before orientations are compared (`common_heading`); what is left
between sensors is not. Joint angles and points in the hand's frame are blind to it, points relative
to the elbow are compared as they are. Instants in which a number is missing (NaN) are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from handstudio.analysis.orientation_error import OrientationError, orientation_error
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Errors of orientations, sensor by sensor (or segment by segment).

    Attributes:
        heading_offset: What was taken out of all alike [rad].
        names: Of the sensors.
        errors: Root mean squares of what is left [rad], one a sensor.
    """

    heading_offset: float
    names: tuple[str, ...]
    errors: tuple[OrientationError, ...]

    @property
    def mean(self) -> float:
        """Mean over sensors of the total error [rad]."""
        return float(np.mean([error.total for error in self.errors]))

    @property
    def worst(self) -> tuple[str, float]:
        """The sensor whose total error is largest, and this error [rad]."""
        return _largest(self.names, [error.total for error in self.errors])


@dataclass(frozen=True, slots=True)
class AngleErrors:
    """Root mean square error of each named joint angle [rad]; NaN where it was never known."""

    names: tuple[str, ...]
    rmse: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean over the angles that were known [rad]."""
        return float(np.nanmean(self.rmse))

    @property
    def worst(self) -> tuple[str, float]:
        """The angle whose error is largest, and this error [rad]."""
        return _largest(self.names, self.rmse)


@dataclass(frozen=True, slots=True)
class HandPoints:
    """Fingertips, and the pose of the hand segment they are also written in; world frame, [m].

    Attributes:
        t_world_tip: Thumb to little finger, from the elbow.
        q_world_hand: Attitude of the hand segment.
        t_world_hand: Origin of the hand segment (the wrist), from the elbow.
    """

    t_world_tip: Float[Array, "n 5 3"]
    q_world_hand: Float[Array, "n 4"]
    t_world_hand: Float[Array, "n 3"]

    @property
    def t_hand_tip(self) -> Float[Array, "n 5 3"]:
        """The fingertips as the hand sees them."""
        q_hand_world = so3.conjugate(self.q_world_hand)[:, None]
        return so3.rotate(q_hand_world, self.t_world_tip - self.t_world_hand[:, None])


@dataclass(frozen=True, slots=True)
class PointErrors:
    """RMS distance [m] of each fingertip from its true place, thumb to little; NaN where unknown.

    Attributes:
        from_elbow: In the world, from the elbow: the whole chain errs, and its heading.
        in_hand: Each cloud in its own hand segment's frame: what the fingers alone err.
    """

    from_elbow: tuple[float, ...]
    in_hand: tuple[float, ...]


def common_heading(q_ref: Float[Array, "n s 4"], q_est: Float[Array, "n s 4"]) -> float:
    """The one turn about the vertical [rad] that brings the estimate nearest to the reference.

    Nearest is where the sum of ``sin²(error / 2)`` over sensors and instants is least. With
    ``(w, x, y, z)`` the error's quaternion that is the angle of the sum of ``(w + i z)²``: the
    circular mean of the heading errors, each weighted by ``cos²(inclination error / 2)``: the
    farther an orientation is tilted off, the less it has to say about the heading.

    Raises:
        ValueError: no orientation is known of both.
    """
    total = _phasors(q_ref, q_est).sum()
    if abs(total) == 0.0:
        raise ValueError("no orientation is known to compare headings by")
    return float(np.angle(total))


def with_heading(offset: float, q_world_any: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Orientations in a world that is turned about the vertical by an offset [rad]."""
    return so3.multiply(so3.about_z(offset), q_world_any)


def sensor_errors(
    names: Sequence[str], q_ref: Float[Array, "n s 4"], q_est: Float[Array, "n s 4"]
) -> SensorErrors:
    """Errors of each sensor after the common heading is taken out.

    Raises:
        ValueError: a sensor is known in no instant.
    """
    offset = common_heading(q_ref, q_est)
    turned = with_heading(offset, q_est)
    known = np.where(np.isfinite(q_est).all(axis=-1, keepdims=True), q_ref, np.nan)
    errors = (orientation_error(known[:, i], turned[:, i]) for i in range(len(names)))
    return SensorErrors(offset, tuple(names), tuple(errors))


def heading_scatter(q_ref: Float[Array, "n s 4"], q_est: Float[Array, "n s 4"]) -> float:
    """How far the sensors' mean headings scatter: circular SD [rad] over sensors.

    ``sqrt(-2 ln R)``, R the length of the mean of their directions; of a small scatter that is
    the ordinary SD with divisor s. An offset that all share does not count.

    Raises:
        ValueError: a sensor is known in no instant.
    """
    sums = _phasors(q_ref, q_est).sum(axis=0)
    if not np.abs(sums).all():
        raise ValueError("a sensor has no orientation to compare headings by")
    length = np.abs((sums / np.abs(sums)).mean())
    return float(np.sqrt(-2.0 * np.log(np.clip(length, np.finfo(float).tiny, 1.0))))


def angle_errors(
    names: Sequence[str], angles_ref: Float[Array, "n a"], angles_est: Float[Array, "n a"]
) -> AngleErrors:
    """Errors of named angles, each difference taken the shorter way round.

    Raises:
        ValueError: no angle is known in any instant.
    """
    gap = angles_est - angles_ref
    gap = gap - 2.0 * np.pi * np.rint(gap / (2.0 * np.pi))
    if not np.isfinite(gap).any():
        raise ValueError("no angle is known in any instant")
    rmse = tuple(_rms(one[np.isfinite(one)]) for one in gap.T)
    return AngleErrors(tuple(names), rmse)


def hand_points(pose: Pose) -> HandPoints:
    """The points of a placed hand."""
    hand = SEGMENTS.index("hand")
    return HandPoints(pose.t_world_tip, pose.q_world_segment[:, hand], pose.t_world_joint[:, hand])


def point_errors(ref: HandPoints, est: HandPoints) -> PointErrors:
    """Errors of the fingertips, relative to the elbow and relative to the hand."""
    return PointErrors(
        _distances(ref.t_world_tip, est.t_world_tip), _distances(ref.t_hand_tip, est.t_hand_tip)
    )


def _phasors(q_ref: Array, q_est: Array) -> Complex[Array, "n s"]:
    """``(w + i z)²`` of each error: twice its angle is the heading error; 0 where unknown.

    The square makes it blind to the quaternion's sign.
    """
    known = np.isfinite(q_ref).all(axis=-1) & np.isfinite(q_est).all(axis=-1)
    error = so3.multiply(so3.normalize(q_ref), so3.conjugate(so3.normalize(q_est)))
    return np.where(known, (error[..., 0] + 1j * error[..., 3]) ** 2, 0.0)


def _distances(ref: Array, est: Array) -> tuple[float, ...]:
    distances = np.linalg.norm(est - ref, axis=-1)
    return tuple(_rms(one[np.isfinite(one)]) for one in distances.T)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def _largest(names: Sequence[str], values: Sequence[float]) -> tuple[str, float]:
    index = int(np.nanargmax(values))
    return names[index], float(values[index])
