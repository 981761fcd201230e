"""How far estimated orientations are from a reference, split into heading and inclination.

As the BROAD dataset defines it (D. Laidig et al., Data 6 (2021) 72): the error is the rotation
between both in the world frame. Its reference is already turned to magnetic north, trial by
trial; where a reference has a heading of its own, take out one offset first (`aligned_heading`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.maths import so3


@dataclass(frozen=True, slots=True)
class OrientationError:
    """Root mean squares [rad]."""

    total: float
    heading: float
    inclination: float


def aligned_heading(q_ref: Float[Array, "n 4"], q_est: Float[Array, "n 4"]) -> Float[Array, "n 4"]:
    """The estimate after the one heading offset that fits the reference best, where it has one."""
    seen = _seen(q_ref)
    heading = so3.heading(so3.multiply(q_ref[seen], so3.conjugate(q_est[seen])))
    offset = np.angle(np.exp(1j * heading).mean())
    return so3.multiply(so3.about_z(offset), q_est)


def orientation_error(q_ref: Float[Array, "n 4"], q_est: Float[Array, "n 4"]) -> OrientationError:
    """Errors of instants that have a reference, both in one world; NaN in it is left out.

    Raises:
        ValueError: no instant has one.
    """
    seen = _seen(q_ref)
    q_ref, q_est = so3.normalize(q_ref[seen]), so3.normalize(q_est[seen])
    error = so3.multiply(q_ref, so3.conjugate(q_est))
    w, z = np.abs(error[:, 0]), np.abs(error[:, 3])
    return OrientationError(
        total=_rms(2.0 * np.arccos(np.clip(w, 0.0, 1.0))),
        heading=_rms(2.0 * np.arctan2(z, w)),
        inclination=_rms(2.0 * np.arccos(np.clip(np.hypot(w, z), 0.0, 1.0))),
    )


def relative_error(
    q_ref_parent: Float[Array, "n 4"],
    q_ref_child: Float[Array, "n 4"],
    q_parent: Float[Array, "n 4"],
    q_child: Float[Array, "n 4"],
) -> float:
    """RMS angle [rad] between estimated and true relative orientation, where both have a reference.

    Raises:
        ValueError: no instant has.
    """
    seen = _seen(q_ref_parent) & _seen(q_ref_child)
    reference = so3.multiply(so3.conjugate(q_ref_parent[seen]), q_ref_child[seen])
    estimate = so3.multiply(so3.conjugate(q_parent[seen]), q_child[seen])
    return _rms(so3.angle_between(reference, estimate))


def with_oracle_heading(
    q_ref: Float[Array, "n 4"], q_est: Float[Array, "n 4"]
) -> Float[Array, "n 4"]:
    """The estimate with the reference's heading at every instant: only inclination errs."""
    heading = so3.heading(so3.multiply(q_ref, so3.conjugate(q_est)))
    return so3.multiply(so3.about_z(heading), q_est)


def _seen(q_ref: Float[Array, "n 4"]) -> Bool[Array, " n"]:
    return np.asarray(np.isfinite(q_ref).all(axis=-1))


def _rms(values: Array) -> float:
    if len(values) == 0:
        raise ValueError("no instant has a reference to compare with")
    return float(np.sqrt(np.mean(np.square(values))))
