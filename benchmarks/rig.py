"""Lever arms of a real two-segment rig, from its two inertial sensors alone.

    python -m benchmarks.rig --data DIR --json FILE

Reads ``DIR/dfjimu/data_<axes>D_<trial>.mat`` (benchmarks/recordings.py). Trials of one joint are
one rig: sensors and joint stayed as they were. How far the arms scatter between them, per
component around the rig's mean, then RMS over components and rigs, is the figure. Along a hinge's
axis neither sensor tells where the joint is: that component is left out of every figure of the
one-axis trials, ours and others'. Nothing is chosen per trial, and the optical reference is not
used but for the last column: the arms of its markers, that ours may differ from by one constant.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from scipy.io import loadmat

from benchmarks.recordings import DFJIMU_RATE_HZ
from handstudio.arrays import Array
from handstudio.calibration.rigid_rotation import RigidRotation, smoothed
from handstudio.calibration.two_sided import BothSides, by_norms, by_vectors
from handstudio.maths import so3
from handstudio.shell import out, print_table

LITERATURE_MM = (2.2, 2.5)
"""Of the first and the second sensor, as published, by a rule of its own."""

_STILL = np.deg2rad(1.5)  # a second that turns less, all of it, tells the gyroscope's bias


@dataclass(frozen=True, slots=True, eq=False)
class Arms:
    """From the joint's centre to both sensors, in their frames [m]; six numbers each.

    Attributes:
        norms: From norms.
        vectors: From vectors.
        given: Those that come with the recording.
        optical: From the joint to the reference's markers; they sit elsewhere than the sensors.
        seen: Which components the trial can tell.
        sd: Standard deviations of the first two, as estimated.
        unseen: Of both sensors, from norms.
    """

    norms: Array
    vectors: Array
    given: Array
    optical: Array
    seen: Array
    sd: dict[str, Array]
    unseen: Array


def main(data: Path, json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None) -> None:
    """Compare lever arms between trials.

    Args:
        data: Folder with ``dfjimu`` in it.
        json_file: Where to write the figures.
    """
    figures = measured(data / "dfjimu")
    _show(figures)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")


def measured(folder: Path) -> dict[str, Any]:
    """Figures of all trials in a folder [mm].

    ``lever_arm_scatter_mm`` is that of the vectors, all components that are seen, both sensors.
    """
    trials = {path.stem: arms(path) for path in sorted(folder.glob("data_*D_*.mat"))}
    scatter = {kind: _scatter(trials, kind) for kind in ("vectors", "norms", "given", "optical")}
    return {
        "lever_arm_scatter_mm": scatter["vectors"]["both"],
        "scatter_mm": scatter,
        "predicted_sd_mm": {kind: _predicted(trials, kind) for kind in ("vectors", "norms")},
        "against_optical_mm": {
            kind: _against_optical(trials, kind) for kind in ("vectors", "norms", "given")
        },
        "literature_mm": LITERATURE_MM,
        "trials": {name: _trial_figures(trial) for name, trial in trials.items()},
    }


def arms(trial: Path) -> Arms:
    """Lever arms of one trial, in every way there is."""
    data = loadmat(trial, squeeze_me=True, struct_as_record=False)["data"]
    sensors = np.asarray(data.sensorData, dtype=float)
    one, two = (_sensor(sensors[:, k : k + 3], sensors[:, k + 3 : k + 6]) for k in (0, 6))
    by_norm = by_norms(one, two)
    by_vector = by_vectors(one, two, _turned(one), _turned(two))
    unseen = np.stack([by_norm.one.unseen, by_norm.two.unseen])
    return Arms(
        norms=_six(by_norm),
        vectors=_six(by_vector),
        # they point from the sensors to the joint
        given=-np.concatenate([data.r_12, data.r_21]).astype(float),
        optical=_optical(np.asarray(data.ref, dtype=float)),
        seen=np.abs(unseen).ravel() < 0.5,
        sd={"norms": _sd(by_norm), "vectors": _sd(by_vector)},
        unseen=unseen,
    )


def _sensor(acc: Array, gyr: Array) -> RigidRotation:
    return smoothed(acc, gyr - _bias(gyr), DFJIMU_RATE_HZ)


def _bias(gyr: Array) -> Array:
    """Mean of the stillest second, if it was still."""
    size = round(DFJIMU_RATE_HZ)
    seconds = gyr[: len(gyr) // size * size].reshape(-1, size, 3)
    fastest = np.linalg.norm(seconds, axis=-1).max(axis=1)
    stillest = int(np.argmin(fastest))
    return np.asarray(seconds[stillest].mean(axis=0) if fastest[stillest] < _STILL else np.zeros(3))


def _turned(sensor: RigidRotation) -> Array:
    """Orientation by the gyroscope alone, in a world of its own."""
    steps = so3.exp(0.5 * (sensor.gyr[1:] + sensor.gyr[:-1]) / sensor.rate_hz)
    q, reach = np.concatenate([so3.IDENTITY[None], steps]), 1
    while reach < len(q):  # products of 2, 4, 8, ... steps
        q[reach:] = so3.multiply(q[:-reach], q[reach:])
        reach *= 2
    return so3.normalize(q)


def _optical(reference: Array) -> Array:
    """Arms of the reference's frames: ``p_1 - R_1 P_1 = p_2 - R_2 P_2``; jumps weigh little."""
    r = [so3.to_matrix(reference[:, k : k + 4]) for k in (0, 4)]
    apart = reference[:, 8:11] - reference[:, 11:14]
    rows, weight = np.concatenate([r[0], -r[1]], axis=-1), np.ones(len(apart))
    for _ in range(20):
        by = np.sqrt(weight)[:, None]
        solved = np.linalg.lstsq((rows * by[..., None]).reshape(-1, 6), (apart * by).ravel())[0]
        left = np.linalg.norm(rows @ solved - apart, axis=1)
        weight = 1.0 / (1.0 + (left / (2.0 * np.median(left))) ** 4)
    return np.asarray(solved)


