"""How well a tumble finds the errors of sensors, on virtual people and one real recording.

    python -m benchmarks.sensor_errors --json FILE

Virtual people with typical sensors tumble a stiff hand; what is found is held against what was
drawn, which the calibration cannot see. ``HANDSTUDIO_DATA`` may name a folder with the recording
``imu_tk`` (Tedaldi et al., ICRA 2014); its sensor's factory calibration is known.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.imu_tk import imu_tk, show_imu_tk
from benchmarks.trials import RATE_HZ, performance
from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.sensors import calibrate_sensors
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.recording.material import RECORDINGS
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.shell import out, print_table
from handstudio.simulation.imperfections.drawn import WARM_UP_S, Drawn
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.subject import DEVELOPMENT, REPORTING, subject
from handstudio.simulation.world import World
from handstudio.simulation.worn import Worn, begin, sense, wear

MOTION = "quick_start+tumble"

BASE = "bias,scale,misalignment,hard_iron,soft_iron,compass_scatter"
BUDGET = (
    "white_noise", "quantisation", "random_walk", "turn_on_bias", "temperature", "g_sensitivity",
    "skew", "jitter", "mounting", "soft_tissue", "board_slip", "mag_noise", "magnetic_gradient",
    "desk_edge",
)  # fmt: skip
"""What is added to what is looked for, one at a time."""

_ATTITUDES = 300  # that headings are compared at
_BLOCK = 1000

Found = dict[str, Array]


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    subjects: int = 6,
    imperfections: str = "typical",
    motion: str = MOTION,
    development: bool = False,
    budget: bool = False,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        subjects: How many people.
        imperfections: ideal, plain, typical, harsh, and changes to it.
        motion: What they do; there must be a tumble in it.
        development: People and seeds that parameters may be chosen on, not those reported.
        budget: Add one imperfection at a time to what is looked for, on two people.
    """
    people = (DEVELOPMENT if development else REPORTING)[:subjects]
    found = measured(people, development, imperfections, motion)
    _show(f"{len(people)} people, {imperfections}, {motion}", found)
    if budget:
        found["budget"] = _budget(people[:2], development)
    folder = os.environ.get(RECORDINGS)
    if folder and (Path(folder) / "imu_tk").is_dir():
        found["imu_tk"] = imu_tk(Path(folder) / "imu_tk")
        show_imu_tk(found["imu_tk"])
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def measured(
    people: Iterable[int],
    development: bool,
    imperfections: str = "typical",
    motion: str = MOTION,
) -> dict[str, Any]:
    """Errors of all sensors of these people, ``before`` and ``after`` calibration.

    Each has ``gyro_scale_pct``, ``acc_scale_pct``, ``acc_bias_mg``, ``gyro_bias_dps`` over sensors
    and axes, ``gyr_misalignment_deg`` and ``heading_deg`` over sensors, all as median, 95th
    percentile and worst. Misalignment: the worst of the off-diagonals of the gyroscope in the
    accelerometer's frame. Heading: of attitudes from accelerometer and magnetometer in an even
    field, RMS over attitudes.
    """
    seeds = 0 if development else 10_000  # kept apart as the people are
    before, after, verdicts, lost = list[Found](), list[Found](), list[bool](), 0
    for person in people:
        worn, samples = tumbled(person, seeds + person, imperfections, motion)
        names = worn.layout.names
        calibration, verdict = calibrate_sensors(samples, names)
        verdicts.append(verdict.ok)
        lost += len(names) - len(calibration.sensors)
        middle_s = 0.5e-6 * float(samples.time_us[0] + samples.time_us[-1])
        before.append(_errors(worn.drawn, _nothing_known(len(names)), middle_s))
        after.append(_errors(worn.drawn, _known(calibration, names), middle_s))
    return {
        "people": list(people),
        "imperfections": imperfections,
        "motion": motion,
        "verdicts_ok": sum(verdicts),
        "sensors_left_out": lost,
        "before": _summed(before),
        "after": _summed(after),
    }


