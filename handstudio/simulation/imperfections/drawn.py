"""The errors a set of sensors has for as long as it is worn, drawn once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY
from handstudio.simulation.imperfections.readout import MPU9250
from handstudio.simulation.imperfections.strengths import Imperfections

GYR_NOISE_DEG_SQRT_S = (6.2e-3, 6.9e-3)
GYR_WALK_DEG = (1.41e-4, 6.15e-4)  # [deg/s^1.5]
ACC_WALK_G = (1.1e-6, 8.7e-6)  # [g/sqrt(s)]
TURN_ON_DPS, TURN_ON_G = 0.1, 0.001
SCALE_SD = 0.01
MISALIGNMENT_SD = 0.02 / 3.0
G_SENSITIVITY_DPS = 0.1
GYR_PER_KELVIN_DPS, ACC_PER_KELVIN_G = 0.24 / 3.0, 0.0015 / 3.0
WARM_CELSIUS, WARM_UP_KELVIN, WARM_UP_S = 31.0, 7.0, 240.0
HARD_IRON_UT = 1.0
SOFT_IRON_GAIN_SD, SOFT_IRON_SHAPE_SD = 0.10, 0.02
COMPASS_SCATTER_DEG = 4.48
_FIELD_RATIO = 35.0 / 31.0  # of the vertical to the horizontal field where that was measured


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Errors of every sensor; the six of an inertial sensor: accelerometer x y z, gyroscope x y z.

    What a sensor reads is ``inertial @ felt + bias + per_kelvin * (celsius - WARM_CELSIUS)`` and
    ``magnetic @ field + hard_iron``, and noise.

    Attributes:
        inertial: Scale, misalignment and what the gyroscope takes from the accelerometer.
        bias: [m/s²] and [rad/s].
        per_kelvin: How the bias goes with the temperature.
        warm_up: Temperature below `WARM_CELSIUS` when switched on [K].
        noise: White noise [m/s²/sqrt(Hz)], [rad/s/sqrt(Hz)], two-sided: the thesis's Q.
        walk: Of the bias [m/s²/sqrt(s)], [rad/s/sqrt(s)]: its K.
        magnetic: Soft iron, and the magnetometer's axes against the accelerometer's.
        hard_iron: [µT].
        mag_noise: Of one reading [µT].
    """

    inertial: Float[Array, "s 6 6"]
    bias: Float[Array, "s 6"]
    per_kelvin: Float[Array, "s 6"]
    warm_up: Float[Array, " s"]
    noise: Float[Array, "s 6"]
    walk: Float[Array, "s 6"]
    magnetic: Float[Array, "s 3 3"]
    hard_iron: Float[Array, "s 3"]
    mag_noise: float


def draw(what: Imperfections, sensors: int, seed: int, occasion: int = 0) -> Drawn:
    """The errors of a set of sensors, a seed is one set; an occasion is one switching on.

    Strengths scale what is drawn and change nothing else.
    """
    unit = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_UNIT,)))
    on = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_TURN_ON, occasion)))
    g = STANDARD_GRAVITY
    both = np.repeat([g, np.deg2rad(1.0)], 3)  # from g and deg to SI

    def normal(*shape: int) -> Array:
        return unit.standard_normal((sensors, *shape))

    biases = np.repeat([MPU9250.acc_bias_rms, MPU9250.gyr_bias_rms], 3)
    turned_on = both * np.repeat([TURN_ON_G, TURN_ON_DPS], 3) * on.standard_normal((sensors, 6))
    inertial = np.tile(np.eye(6), (sensors, 1, 1))
    inertial += what.scale * SCALE_SD * normal(6)[..., None] * np.eye(6)
    for part in (slice(0, 3), slice(3, 6)):
        inertial[:, part, part] += what.misalignment * MISALIGNMENT_SD * normal(3, 3) * ~_DIAGONAL
    inertial[:, 3:, :3] = what.g_sensitivity * np.deg2rad(G_SENSITIVITY_DPS) / g * normal(3, 3)
    shape = normal(3, 3)
    soft = SOFT_IRON_GAIN_SD * normal(1)[..., None] * np.eye(3) + SOFT_IRON_SHAPE_SD * (
        0.5 * (shape + shape.transpose(0, 2, 1))
    )
    scatter = np.deg2rad(COMPASS_SCATTER_DEG) / np.hypot(1.0, _FIELD_RATIO) * normal(3)
    return Drawn(
        bias=what.bias * biases * normal(6) + what.turn_on_bias * turned_on,
        per_kelvin=both * np.repeat([ACC_PER_KELVIN_G, GYR_PER_KELVIN_DPS], 3) * normal(6),
        warm_up=what.temperature * WARM_UP_KELVIN * np.clip(1.0 + 0.1 * normal(), 0.5, 1.5),
        noise=what.white_noise * np.repeat(_noise(unit.uniform(size=(sensors, 2))), 3, axis=-1),
        walk=what.random_walk * np.repeat(_walk(unit.uniform(size=(sensors, 2))), 3, axis=-1),
        magnetic=so3.to_matrix(so3.exp(what.compass_scatter * scatter))
        @ (np.eye(3) + what.soft_iron * soft),
        hard_iron=what.hard_iron * HARD_IRON_UT * normal(3),
        mag_noise=what.mag_noise * MPU9250.mag_noise_ut,
        inertial=inertial,
    )


_UNIT, _TURN_ON = 20, 21  # which of a seed's streams
_DIAGONAL = np.eye(3, dtype=bool)


def _noise(within: Array) -> Array:
    """Q of accelerometer and gyroscope of every sensor, by where they are within the range."""
    low, high = GYR_NOISE_DEG_SQRT_S
    # one level of the accelerometer was measured; units differ as the gyroscopes do
    spread = low / high + (1.0 - low / high) * within[:, 0]
    acc = MPU9250.acc_density / np.sqrt(2.0) * spread / (0.5 * (1.0 + low / high))
    return np.stack([acc, np.deg2rad(low + (high - low) * within[:, 1])], axis=-1)


def _walk(within: Array) -> Array:
    """K of accelerometer and gyroscope: evenly over the logarithm of their ranges."""
    acc = STANDARD_GRAVITY * ACC_WALK_G[0] * (ACC_WALK_G[1] / ACC_WALK_G[0]) ** within[:, 0]
    gyr = np.deg2rad(GYR_WALK_DEG[0] * (GYR_WALK_DEG[1] / GYR_WALK_DEG[0]) ** within[:, 1])
    return np.stack([acc, gyr], axis=-1)