def _scatter(trials: dict[str, Arms], kind: str) -> dict[str, Any]:
    """RMS over components of the SD over a rig's trials around their mean."""
    per_rig = {rig: _variances(trials, rig, kind) for rig in _rigs(trials)}
    whole = np.stack(list(per_rig.values()))
    return {
        "both": _rms(whole),
        "first": _rms(whole[:, :3]),
        "second": _rms(whole[:, 3:]),
        "rigs": {rig: _rms(variances) for rig, variances in per_rig.items()},
    }


def _variances(trials: dict[str, Arms], rig: str, kind: str) -> Array:
    of_rig = [trial for name, trial in trials.items() if _rig(name) == rig]
    variances = np.var([getattr(trial, kind) for trial in of_rig], axis=0, ddof=1)
    return np.where(np.all([trial.seen for trial in of_rig], axis=0), variances, np.nan)


def _predicted(trials: dict[str, Arms], kind: str) -> float:
    return _rms(np.stack([np.where(t.seen, t.sd[kind] ** 2, np.nan) for t in trials.values()]))


def _against_optical(trials: dict[str, Arms], kind: str) -> float:
    """SD over the trials of all rigs of what the arms differ from the optical ones by.

    Markers sit fixed on the sensors; what all trials share is where.
    """
    differ = np.stack(
        [np.where(t.seen, getattr(t, kind) - t.optical, np.nan) for t in trials.values()]
    )
    return _rms(np.nanvar(differ, axis=0, ddof=1))


def _trial_figures(trial: Arms) -> dict[str, Any]:
    kinds = ("norms", "vectors", "given", "optical")
    places = {kind: (1e3 * getattr(trial, kind)).round(2).tolist() for kind in kinds}
    sds = {f"sd_{kind}": (1e3 * sd).round(2).tolist() for kind, sd in trial.sd.items()}
    return {**places, **sds, "seen": trial.seen.tolist(), "unseen": trial.unseen.round(3).tolist()}


def _rigs(trials: dict[str, Arms]) -> list[str]:
    """Rigs that several trials are of."""
    names = [_rig(name) for name in trials]
    return sorted({name for name in names if names.count(name) > 1})


def _rig(trial: str) -> str:
    return trial.split("_")[1]


def _six(found: BothSides) -> Array:
    return np.concatenate([found.one.from_centre_m, found.two.from_centre_m])


def _sd(found: BothSides) -> Array:
    return np.asarray(np.sqrt(np.diag(found.covariance)))


def _rms(variances: Array) -> float:
    """Root of the mean, in mm."""
    return float(1e3 * np.sqrt(np.nanmean(variances)))


def _show(figures: dict[str, Any]) -> None:
    scatter, against = figures["scatter_mm"], figures["against_optical_mm"]
    columns = ["both", "first", "second"]
    rows = [
        [
            kind,
            *(f"{of[column]:.2f}" for column in columns),
            *(f"{value:.2f}" for value in of["rigs"].values()),
            f"{against[kind]:.2f}" if kind in against else "-",
        ]
        for kind, of in scatter.items()
    ]
    first, second = figures["literature_mm"]
    rows.append(["literature", "-", f"{first:.2f}", f"{second:.2f}", "-", "-", "-", "-"])
    rigs = list(scatter["vectors"]["rigs"])
    header = ["arms", *columns, *rigs, "optical, all rigs"]
    print_table("Lever arms: scatter between trials of one rig [mm]", header, rows)
    out.print()


if __name__ == "__main__":
    tyro.cli(main)
