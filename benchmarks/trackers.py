"""Joints found by trackers, on virtual people; and what a coil's range does to its noise.

    python -m benchmarks.trackers --json FILE

A terminal on each phalanx beside the index finger's DIP, a transmitter on the palm, five takes of
20 s: the seed's experiment. Points are held against the true centre, which no method can see.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks import late_trackers
from benchmarks.bent_joints import bent_joint, figures_of, skin_of_strength, summed
from benchmarks.coil_range import coil_range, show_range
from handstudio.errors import TrackError
from handstudio.shell import out, print_table
from handstudio.simulation.trackers import TrackerErrors
from handstudio.trackers.methods import METHODS, estimated
from handstudio.trackers.steady_axis import steady_axis

DEVELOPMENT = range(1, 13)
REPORTING = range(101, 113)

KEYS = {"all": "plane", "steady": "steady", "ours": "rolling"}
"""Names of the figures, and which method each is of."""

SENSITIVITY = {
    "skin that does not slide": {"slide": 0.0},
    "skin that slides half as far again": {"slide": 1.5},
    "skin that slides twice as far": {"slide": 2.0},
    "boards that rock twice as far": {"rock": 2.0},
}


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    people: int = 12,
    development: bool = False,
    late: bool = True,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        people: How many.
        development: People that parameters may be chosen on, not those reported.
        late: Also of late trackers, fused with gyroscopes.
    """
    numbers = (DEVELOPMENT if development else REPORTING)[:people]
    found: dict[str, Any] = {"people": list(numbers), "joint": joints(numbers)}
    found["coil"] = coil_range()
    show_range(found["coil"])
    if late:
        lately = late_trackers.figures()
        late_trackers.show(lately)
        found |= lately
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def joints(numbers: Iterable[int]) -> dict[str, Any]:
    """Everything about joints; the first keys are the ones with limits, means over people [mm]."""
    numbers = list(numbers)
    fingers, shares = by_method(numbers)
    mocks, mock_shares = by_method(numbers, mock=True)
    _show(f"Index DIP of {len(numbers)} people", fingers, shares)
    _show(f"A hinge of wood, {len(numbers)} of them", mocks, mock_shares)
    unknocked, unknocked_shares = by_method(numbers, errors=TrackerErrors(), methods=KEYS.values())
    _show("The fingers, terminals neither tugged at nor knocked", unknocked, unknocked_shares)
    sensitivity = {
        what: by_method(numbers, skin=skin_of_strength(**strengths), methods=("rolling",))[0]
        for what, strengths in SENSITIVITY.items()
    }
    sensitivity["one take instead of five"] = by_method(numbers, takes=1, methods=("rolling",))[0]
    sensitivity["index PIP"] = by_method(numbers, joint="index_pip", methods=("rolling",))[0]
    rows = [[what, *_row(of["rolling"])] for what, of in sensitivity.items()]
    print_table("Ours, where people are otherwise", ["", *_COLUMNS], rows)
    return {
        "pu_pl_mm": {key: fingers[name]["pu_pl_mm"]["mean"] for key, name in KEYS.items()},
        "error_mm": {key: fingers[name]["error_mm"]["mean"] for key, name in KEYS.items()},
        "mock_mm": mocks["plane"]["pu_pl_mm"]["mean"],
        "mock_by_mm": {key: mocks[name]["pu_pl_mm"]["mean"] for key, name in KEYS.items()},
        "mock_error_mm": {key: mocks[name]["error_mm"]["mean"] for key, name in KEYS.items()},
        "axis_shares": shares,
        "mock_axis_shares": mock_shares,
        "methods": fingers,
        "mock_methods": mocks,
        "unknocked_methods": unknocked,
        "sensitivity": sensitivity,
    }


def by_method(
    numbers: Iterable[int], methods: Iterable[str] = tuple(METHODS), **how: Any
) -> tuple[dict[str, Any], dict[str, float]]:
    """Figures of every method, and how axes lie: mean shares of frames above 0.9, 0.96, 0.99."""
    rows: dict[str, list[dict[str, float]]] = defaultdict(list)
    shares, refused = [], dict[str, int]()
    for number in numbers:
        bent = bent_joint(number, **how)
        axes = steady_axis(bent.pair)
        shares.append([axes.share(low) for low in (0.9, 0.96, 0.99)])
        for name in methods:
            try:
                rows[name].append(figures_of(estimated(bent.pair, METHODS[name]), bent))
            except TrackError as error:
                refused[name] = refused.get(name, 0) + 1
                out.print(f"{number}, {name}: {error.what}")
    found = {name: summed(each) | {"refused": refused.get(name, 0)} for name, each in rows.items()}
    mean = np.mean(shares, axis=0)
    return found, {f"above_{low}": float(m) for low, m in zip((0.9, 0.96, 0.99), mean, strict=True)}


_COLUMNS = ["P_U to P_L [mm]", "error [mm]", "worst", "across the axis [mm]", "own sd [mm]"]


def _row(figures: dict[str, Any]) -> list[str]:
    apart, error = figures["pu_pl_mm"], figures["error_mm"]
    return [
        f"{apart['mean']:.2f} (median {apart['median']:.2f})",
        f"{error['mean']:.2f}",
        f"{error['worst']:.2f}",
        f"{figures['across_axis_mm']['mean']:.2f}",
        f"{figures['sd_mm']['mean']:.2f}",
    ]


def _show(title: str, found: dict[str, Any], shares: dict[str, float]) -> None:
    print_table(title, ["method", *_COLUMNS], [[name, *_row(of)] for name, of in found.items()])
    told = ", ".join(f"{100 * s:.0f} % {n.replace('_', ' ')}" for n, s in shares.items())
    out.print(f"Share of the axis across the finger: {told}\n")


if __name__ == "__main__":
    tyro.cli(main)
