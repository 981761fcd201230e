"""A sensor on a segment that turns about a joint's centre: signals, kernels, and what is found.

For a centre at rest (3.1), ``a_r = domega x P + omega x (omega x P) = Gamma P``, with
``Gamma = [domega]x + [omega]x^2``. P goes from the centre to the sensor; everything is written in
the sensor's frame. Gamma is singular along a fixed axis: a hinge tells nothing of the place there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

SMOOTHED_OVER_S = 0.1
"""Window of the smoothing parabola; bends slower than 10 Hz pass."""

LEAST_TURNING = np.deg2rad(10.0)
"""RMS rate below which there is nothing to compute a centre from."""

BIAS_SD = 0.3
"""How far accelerometers are off [m/s²] before anything is known of them."""

_SWING_S = 4.0
_SLOPE = 9  # samples: the polynomial through them gives slopes true to three quarters of the band


@dataclass(frozen=True, slots=True, eq=False)
class RigidRotation:
    """Signals of one sensor, all smoothed by one filter.

    Attributes:
        acc: Acceleration [m/s²]: specific force (+g upward at rest), or free of gravity.
        gyr: Angular velocity [rad/s].
        domega: Its derivative [rad/s²].
        used: Which instants count.
        rate_hz: Samples a second.
    """

    acc: Float[Array, "n 3"]
    gyr: Float[Array, "n 3"]
    domega: Float[Array, "n 3"]
    used: Bool[Array, " n"]
    rate_hz: float

    def __len__(self) -> int:
        return len(self.gyr)

    @property
    def gamma(self) -> Float[Array, "n 3 3"]:
        """``a_r = gamma @ P``."""
        return gamma(self.gyr, self.domega)


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """How far and how fast a sensor was turned, about which axes; the main axis first.

    Attributes:
        axes: Principal axes of the angular velocity, one a row.
        rate: RMS rate about each [rad/s].
        swing: How far it was turned to and fro about each [rad]: the most within four seconds.
    """

    axes: Float[Array, "3 3"]
    rate: Float[Array, " 3"]
    swing: Float[Array, " 3"]


@dataclass(frozen=True, slots=True, eq=False)
class CentreEstimate:
    """Where a joint's centre lies, seen from a sensor.

    Attributes:
        from_centre_m: P, from the centre to the sensor, in the sensor's frame. Along ``unseen``
            it is no more than it has to be.
        covariance: Of it [m²]; along ``unseen`` it is that of `robust_fit.UNSEEN_SD_M`.
        unseen: Unit vector along which the signals say nothing (a hinge's axis); zero: none.
        residual: RMS over all used samples of what is left of the accelerations [m/s²].
        excitation: How the sensor was turned.
        condition: Condition number of the equations for the place, the unseen included.
    """

    from_centre_m: Float[Array, " 3"]
    covariance: Float[Array, "3 3"]
    unseen: Float[Array, " 3"]
    residual: float
    excitation: Excitation
    condition: float

    @property
    def sd_m(self) -> Float[Array, " 3"]:
        """Standard deviations along the sensor's axes."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def skew(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """``skew(v) @ u = v x u``."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))]
    return np.stack(rows, axis=-2)


def gamma(gyr: Float[Array, "*b 3"], domega: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """``[domega]x + [omega]x^2`` (3.1)."""
    turning = skew(gyr)
    return np.asarray(skew(domega) + turning @ turning)


def free_of_gravity(
    acc: Float[Array, "*#b 3"], q_world_sensor: Float[Array, "*#b 4"]
) -> Float[Array, "*b 3"]:
    """``a_r = a_S - R_GS^T g`` (3.7), in the sensor's frame; g is +9.81 upward."""
    g_world = np.array([0.0, 0.0, STANDARD_GRAVITY])
    return np.asarray(acc - so3.rotate(so3.conjugate(q_world_sensor), g_world))


def smoothed(
    acc: Float[Array, "n 3"],
    gyr: Float[Array, "n 3"],
    rate_hz: float,
    over_s: float = SMOOTHED_OVER_S,
    good: Bool[Array, " n"] | None = None,
) -> RigidRotation:
    """Signals and the derivative of the rate, by one filter.

    Both signals pass the same Savitzky-Golay filter (parabola over ``over_s``), and the derivative
    is the slope of the *smoothed* rate, by a polynomial through nine samples. The slope of the
    parabola itself is lower than the smoothed rate's; it would make every arm too long.

    Args:
        acc: Acceleration [m/s²], uniformly sampled. Take gravity off first where (3.1) is used.
        gyr: Angular velocity [rad/s], free of bias as far as that is known.
        rate_hz: Samples a second.
        over_s: Window; at least three samples are taken.
        good: Which samples to trust. What a filter makes of the others is not used; they must be
            finite all the same (interpolate gaps).

    Raises:
        CalibrationError: too short a recording.
    """
    width = max(3, 2 * round(0.5 * over_s * rate_hz) + 1)
    reach = width // 2 + _SLOPE // 2
    if len(gyr) <= 2 * reach + _SLOPE:
        raise CalibrationError(
            "The recording has {count} samples; at least {least} are needed.",
            "Record for longer.",
            count=len(gyr),
            least=2 * reach + _SLOPE + 1,
        )
    from scipy.signal import savgol_filter  # noqa: PLC0415 - takes a second to load

    acc, gyr = (savgol_filter(v, width, 2, axis=0) for v in (acc, gyr))
    domega = savgol_filter(gyr, _SLOPE, _SLOPE - 1, deriv=1, delta=1.0 / rate_hz, axis=0)
    bad = np.zeros(len(gyr), dtype=bool) if good is None else ~good
    bad = np.convolve(bad, np.ones(2 * reach + 1), mode="same") > 0.5
    bad[:reach] = bad[len(bad) - reach :] = True
    return RigidRotation(acc, gyr, domega, ~bad, rate_hz)


def joined(parts: Sequence[RigidRotation]) -> RigidRotation:
    """Several recordings of one sensor about one centre, one after the other."""
    return RigidRotation(
        acc=np.concatenate([part.acc for part in parts]),
        gyr=np.concatenate([part.gyr for part in parts]),
        domega=np.concatenate([part.domega for part in parts]),
        used=np.concatenate([part.used for part in parts]),
        rate_hz=parts[0].rate_hz,
    )


def excitation(rotation: RigidRotation) -> Excitation:
    """How far and how fast, about which axes.

    Raises:
        CalibrationError: the sensor hardly turned, or nothing of it can be used.
    """
    gyr = rotation.gyr[rotation.used]
    rate = float(np.sqrt((gyr**2).sum(axis=1).mean())) if len(gyr) else 0.0
    if rate < LEAST_TURNING:
        raise CalibrationError(
            "The sensor turned at {found:.1f} deg/s; at least {least:.0f} are needed.",
            "Move the joint further and faster.",
            found=float(np.rad2deg(rate)),
            least=float(np.rad2deg(LEAST_TURNING)),
        )
    power, axes = np.linalg.eigh(gyr.T @ gyr / len(gyr))
    about = gyr @ axes[:, ::-1]
    angle = np.cumsum(about, axis=0) / rotation.rate_hz
    rates = np.sqrt(np.maximum(power[::-1], 0.0))
    # in windows that overlap by half, so that a bias of the rate does not add up
    hop = max(1, round(0.5 * _SWING_S * rotation.rate_hz))
    starts = range(0, max(1, len(angle) - hop), hop)
    swing = np.max([np.ptp(angle[k : k + 2 * hop], axis=0) for k in starts], axis=0)
    return Excitation(axes[:, ::-1].T, rates, swing)