def tumbled(person: int, seed: int, imperfections: str, motion: str) -> tuple[Worn, ImuSamples]:
    """What the sensors of a person read, and whose they are."""
    someone = subject(person, "right")
    performed = performance(someone, motion, seed)
    worn = wear(someone, glove("right"), parse(imperfections), seed)
    state, parts = begin(worn), list[ImuSamples]()
    count = round(performed.duration_s * RATE_HZ)
    for start in range(0, count, _BLOCK):
        index = np.arange(start, min(start + _BLOCK, count))
        sensed, state = sense(worn, state, performed, index * (1_000_000 // RATE_HZ), RATE_HZ)
        parts.append(sensed.samples)
    slots = ImuSamples.__slots__
    return worn, ImuSamples(*(np.concatenate([getattr(p, name) for p in parts]) for name in slots))


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """Corrections of the sensors at these places of a glove."""

    at: list[int]
    acc: Array
    acc_bias: Array
    gyr: Array
    gyr_bias: Array
    mag: Array
    mag_bias: Array


def _known(calibration: DeviceCalibration, names: Sequence[str]) -> _Known:
    sensors = [s for s in calibration.sensors if s.mag_matrix is not None]
    return _Known(
        [names.index(s.name) for s in sensors],
        *(
            np.array([getattr(s, name) for s in sensors])
            for name in (
                "acc_matrix", "acc_bias", "gyr_matrix", "gyr_bias", "mag_matrix", "mag_bias",
            )
        ),
    )  # fmt: skip


def _nothing_known(count: int) -> _Known:
    unity, zero = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    return _Known(list(range(count)), unity, zero, unity, zero, unity, zero)


def _errors(drawn: Drawn, known: _Known, middle_s: float) -> Found:
    """What is left, in the frame that the accelerometer is corrected into."""
    inertial, at = drawn.inertial[known.at], known.at
    of_acc, of_gyr = inertial[:, :3, :3], inertial[:, 3:, 3:]
    u, _, v = np.linalg.svd(known.acc @ of_acc)
    to_frame = (u @ v).swapaxes(1, 2)
    acc, gyr = to_frame @ known.acc @ of_acc, to_frame @ known.gyr @ of_gyr
    kelvin = -drawn.warm_up[at] * np.exp(-middle_s / WARM_UP_S)
    bias = drawn.bias[at] + drawn.per_kelvin[at] * kelvin[:, None]
    return {
        "gyro_scale_pct": 100.0 * np.abs(np.diagonal(gyr, axis1=1, axis2=2) - 1.0).ravel(),
        "acc_scale_pct": 100.0 * np.abs(np.diagonal(acc, axis1=1, axis2=2) - 1.0).ravel(),
        "acc_bias_mg": 1e3 / STANDARD_GRAVITY * np.abs(known.acc_bias - bias[:, :3]).ravel(),
        "gyro_bias_dps": np.rad2deg(np.abs(known.gyr_bias - bias[:, 3:])).ravel(),
        "gyr_misalignment_deg": np.rad2deg(np.abs(gyr * (1.0 - np.eye(3))).max(axis=(1, 2))),
        "heading_deg": _headings(drawn, known, bias, to_frame),
    }


def _headings(drawn: Drawn, known: _Known, bias: Array, to_frame: Array) -> Array:
    """How far headings of compasses are off, RMS over attitudes, (s,) [deg]."""
    normal = np.random.default_rng(0).standard_normal((_ATTITUDES, 1, 4))
    q_world_sensor = so3.normalize(normal)
    back = so3.conjugate(q_world_sensor)
    up = so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY]))
    field = so3.rotate(back, np.array(World().field_ut))
    at = known.at
    acc = np.einsum("sij,nsj->nsi", drawn.inertial[at, :3, :3], up + 0.0 * bias[:, :3])
    mag = np.einsum("sij,nsj->nsi", drawn.magnetic[at], field + 0.0 * bias[:, :3])
    acc = np.einsum("sij,nsj->nsi", known.acc, acc + bias[:, :3] - known.acc_bias)
    mag = np.einsum("sij,nsj->nsi", known.mag, mag + drawn.hard_iron[at] - known.mag_bias)
    q_sensor_frame = so3.from_matrix(to_frame.swapaxes(1, 2))
    off = so3.multiply(so3.multiply(attitude(acc, mag), q_sensor_frame), back)
    heading = np.angle(np.exp(1j * so3.heading(off)))
    return np.asarray(np.rad2deg(np.sqrt(np.mean(heading**2, axis=0))))


def _summed(found: Sequence[Found]) -> dict[str, dict[str, float]]:
    return {name: _figures(np.concatenate([each[name] for each in found])) for name in found[0]}


def _figures(values: Array) -> dict[str, float]:
    return {
        "median": float(np.median(values)),
        "p95": float(np.percentile(values, 95)),
        "worst": float(values.max()),
    }


def _budget(people: Sequence[int], development: bool) -> dict[str, Any]:
    costs = {
        name: measured(people, development, BASE if name == "nothing" else f"{BASE},{name}")
        for name in ("nothing", *BUDGET)
    }
    shown = (
        "gyro_scale_pct",
        "acc_scale_pct",
        "acc_bias_mg",
        "gyr_misalignment_deg",
        "heading_deg",
    )
    rows = [
        [name, *(f"{cost['after'][key]['p95']:.4f}" for key in shown)]
        for name, cost in costs.items()
    ]
    print_table("95th percentiles with one imperfection added", ["added", *shown], rows)
    return {name: cost["after"] for name, cost in costs.items()}


def _show(title: str, found: dict[str, Any]) -> None:
    rows = [
        [name, *(" | ".join(f"{v:.4g}" for v in found[when][name].values()) for when in _WHEN)]
        for name in found["after"]
    ]
    print_table(title, ["median | p95 | worst", *_WHEN], rows)
    out.print(f"sensors left out: {found['sensors_left_out']}; verdicts ok: {found['verdicts_ok']}")


_WHEN = ("before", "after")


if __name__ == "__main__":
    tyro.cli(main)
