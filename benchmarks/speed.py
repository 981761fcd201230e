"""What a step of the filters costs, beside a compiled filter a sensor, in one run.

    python -m benchmarks.speed --json FILE

Twenty sensors of the showcase at 100 Hz. Whole arrays first, then one sample at a time as live,
then a take from its bytes to a CSV; then more sensors and longer arrays, which must cost in
proportion.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import tyro

from handstudio import pipeline
from handstudio.arrays import Array
from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Processed
from handstudio.fusion.mechanism import bare
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.hand_fit import mechanism_of
from handstudio.layout import glove
from handstudio.process import process
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take
from handstudio.samples import ImuSamples
from handstudio.setup import Setup, filter_named, smoothing
from handstudio.shell import out, print_table
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject

RATE_HZ = 100.0
REPEATS = 5  # the quickest counts: these machines are noisy


def main(json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
    """
    samples = _samples(30.0)
    setup = Setup(glove(), RATE_HZ, filter=TreeFilter())
    step, vqf = _tree_us(samples, setup), _vqf_us(samples)
    figures: dict[str, Any] = {
        "step_us": step,
        "vqf20_us": vqf,
        "ratio": step / vqf,
        "live_step_us": _live_us(samples, setup),
        "sensors_us": {str(n): _tree_us(_widened(samples, n), None) for n in (5, 10, 20, 40)},
        "length_us": {f"{s:g} s": _tree_us(_samples(s), setup) for s in (7.5, 15.0, 30.0)},
        **_offline(),
    }
    print_table(
        "A step over 20 sensors",
        ["figure", "value"],
        [[name, f"{value:.3g}"] for name, value in figures.items() if isinstance(value, float)],
    )
    out.print("by sensors [us]", figures["sensors_us"])
    out.print("by length [us]", figures["length_us"])
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")


def _samples(seconds: float) -> ImuSamples:
    time_us = np.arange(round(seconds * RATE_HZ)) * 10_000
    return signals(ideal_subject("right"), glove(), showcase("right"), time_us)[0]


def _widened(samples: ImuSamples, sensors: int) -> ImuSamples:
    which = np.arange(sensors) % samples.gyr.shape[1]
    names = ImuSamples.__slots__[1:]
    return replace(samples, **{name: getattr(samples, name)[:, which] for name in names})


def _tree_us(samples: ImuSamples, setup: Setup | None) -> float:
    """Of a step [us]; without a setup of sensors in chains of five."""
    sensors = samples.gyr.shape[1]
    joints = _chains(sensors) if setup is None else mechanism_of(setup)
    tree, steps = TreeFilter(), np.ones(len(samples))
    begun = tree.begin(sensors, RATE_HZ)
    return _quickest(lambda: tree.fused(begun, samples, steps, samples.valid, joints), len(samples))


def _chains(sensors: int) -> Any:
    parent = np.array([-1 if s % 5 == 0 else s - 1 for s in range(sensors)])
    return replace(
        bare(sensors),
        parent=parent,
        axes=np.ones(sensors, dtype=np.int64),
        lever_sd_m=_OFF * np.ones(sensors),
    )


_OFF = 0.005


def _vqf_us(samples: ImuSamples) -> float:
    vqf, steps = VqfFilter(), np.ones(len(samples))
    begun = vqf.begin(samples.gyr.shape[1], RATE_HZ)
    return _quickest(lambda: vqf.run(begun, samples, steps, samples.valid), len(samples))


def _live_us(samples: ImuSamples, setup: Setup) -> float:
    """Of one sample through the whole pipeline [us]."""
    few = samples[:400]

    def step_by_step() -> None:
        state = pipeline.begin(setup)
        for k in range(len(few)):
            _, state = pipeline.run(setup, state, [few[k : k + 1]])

    return _quickest(step_by_step, len(few))


def _offline() -> dict[str, float]:
    """A minute's take from its bytes to a CSV of angles, and smoothed, against real time."""
    with tempfile.TemporaryDirectory() as folder:
        # with its health, as a recorded take has it: else an export works that out first
        path = simulate(Path(folder), seconds=60.0, health=True)
        take = open_take(path)

        def times_realtime(setup: Setup, target: Path | None) -> float:
            def work() -> None:
                shutil.rmtree(path.with_suffix(".motion"), ignore_errors=True)
                motion = process(take, setup)
                if target is not None:
                    export(Processed(take, setup, motion), target, FORMATS["csv"])

            return 60.0e6 / _quickest(work, 1)

        own = take.header.setup
        found = {
            f"offline_x_realtime_{name}": times_realtime(
                replace_filter(own, name), path.with_suffix(".csv")
            )
            for name in ("tree", "vqf")
        }
        found["smooth_x_realtime"] = times_realtime(smoothing(own), None)
    return found | {"offline_x_realtime": found["offline_x_realtime_tree"]}


def replace_filter(setup: Setup, name: str) -> Setup:
    """The setup with another filter."""
    return msgspec.structs.replace(setup, filter=filter_named(name))


def _quickest(work: Callable[[], Any], steps: int) -> float:
    work()  # compiled, and warm
    times: list[float] = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    best: Array = np.min(times)
    return float(best) / steps * 1e6


if __name__ == "__main__":
    tyro.cli(main)
