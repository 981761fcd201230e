"""Recordings made by others through our pipeline, against their optical truth.

    python -m benchmarks.real --data DIR --json FILE

Reads any trials in ``DIR/broad/*.mat`` and ``DIR/dfjimu/*.mat``. Each is written as a raw import
folder, imported as a take, processed from the take, and compared.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
import numpy as np
import tyro
from scipy.io import loadmat

from benchmarks.recordings import broad_folder, dfjimu_folder
from handstudio.analysis.orientation_error import (
    orientation_error,
    relative_error,
    with_oracle_heading,
)
from handstudio.arrays import Array
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.kinematics import relative_rotations
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.notes import Label, load_notes
from handstudio.recording.raw_import import import_folder
from handstudio.recording.reference import Reference, load_reference
from handstudio.recording.take import Take, open_take
from handstudio.setup import JointGeometry, Setup, filter_named, smoothing
from handstudio.shell import out, print_table

# Published or measured on all trials there are (30 and 15); ours below are those found in DIR.
VQF_ON_BROAD = {"total": 2.43, "heading": 2.27, "inclination": 0.72}
DFJIMU_REFERENCES = {"online": 4.89, "offline": 2.99, "inclination_only": 1.94}


@dataclass(frozen=True, slots=True)
class Compared:
    """Estimate and reference at the same instants."""

    take: Take
    setup: Setup
    motion: Motion
    reference: Reference
    rows: Array  # of the motion
    reference_rows: Array


def main(
    data: Path,
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    sessions: Path | None = None,
    filter: str = "tree",
) -> None:
    """Compare with optical truth.

    Args:
        data: Folder with ``broad`` and ``dfjimu`` in it.
        json_file: Where to write the figures.
        filter: Which filter fuses them.
        sessions: Keep the imported takes in this folder, to look at them in the studio.
    """
    with tempfile.TemporaryDirectory() as temporary:
        place = sessions or Path(temporary) / "sessions"
        broad = {
            trial.stem: broad_trial(imported(trial, broad_folder, place, "BROAD", filter))
            for trial in sorted((data / "broad").glob("*.mat"))
        }
        dfjimu = {
            trial.stem: dfjimu_trial(imported(trial, dfjimu_folder, place, "dfjimu", filter), trial)
            for trial in sorted((data / "dfjimu").glob("*.mat"))
        }
    figures = {
        "broad": {"mean": mean(broad), "trials": broad},
        "dfjimu": {"mean": mean(dfjimu), "trials": dfjimu},
    }
    _show(broad, dfjimu)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")


def broad_trial(compared: Compared) -> dict[str, float | None]:
    """Errors over the movement phase [deg]."""
    moving = _labelled(compared, load_notes(compared.take.path).labels)
    q_est = compared.motion.q_world_sensor[compared.rows, 0][moving]
    q_ref = compared.reference.q_world_sensor[compared.reference_rows, 0][moving]
    error = orientation_error(q_ref, q_est)
    return {
        "total": float(np.rad2deg(error.total)),
        "heading": float(np.rad2deg(error.heading)),
        "inclination": float(np.rad2deg(error.inclination)),
    }


def dfjimu_trial(compared: Compared, trial: Path) -> dict[str, float | None]:
    """Error of the relative orientation [deg]; null where the filter does not see both segments."""
    q_est = compared.motion.q_world_sensor[compared.rows]
    q_ref = compared.reference.q_world_sensor[compared.reference_rows]
    parent, child = (with_oracle_heading(q_ref[:, i], q_est[:, i]) for i in (0, 1))
    assert list(relative_rotations(compared.take.header.setup.layout, q_est)) == ["joint"]
    inclination = relative_error(q_ref[:, 0], q_ref[:, 1], parent, child)
    online = offline = None
    setup = msgspec.structs.replace(compared.setup, joints=(_given_arms(trial),))
    if isinstance(setup.filter, TreeFilter):
        online = _relative(compared, setup, q_ref)
        offline = _relative(compared, smoothing(setup), q_ref)
    return {
        "online": online,
        "offline": offline,
        "inclination_only": float(np.rad2deg(inclination)),
    }


def _relative(compared: Compared, setup: Setup, q_ref: Array) -> float:
    q = process(compared.take, setup).q_world_sensor[compared.rows]
    return float(np.rad2deg(relative_error(q_ref[:, 0], q_ref[:, 1], q[:, 0], q[:, 1])))


def _given_arms(trial: Path) -> JointGeometry:
    """The arms that come with a recording, from the sensors to the joint; no axes are told."""
    data = loadmat(trial, squeeze_me=True, struct_as_record=False)["data"]
    one, two = (tuple(float(x) for x in np.ravel(r)) for r in (data.r_12, data.r_21))
    return JointGeometry("joint", cast(Any, one), cast(Any, two))


def imported(
    trial: Path, write: Callable[[Path, Path], None], sessions: Path, subject: str, filter: str
) -> Compared:
    """A trial as its maker left it, through import, take and process."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / trial.stem
        write(trial, folder)
        take = open_take(import_folder(folder, sessions, subject))
    # both makers' sensors sample faster than they tell, and give means
    setup = msgspec.structs.replace(take.header.setup, filter=filter_named(filter), mean_rates=True)
    motion, reference = process(take, setup), load_reference(take.path)
    # the take's time starts where the recording's does: both count microseconds from there
    _, rows, reference_rows = np.intersect1d(
        motion.time_us, reference.time_us, assume_unique=True, return_indices=True
    )
    return Compared(take, setup, motion, reference, rows, reference_rows)


def _labelled(compared: Compared, labels: tuple[Label, ...]) -> Array:
    time_us = compared.motion.time_us
    time_s = (time_us[compared.rows] - time_us[0]) * 1e-6
    inside = [(time_s >= label.start_s) & (time_s <= label.end_s) for label in labels]
    labelled: Array = np.logical_or.reduce(inside)
    return labelled


def mean(trials: dict[str, dict[str, float | None]]) -> dict[str, float | None]:
    """Mean over trials; null where one of them has none."""
    keys = next(iter(trials.values()), {})
    columns = {key: [trial[key] for trial in trials.values()] for key in keys}
    return {
        key: None if any(value is None for value in values) else float(np.mean(np.array(values)))
        for key, values in columns.items()
    }


def _show(broad: dict[str, dict[str, float | None]], dfjimu: dict[str, Any]) -> None:
    for title, trials, references in (
        ("BROAD: RMSE over the movement phase [deg]", broad, VQF_ON_BROAD),
        ("dfjimu: relative orientation, RMSE [deg]", dfjimu, DFJIMU_REFERENCES),
    ):
        rows = [[name, *map(_figure, trial.values())] for name, trial in trials.items()]
        rows.append(["mean of these", *map(_figure, mean(trials).values())])
        rows.append(["reference, all trials there are", *map(_figure, references.values())])
        print_table(title, ["trial", *references], rows)
        out.print()


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


if __name__ == "__main__":
    tyro.cli(main)
