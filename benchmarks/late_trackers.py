"""A late tracker with gyroscopes, and the place it gives to an inertial hand.

    python -m benchmarks.late_trackers --json FILE

First the published experiment (Emura and Tachi 1993), simulated: 10 s of a head, and of virtual
hands, by a tracker at 50 Hz that is 0.1 s late and gyroscopes at 100 Hz that drift. Then virtual
people who throw balls, with a tracker at 60 Hz, 50 ms late, on the hand or on the forearm.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.late_motion import Watched, hand, head
from benchmarks.late_place import Placing, place
from handstudio.arrays import Array
from handstudio.shell import out, print_table
from handstudio.simulation.subject import DEVELOPMENT, REPORTING
from handstudio.trackers import late_attitude
from handstudio.trackers.late_euler import euler_of, shorter
from handstudio.trackers.late_methods import (
    Published,
    gyro_alone,
    method_one,
    method_two,
    tracker_alone,
)

AXES = ("azimuth", "elevation", "roll")
PAPER = {
    "tracker": (7.12, 9.22, 9.00),
    "gyro": (47.1, 16.3, 19.5),
    "kalman": (8.16, 12.9, 16.8),
    "method1": (6.00, 3.52, 4.30),
    "method2": (5.38, 3.72, 4.26),
}
PAPER_MS = {"method1": 39.2, "method2": 9.6}
"""For 40 ms of data, on a 33 MHz 80386."""

_LIKE = Published()
_OURS = late_attitude.LateFilter(delay_s=0.08)  # it is told 20 ms too little, and finds the rest


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    seeds: int = 12,
    people: int = 4,
    development: bool = False,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        seeds: How many recordings of 10 s of heads, and of hands.
        people: How many people throw.
        development: Seeds and people that parameters may be chosen on, not those reported.
    """
    found = figures(seeds=seeds, people=people, development=development)
    show(found)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(found, indent=2), encoding="utf-8")


def figures(*, seeds: int = 12, people: int = 4, development: bool = False) -> dict[str, Any]:
    """All figures; keys as in docs/late-trackers.md."""
    numbers = (DEVELOPMENT if development else REPORTING)[:seeds]
    heads = [head(number) for number in numbers]
    hands = [hand(number, number) for number in numbers]
    rms = {
        name: {"head": _rms(follow, heads), "hand": _rms(follow, hands)}
        for name, follow in METHODS.items()
    }
    return {
        "late": {"rms_1e2rad": rms, "time_of_method1": _times(heads[0])},
        "root": _placed((DEVELOPMENT if development else REPORTING)[:people], development),
    }


def _ours(it: Watched) -> Array:
    start = late_attitude.begin(_OURS)
    followed, _ = late_attitude.run(_OURS, start, it.time_us, it.gyr, it.track)
    return euler_of(followed.q_room_sensor)


METHODS: dict[str, Callable[[Watched], Array]] = {
    "tracker": lambda it: tracker_alone(it.track, it.time_us, _LIKE, filtered=False),
    "gyro": lambda it: gyro_alone(euler_of(it.q_true[0]), it.time_us, it.gyr),
    "kalman": lambda it: tracker_alone(it.track, it.time_us, _LIKE),
    "method1": lambda it: method_one(it.track, it.time_us, it.gyr, _LIKE),
    "method2": lambda it: method_two(it.track, it.time_us, it.gyr, _LIKE),
    "ours": _ours,
}


def _rms(follow: Callable[[Watched], Array], recordings: list[Watched]) -> dict[str, float]:
    """At the tracker's instants, from the first on, as the paper's reference was read."""
    off = [shorter(follow(it) - euler_of(it.q_true))[it.tracker_at] for it in recordings]
    rms = 100.0 * np.sqrt(np.mean(np.concatenate(off) ** 2, axis=0))
    return dict(zip(AXES, rms.tolist(), strict=True))


def _times(it: Watched) -> dict[str, float]:
    """What the same recording takes, the shortest of three, as multiples of method I."""

    def shortest(name: str) -> float:
        times = []
        for _ in range(3):
            begun = perf_counter()
            METHODS[name](it)
            times.append(perf_counter() - begun)
        return min(times)

    taken = {name: shortest(name) for name in ("method1", "method2", "ours")}
    seconds = (it.time_us[-1] - it.time_us[0]) * 1e-6
    return {name: t / taken["method1"] for name, t in taken.items()} | {
        "method1_ms_of_40_ms": 40.0 * taken["method1"] / seconds
    }


PLACED: dict[str, tuple[str, float | None]] = {
    "hand": ("hand", 2.0),
    "forearm": ("forearm", 2.0),
    "hand_as_thrown": ("hand", None),
    "forearm_as_thrown": ("forearm", None),
}
"""Where the tracker sits, and how fast the hand is at most [m/s]."""


def _placed(people: range, development: bool) -> dict[str, Any]:
    """Root of the hand in the room: root mean squares over people."""
    seeds = 0 if development else 10_000
    asked = [
        (case, Placing(n, seeds + n, segment, fastest))
        for n in people
        for case, (segment, fastest) in PLACED.items()
    ]
    told = [(case, place(placing)) for case, placing in asked]
    found: dict[str, Any] = {}
    for case in PLACED:
        mine = [one for name, one in told if name == case]
        keys = [key for key in mine[0] if key.endswith(("_mm", "_deg", "_ms"))]
        found[case] = {
            key: float(np.sqrt(np.mean(np.square([one[key] for one in mine])))) for key in keys
        }
        found[case]["fastest_m_s"] = max(one["fastest_m_s"] for one in mine)
    found["rms_mm"] = found["hand"]["root_mm"]
    return found


def show(found: dict[str, Any]) -> None:
    """Print what `figures` found."""
    rows = []
    for name in METHODS:
        ours = found["late"]["rms_1e2rad"][name]
        rows.append(
            [
                name,
                " ".join(f"{x:.2f}" for x in PAPER.get(name, ())),
                *(" ".join(f"{ours[kind][a]:.2f}" for a in AXES) for kind in ("head", "hand")),
            ]
        )
    print_table(
        "RMS error, 1e-2 rad: azimuth, elevation, roll",
        ["method", "paper", "head", "hand"],
        rows,
    )
    times = found["late"]["time_of_method1"]
    paper = PAPER_MS["method2"] / PAPER_MS["method1"]
    out.print(
        f"Time: method II {times['method2']:.2f} of method I (paper {paper:.2f}), "
        f"ours {times['ours']:.2f}."
    )
    for case in PLACED:
        told = found["root"][case]
        words = ", ".join(f"{key} {value:.2f}" for key, value in told.items())
        out.print(f"Tracker on {case}: {words}")


if __name__ == "__main__":
    tyro.cli(main)
