"""Heading alignment over sensors: a rest, a turn of the whole rig, a rest (4.2.5).

Compasses of sensors centimetres apart differ by degrees. In the turn all sensors share one
rigid motion, which tells how they are headed against one another.

Two ways. `at_peak` is the thesis's: one sample, where the rig turns fastest. `align` takes all
samples, by `heading_fit`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.averages import blocks_of, valid_mean
from handstudio.calibration.course import TURN
from handstudio.calibration.heading_fit import (
    CALIBRATED,
    UNCALIBRATED,
    Found,
    Tolerances,
    solved,
    tolerances_of,
)
from handstudio.calibration.level_headings import compass_headings, robust_mean, wg_heading, wrapped
from handstudio.calibration.rig_turn import LEAST_TURN, signals_of
from handstudio.calibration.verdict import Reading, Unit, Verdict, What
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.samples import ImuSamples

__all__ = [
    "CALIBRATED",
    "FOREARM",
    "UNCALIBRATED",
    "HeadingAlignment",
    "Tolerances",
    "align",
    "at_peak",
    "tolerances_of",
]

FOREARM = ("SN1", "SN2", "SN3")
"""Sensors of the glove whose skin stays behind when the bone beneath turns about itself."""

_STILL = np.deg2rad(2.0)  # [rad/s]; four times it is no rest
_TREMOR_S = 0.1  # a period of tremor, which does no harm
_SPINNING = np.deg2rad(5.0)  # about the vertical, beyond every bias [rad/s]
_TOGETHER = np.deg2rad(3.0)
_RESIDUAL = np.deg2rad(3.0)  # [rad/s]


class HeadingAlignment(msgspec.Struct, frozen=True):
    """How sensors are headed; one figure a sensor where it says so.

    Attributes:
        names: Of the sensors.
        psi_cor: Turn about the vertical [rad] for attitudes of the rest before the turn, as
            ``attitude(acc, mag)`` has them, without a compass ``attitude(acc)``: all headings
            then agree (4.21). What they agree on is the robust mean of the compasses. 0 where a
            sensor was silent.
        psi_wg: Heading [rad] of ``attitude(acc)`` in the world whose x axis is level and square to
            the axis of the turn (4.19): what ``psi_cor`` is without a compass.
        sd: Standard deviation of the heading against the others' [rad]; infinite where silent.
        residual: What is left of the angular velocities, RMS [rad/s].
        together: How far the sensor turned against the others, at most [rad].
        outlying: Whether it had no part in the common motion.
        turn: How far the rig was turned [rad].
        axis_tilt: How far the axis was from level [rad].
        verdict: Whether it was done well.
    """

    names: tuple[str, ...]
    psi_cor: tuple[float, ...]
    psi_wg: tuple[float, ...]
    sd: tuple[float, ...]
    residual: tuple[float, ...]
    together: tuple[float, ...]
    outlying: tuple[bool, ...]
    turn: float
    axis_tilt: float
    verdict: Verdict

    def aligned(self, q_world_sensor: Float[Array, "*b s 4"]) -> Float[Array, "*b s 4"]:
        """Attitudes whose headings agree."""
        return so3.multiply(so3.about_z(np.array(self.psi_cor)), q_world_sensor)


def align(
    before: ImuSamples,
    turning: ImuSamples,
    after: ImuSamples | None,
    names: Sequence[str],
    *,
    compass: bool = True,
    tolerances: Tolerances = UNCALIBRATED,
    lagging: Collection[str] = FOREARM,
) -> HeadingAlignment:
    """Find how sensors are headed, from a turn of the whole rig, which is stiff.

    Args:
        before: Rest before the turn, half a second or more.
        turning: The turn, there and back or one way.
        after: Rest after it, where there is one.
        names: Of the sensors.
        compass: Whether the common heading is the compasses' mean, or the turn's own.
        tolerances: What the sensors are off by.
        lagging: Names of the sensors on a forearm.

    Raises:
        CalibrationError: the rig did not rest, or turn, or turned about too steep an axis; too few
            sensors answered or moved as one; no compass answered.
    """
    parts = [before, turning] if after is None else [before, turning, after]
    unrest = max(_unrest(part) for part in parts[::2])
    _refuse_restless(unrest)
    heard = _heard(parts)
    _refuse_few(len(heard), len(names))
    signals = signals_of([_of(part, heard) for part in parts])
    mine = [names[i] for i in heard]
    lag = [tolerances.forearm_lag if name in lagging else tolerances.lag for name in mine]
    found = solved(signals, tolerances, np.array(lag))
    psi_wg = wrapped(so3.heading(found.q_body_level) + wg_heading(found.common.axis))
    psi_cor = psi_wg
    if compass:
        psi_cor = _onto_compasses(compass_headings(before)[heard], psi_wg, ~found.outlying)
    verdict = _verdict(found, unrest, mine)
    _refuse_apart(found)
    silent = len(names), heard
    return HeadingAlignment(
        names=tuple(names),
        psi_cor=_filled(*silent, psi_cor, 0.0),
        psi_wg=_filled(*silent, psi_wg, 0.0),
        sd=_filled(*silent, found.sd, np.inf),
        residual=_filled(*silent, found.residual, np.nan),
        together=_filled(*silent, found.together, np.nan),
        outlying=tuple(bool(x) for x in _filled(*silent, found.outlying, 1.0)),
        turn=found.common.turn,
        axis_tilt=found.common.axis_tilt,
        verdict=verdict,
    )


def at_peak(
    before: ImuSamples, turning: ImuSamples, *, compass: bool = True
) -> tuple[Float[Array, " s"], Float[Array, " s"]]:
    """The thesis's way, ``(psi_cor, psi_wg)`` [rad]: one sample (4.18 to 4.22).

    The same sample for all sensors, where the median over them of the angular velocity is largest:
    a turn there and back has two peaks, and the axis of one is the other's reversed.
    """
    level = attitude(valid_mean(before.acc, before.valid))
    rate = so3.rotate(level, turning.gyr - valid_mean(before.gyr, before.valid))
    psi_wg = wg_heading(rate[np.argmax(np.median(np.linalg.norm(rate, axis=-1), axis=1))])
    if not compass:
        return psi_wg, psi_wg
    psi_d = compass_headings(before) - psi_wg
    return wrapped(np.angle(np.exp(1j * psi_d).mean()) - psi_d), psi_wg


def _onto_compasses(
    psi: Float[Array, " s"], psi_wg: Float[Array, " s"], good: Bool[Array, " s"]
) -> Float[Array, " s"]:
    """``psi_cor`` (4.20, 4.21); a sensor without a compass is taken to point north."""
    told = good & np.isfinite(psi)
    if not told.any():
        raise CalibrationError(
            "No compass gave a reading in the rest before the turn.",
            "Align the headings without compasses, or use sensors that have them.",
        )
    psi_d = np.nan_to_num(psi) - psi_wg
    return wrapped(robust_mean(psi_d[told]) - psi_d)


def _heard(parts: Sequence[ImuSamples]) -> list[int]:
    """Sensors that answered more than half of the time in every part."""
    shares = [part.valid.mean(axis=0) for part in parts]
    return [int(i) for i in np.flatnonzero(np.min(shares, axis=0) > 0.5)]


def _of(part: ImuSamples, sensors: Sequence[int]) -> ImuSamples:
    columns = (getattr(part, name)[:, list(sensors)] for name in ImuSamples.__slots__[1:])
    return ImuSamples(part.time_us, *columns)


def _filled(count: int, heard: Sequence[int], values: Array, silent: float) -> tuple[float, ...]:
    whole = np.full(count, silent)
    whole[list(heard)] = values
    return tuple(whole.tolist())


def _unrest(rest: ImuSamples) -> float:
    """How fast the rig turned [rad/s]: RMS, or by the tilt between halves, or a spin."""
    if len(rest) < 2:
        return float("inf")
    step_s = float(np.median(np.diff(rest.time_us))) * 1e-6
    time_s, gyr, acc, _ = blocks_of(rest, max(1, round(_TREMOR_S / step_s)))
    if len(time_s) < 4:
        return float("inf")
    half = len(time_s) // 2
    up = [part.mean(axis=0) for part in (acc[:half], acc[half:])]
    tilt = np.linalg.norm(np.cross(*up), axis=-1) / np.maximum(np.sum(up[0] * up[1], -1), 1e-9)
    shaking = np.linalg.norm(np.std(gyr, axis=0), axis=-1)
    spins = np.abs(so3.rotate(attitude(acc.mean(axis=0)), gyr.mean(axis=0))[:, 2])
    spin = float(np.median(spins))
    span_s = 0.5 * float(time_s[-1] - time_s[0])
    turning = max(float(np.median(shaking)), float(np.median(np.abs(tilt))) / span_s)
    return max(turning, spin) if spin > _SPINNING else turning


def _verdict(found: Found, unrest: float, names: Sequence[str]) -> Verdict:
    def worst(what: What, values: Array, limit: float, unit: Unit) -> Reading:
        i = int(np.argmax(values))
        value, most = float(np.rad2deg(values[i])), float(np.rad2deg(limit))
        return Reading(what, value, most, unit, at_least=False, about=names[i])

    turn, least = float(np.rad2deg(found.common.turn)), float(np.rad2deg(LEAST_TURN))
    still, most = float(np.rad2deg(unrest)), float(np.rad2deg(_STILL))
    readings = (
        Reading("turn", turn, least, "deg"),
        worst("together", found.together, _TOGETHER, "deg"),
        Reading("stillness", still, most, "deg/s", at_least=False),
        worst("residual", found.residual, _RESIDUAL, "deg/s"),
    )
    return Verdict(TURN.name, readings)


def _refuse_restless(unrest: float) -> None:
    if unrest > 4.0 * _STILL:
        raise CalibrationError(
            "The rig did not rest beside the turn: {found:.1f} deg/s, limit {limit:.1f}.",
            "Lay hand and arm down, keep still for two seconds before and after, and turn again.",
            found=float(np.rad2deg(unrest)),
            limit=float(np.rad2deg(4.0 * _STILL)),
        )


def _refuse_few(heard: int, count: int) -> None:
    if heard == 0 or 2 * heard < count:
        raise CalibrationError(
            "Only {heard} of {count} sensors answered during rest and turn; half are needed.",
            "Check the plugs and the cable, then rest and turn again.",
            heard=heard,
            count=count,
        )


def _refuse_apart(found: Found) -> None:
    apart = float(np.median(found.together))
    if apart > 3.0 * _TOGETHER:
        raise CalibrationError(
            "The sensors did not turn as one: most moved by {found:.0f} deg; limit {limit:.0f}.",
            "Keep wrist and fingers as stiff as a board while you lift the arm.",
            found=float(np.rad2deg(apart)),
            limit=float(np.rad2deg(3.0 * _TOGETHER)),
        )
