"""The accuracy bench's figures as tables and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from handstudio.shell import out, print_table


def show(found: dict[str, Any]) -> None:
    """Print what a person wants to read."""
    ours, thesis = found, found["thesis"]
    print_table(
        f"Virtual people {found['subjects']}, {found['imperfections']}",
        ["figure", "ours", "thesis"],
        [
            [what, _number(_at(ours, *path)), _number(_at(thesis, *path))]
            for what, *path in (
                ("orientation of segments, mean [deg]", "orientation_deg", "mean"),
                ("orientation, worst segment [deg]", "orientation_deg", "worst_segment"),
                *_FUNCTIONAL,
                ("common heading taken out [deg]", "orientation_deg", "common_heading"),
                ("joint angles, mean [deg]", "joint_angle_deg", "mean"),
                ("joint angles, worst [deg]", "joint_angle_deg", "worst_joint"),
                ("fingertips from the elbow [mm]", "fingertip_mm", "elbow"),
                ("fingertips in the hand [mm]", "fingertip_mm", "hand"),
                ("scatter of headings, SD [deg]", "heading_sd_deg"),
                *_INSIDE,
            )
            if (what, *path) not in (*_FUNCTIONAL, *_INSIDE) or _at(ours, *path) is not None
        ],
    )
    _show_sensors(found)
    if "budget" in found:
        _show_budget(found["budget"])
    if "thesis_experiment" in found:
        _show_thesis(found["thesis_experiment"])


def picture(found: dict[str, Any], path: Path) -> None:
    """Draw segments, angles, the error budget and the thesis's experiment."""
    import matplotlib as mpl  # noqa: PLC0415 - only where it is wanted

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(2, 2, figsize=(15, 11), layout="constrained")
    _bars(axes[0, 0], found["orientation_deg"]["segments"], "Orientation of segments")
    _bars(axes[0, 1], found["joint_angle_deg"]["angles"], "Joint angles")
    if "budget" in found:
        alone = {
            name.removeprefix("only "): figures["orientation_deg"]
            for name, figures in found["budget"].items()
            if name.startswith("only ")
        }
        ranked = dict(sorted(alone.items(), key=lambda item: -item[1]))
        _bars(axes[1, 0], ranked, "Orientation with one imperfection alone")
        ideal, everything = (found["budget"][k]["orientation_deg"] for k in ("ideal", "all"))
        axes[1, 0].axvline(ideal, color="0.4", lw=1, ls="--", label="none of them")
        axes[1, 0].axvline(everything, color="tab:red", lw=1, label="all of them")
        axes[1, 0].legend(loc="lower right")
    if "thesis_experiment" in found:
        _draw_thesis(axes[1, 1], found["thesis_experiment"])
    figure.suptitle(
        f"Virtual people, {found['imperfections']} imperfections, filter {found['filter']}, "
        f"calibration: {found['calibration']}"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    plt.close(figure)


_INSIDE = (
    ("errors within two SD, orientations [share]", "inside_two_sd", "own"),
    ("errors within two SD, relative [share]", "inside_two_sd", "relative"),
)

_FUNCTIONAL = (
    ("  against functional frames, mean [deg]", "orientation_deg", "functional", "mean"),
    ("  worst segment [deg]", "orientation_deg", "functional", "worst_segment"),
    ("  these against the simulator's frames [deg]", "orientation_deg", "definition", "mean"),
)


def _show_sensors(found: dict[str, Any]) -> None:
    places = found["sensor_mm"]["elbow"]
    rows = [
        [
            name,
            *(_number(error[kind]) for kind in ("total", "heading", "inclination")),
            _number(places[name]),
        ]
        for name, error in found["orientation_deg"]["sensors"].items()
    ]
    columns = ["sensor", "total", "heading", "inclination", "place from the elbow [mm]"]
    print_table("Every sensor, RMSE [deg]", columns, rows)
    rows = [[name, _number(error)] for name, error in found["joint_angle_deg"]["angles"].items()]
    print_table("Every joint angle, RMSE [deg]", ["angle", "error"], rows)


def _show_budget(budget: dict[str, Any]) -> None:
    everything = budget["all"]
    rows = []
    for case, figures in budget.items():
        kind, _, name = case.partition(" ")
        if kind == "only":
            without = budget.get(f"without {name}")
            costs = [everything[k] - without[k] if without else None for k in figures]
            rows.append([name, *map(_number, figures.values()), *map(_number, costs)])
    rows.sort(key=lambda row: -float(row[1]))
    measured = ["orientation [deg]", "angles [deg]", "tips in the hand [mm]"]
    print_table(
        "What costs how much: alone, and what goes when it is left out of all",
        ["imperfection", *measured, *(f"- {name}" for name in measured)],
        rows,
    )
    groups = [[case, *map(_number, figures.values())] for case, figures in budget.items()]
    wanted = [row for row in groups if not row[0].startswith("only ")]
    print_table("Sets of them", ["imperfections", *measured], wanted)


def _show_thesis(experiment: dict[str, Any]) -> None:
    for setting, figures in experiment["settings"].items():
        rows = [
            [f"{name}, {where}", *map(_number, values), _number(float(np.mean(values)))]
            for where, filters in figures.items()
            for name, values in filters.items()
        ]
        columns = ["filter", *experiment["sensors"], "mean"]
        print_table(f"The thesis's experiment, elbow {setting}: RMSE norm [deg]", columns, rows)
    out.print()


def _bars(axes: Any, values: dict[str, float], title: str) -> None:
    names = list(values)[::-1]
    axes.barh(names, [values[name] for name in names], color="#4477aa")
    axes.set(title=title, xlabel="RMSE [deg]")
    axes.tick_params(axis="y", labelsize=8)
    axes.grid(axis="x", alpha=0.3)


def _draw_thesis(axes: Any, experiment: dict[str, Any]) -> None:
    settings = experiment["settings"]
    width, at = 0.08, np.arange(len(settings))
    published, *ours = next(iter(settings.values()))
    kinds = [(w, n) for n in ("raw", "filter1", "filter4") for w in (published, *ours)]
    kinds += [(w, "vqf") for w in ours]
    for k, (where, name) in enumerate(kinds):
        heights = [float(np.mean(one[where][name])) for one in settings.values()]
        hatch = "//" if where == published else ""
        axes.bar(at + width * (k - 5), heights, width, label=f"{name}, {where}", hatch=hatch)
    axes.set_xticks(at, list(settings))
    axes.set(title="The thesis's experiment: mean of five sensors", ylabel="RMSE norm [deg]")
    axes.set_ylim(top=1.45 * axes.get_ylim()[1])  # room for the legend
    axes.legend(fontsize=8, ncols=2, loc="upper left")
    axes.grid(axis="y", alpha=0.3)


def _at(found: Any, *path: str) -> float | None:
    for key in path:
        found = found.get(key) if isinstance(found, dict) else None
    return None if found is None else float(found)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
