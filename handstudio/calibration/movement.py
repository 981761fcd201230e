"""Movement: what turns against what, followed by gyroscopes since a rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.attitude import attitude
from handstudio.calibration.heard import ROOT, heard_pct, mean_while, seconds_of, steps_in
from handstudio.calibration.stillness import BLOCK_S
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples

STEP_S = 0.05  # turns are followed at 20 Hz: swings are below 3 Hz
_CROOKED = np.deg2rad(12.0)  # that the headings of two sensors are off by, at most
_LEADING = 0.1  # share of the most movement: with less, nobody can tell a neighbour's heading


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """How the rig and its joints turned since the begin.

    Attributes:
        time_s: Of every step.
        q_world_sensor: Of one sensor for each segment.
        joints: Those with a sensor on both sides, and the one above the first segment.
        turned: Their rotation vectors since the begin [rad], in the first frame of the sensor
            beyond the joint.
        q_parent_child: Between the sensors of each at the begin; of the first joint, of the world.
    """

    time_s: Float[Array, " m"]
    q_world_sensor: Float[Array, "m s 4"]
    joints: tuple[str, ...]
    turned: Float[Array, "m j 3"]
    q_parent_child: Float[Array, "j 4"]


def moved_since(rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> Moved:
    """Follow the sensors by their gyroscopes, from their attitudes at rest."""
    calm = done[: max(1, len(done) // 20)] if rest is None or not len(rest) else rest
    heard = np.minimum(heard_pct(done), heard_pct(calm))
    answering = np.flatnonzero(heard >= demands.ANSWERING_PCT)
    stand = layout.drivers_among([int(index) for index in answering])
    used = list(stand.values())
    time_s, span_s, rate = _rates(done, used)
    rate = rate - _biases(rest, done)[used]
    mag = mean_while(np.nan_to_num(calm.mag), calm.fresh & calm.valid)[used]
    q_world_start = attitude(mean_while(calm.acc, calm.valid)[used], mag)
    q_world_sensor = _chained(q_world_start, so3.exp(rate * span_s[:, None, None]))
    pairs = _pairs(layout, list(stand))
    q_parent_child = _between(q_world_sensor, so3.rotate(q_world_sensor, rate), pairs)
    turned = so3.log(so3.multiply(so3.conjugate(q_parent_child[:1]), q_parent_child))
    return Moved(time_s, q_world_sensor, tuple(pairs), turned, q_parent_child[0])


def main_axes(turned: Float[Array, "m j 3"]) -> Float[Array, "j 3"]:
    """The directions in which rotation vectors spread most."""
    by_joint = np.moveaxis(turned - turned.mean(axis=0), 1, 0)
    return np.asarray(np.linalg.eigh(np.swapaxes(by_joint, 1, 2) @ by_joint)[1][..., -1])


def _pairs(layout: Layout, segments: list[str]) -> dict[str, tuple[int, int]]:
    """Columns of the sensors on both sides of every joint; -1: the world."""
    joint, first = ROOT
    pairs = {joint: (-1, segments.index(first))} if first in segments else {}
    return pairs | {
        j.name: (segments.index(j.parent), segments.index(j.child))
        for j in layout.joints
        if {j.parent, j.child} <= set(segments)
    }


def _between(
    q_world_sensor: Float[Array, "m s 4"],
    rate_world: Float[Array, "m s 3"],
    pairs: dict[str, tuple[int, int]],
) -> Float[Array, "m j 4"]:
    """What lies between the two sensors of every joint, their headings agreed.

    Compasses differ by some degrees, and when both sensors turn together that looks as if the
    joint moved. Where the inner one moves, the level parts of both rates lie apart by just that.
    """
    if not pairs:
        return np.zeros((len(q_world_sensor), 0, 4))
    parent, child = np.array(list(pairs.values())).T
    x, y = rate_world[..., 0], rate_world[..., 1]
    most = float(np.sum(rate_world**2, axis=(0, 2)).max())
    along, across = (x.T @ x + y.T @ y)[parent, child], (x.T @ y)[parent, child]
    across = across - (x.T @ y)[child, parent]
    off = np.arctan2(across, np.maximum(along, 0.0) + _LEADING * most)
    q_world_parent = so3.multiply(
        so3.about_z(np.clip(off, -_CROOKED, _CROOKED)), q_world_sensor[:, parent]
    )
    q_world_parent[:, parent < 0] = so3.IDENTITY
    return so3.multiply(so3.conjugate(q_world_parent), q_world_sensor[:, child])


def _biases(rest: ImuSamples | None, done: ImuSamples) -> Float[Array, "s 3"]:
    """What gyroscopes read at rest [rad/s]: without a rest, what is left of going and coming."""
    if rest is not None and seconds_of(rest) >= BLOCK_S:
        return np.nan_to_num(mean_while(rest.gyr, rest.valid))
    mean = np.nan_to_num(mean_while(done.gyr, done.valid))
    small = np.linalg.norm(mean, axis=-1) < np.deg2rad(demands.BIAS_DEG_S)
    return np.asarray(np.where(small[:, None], mean, 0.0))


def _rates(done: ImuSamples, used: list[int]) -> tuple[Array, Array, Array]:
    """Times [s], spans [s] and mean rates [rad/s] of steps; a silent sensor goes on as it was."""
    each, count = steps_in(done, STEP_S)
    gyr, valid = done.gyr, done.valid
    if not valid[:, used].all():
        last = np.maximum.accumulate(np.where(valid, np.arange(len(done))[:, None], 0), axis=0)
        gyr = np.take_along_axis(gyr, last[..., None], axis=0)
    rate = gyr[: count * each].reshape(count, each, -1, 3).mean(axis=1)[:, used]
    time_s = (done.time_us - done.time_us[0]) * 1e-6
    begins = np.append(time_s, time_s[-1] + seconds_of(done) / len(done))[: count * each + 1 : each]
    return begins[1:], np.maximum(np.diff(begins), 0.0), rate


def _chained(start: Float[Array, "s 4"], steps: Float[Array, "m s 4"]) -> Float[Array, "m s 4"]:
    """A rotation and all steps up to each, multiplied in runs side by side."""
    m, s, _ = steps.shape
    side = int(np.ceil(np.sqrt(m)))
    padded = np.tile(so3.IDENTITY, (side * side, s, 1))
    padded[:m] = steps
    q = padded.reshape(side, side, s, 4)
    for index in range(1, side):
        q[:, index] = so3.multiply(q[:, index - 1], q[:, index])
    before = np.tile(start, (side, 1, 1, 1))
    for index in range(1, side):
        before[index, 0] = so3.multiply(before[index - 1, 0], q[index - 1, -1])
    return so3.multiply(before, q).reshape(side * side, s, 4)[:m]
