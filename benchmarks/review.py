"""An hour-long take in Review: how soon it is there, how it scrubs, what memory it takes.

    python -m benchmarks.review --json FILE

A virtual subject goes through its exercises for an hour, written without waiting. The take is
opened by the product's own studio, each time in a fresh process: once as recorded elsewhere,
with nothing computed; once with its motion beside it. What is timed is all from the intent to
what the page is drawn from; the browser's own part is not (see `benchmarks.live`).
"""

from __future__ import annotations

import json
import multiprocessing
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from app import intents
from app.state import State
from app.studio import Studio
from app.views import timeline
from app.views.comparison import compared_ghost
from app.views.page import caption_of, curves_of, scene_of
from app.views.written import trace_picture, trace_view
from app.work.jobs import Jobs
from handstudio.device.capture import Capture
from handstudio.finds import found_in
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.settings import SettingsStore
from handstudio.shell import out, print_table, progress
from handstudio.signals import signals

ROUND = "quick_start+showcase+open_close+scissors+typing+pouring+grasp:power_sphere"
TICK_S = 1.0 / 60.0
PLACES, WINDOWS = 1000, 200
GIVEN_UP_S = 120.0


@dataclass(frozen=True, slots=True)
class Opened:
    """One opening in a fresh process, and what was done then [ms, MB].

    Attributes:
        shown_ms: From the intent until the first window and its views were there.
        whole_ms: Until all of the take was.
        found_ms: Until writing, grasps and doubtful stretches were.
        step_ms: Of every place that was gone to, views included.
        window_ms: Of every change of the window of the plots.
        strip_bytes: Of the strip as it is sent where more is known of the take.
        memory_mb: Of the process, without pages of files: before it was opened, after it was,
            after a tenth of the places, after all of them.
        mapped_mb: Pages of files at the end: the system takes them back when it needs them.
    """

    shown_ms: float
    whole_ms: float
    found_ms: float
    step_ms: list[float]
    window_ms: list[float]
    strip_bytes: int
    memory_mb: list[float]
    mapped_mb: float


def main(
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    *,
    seconds: float = 3600.0,
    take: Path | None = None,
) -> None:
    """Measure.

    Args:
        json_file: Where to write the figures.
        seconds: How long the take is.
        take: One that is there already; its folder keeps what is computed.
    """
    if sys.platform != "linux":
        out.print("Not measured: memory is read from /proc.")
        sys.exit(2)
    with tempfile.TemporaryDirectory() as temporary:
        path = take or _performed(Path(temporary), seconds)
        figures: dict[str, Any] = {"instants": 0}
        shutil.rmtree(path.with_suffix(".motion"), ignore_errors=True)
        fresh = _in_a_fresh_process(path)
        figures["signals_s"] = _timed(lambda: signals(open_take(path)))
        motion = process(open_take(path))
        figures["find_s"] = _timed(lambda: found_in(open_take(path).header.setup, motion))
        figures["instants"] = len(motion)
        known = _in_a_fresh_process(path)
    figures |= {"unprocessed": asdict(fresh), "processed": asdict(known)}
    _show(fresh, known, figures)
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")


def observe(path: Path) -> Opened:
    """Open a take, go to many places of it, change the window of the plots; in this process."""
    jobs = Jobs()
    try:
        with tempfile.TemporaryDirectory() as settings:
            store = SettingsStore.opened(Path(settings) / "settings.json")
            studio = Studio(Capture(), jobs, store, State(path.parents[2]), "en")
            studio.refresh_takes()
            jobs.warm_up()
            time.sleep(2.0)  # a studio that has been running
            return _observed(studio, path)
    finally:
        jobs.close()


def _observed(studio: Studio, path: Path) -> Opened:
    before_mb = _memory_mb("RssAnon")
    began = time.perf_counter()
    studio.send(intents.OpenTake(path))
    shown_ms = _until(studio, began, lambda state: state.review is not None)
    whole_ms = _until(studio, began, lambda s: s.review is not None and s.review.rest == "here")
    memory = [before_mb, _memory_mb("RssAnon")]
    found_ms = _until(studio, began, _all_known)
    review = studio.state.review
    assert review is not None
    rng = np.random.default_rng(0)
    places = rng.uniform(0.0, review.duration_s, PLACES)
    steps = [_cost(studio, intents.Seek(float(at_s))) for at_s in places[: PLACES // 10]]
    memory.append(_memory_mb("RssAnon"))
    steps += [_cost(studio, intents.Seek(float(at_s))) for at_s in places[PLACES // 10 :]]
    memory.append(_memory_mb("RssAnon"))
    windows = []
    for at_s in rng.uniform(0.0, review.duration_s, WINDOWS // 4):
        _cost(studio, intents.Seek(float(at_s)))
        asked = (intents.ZoomPlots(8.0), intents.PanPlots(0.5), intents.ZoomPlots(4.0))
        windows += [_cost(studio, intent) for intent in (*asked, intents.ZoomPlots(1.0 / 32.0))]
    return Opened(
        shown_ms,
        whole_ms,
        found_ms,
        steps,
        windows,
        len(timeline.strip(review).encode()),
        memory,
        _memory_mb("RssFile"),
    )


def _all_known(state: State) -> bool:
    review = state.review
    return review is not None and review.found is not None and review.stretches is not None


def _until(studio: Studio, began: float, holds: Callable[[State], bool]) -> float:
    """Tick as the studio does until something holds and is drawn; since when it was asked [ms]."""
    while time.perf_counter() - began < GIVEN_UP_S:
        state = studio.tick(TICK_S)
        _views(state)
        if holds(state):
            return 1e3 * (time.perf_counter() - began)
        time.sleep(TICK_S)
    return float("nan")


def _cost(studio: Studio, intent: intents.Intent) -> float:
    """Of doing what is asked and making all the page needs for it [ms]."""
    began = time.perf_counter()
    studio.send(intent)
    _views(studio.tick(TICK_S))
    return 1e3 * (time.perf_counter() - began)


_drawn: list[object] = [None]


def _views(state: State) -> None:
    """All that the page draws of a take; the strip, as there, only where it has changed."""
    scene_of(state)
    compared_ghost(state)
    trace_view(state)
    curves_of(state)
    caption_of(state)
    if state.review is None:
        return
    trace_picture(state.review)
    timeline.overlay(state.review)
    timeline.below(state.review)
    drawn = timeline.drawn_from(state.review)
    if drawn != _drawn[0]:
        _drawn[0] = drawn
        timeline.strip(state.review)


def _performed(folder: Path, seconds: float) -> Path:
    rehearsed = rehearse(person=1, motion=ROUND, seed=1)
    rounds = int(seconds / rehearsed.trajectory.duration_s) + 1
    rehearsed = rehearse(person=1, motion="+".join([ROUND] * rounds), seed=1)
    with progress("an hour") as share:
        return simulate(folder, rehearsed, seconds=seconds, name="hour", progress=share)


def _in_a_fresh_process(path: Path) -> Opened:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(observe, path).result()


def _timed(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def _memory_mb(kind: str) -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{kind}:"):
            return int(line.split()[1]) / 1e3
    return float("nan")


def _show(fresh: Opened, known: Opened, figures: dict[str, Any]) -> None:
    def spread(ms: list[float]) -> str:
        p50, p99 = np.percentile(ms, [50.0, 99.0])
        return f"{p50:.1f} / {p99:.1f} / {max(ms):.1f}"

    rows = [
        ["first window there [ms]", *(f"{one.shown_ms:.0f}" for one in (fresh, known))],
        ["all of it there [ms]", *(f"{one.whole_ms:.0f}" for one in (fresh, known))],
        ["writing, grasps, doubts known [ms]", *(f"{one.found_ms:.0f}" for one in (fresh, known))],
        ["a place, p50 / p99 / longest [ms]", *(spread(one.step_ms) for one in (fresh, known))],
        ["a window, the same [ms]", *(spread(one.window_ms) for one in (fresh, known))],
        [
            "memory before, open, 100, 1000 places [MB]",
            *(", ".join(f"{mb:.0f}" for mb in one.memory_mb) for one in (fresh, known)),
        ],
        ["pages of files at the end [MB]", *(f"{one.mapped_mb:.0f}" for one in (fresh, known))],
        ["strip as it is sent [kB]", *(f"{one.strip_bytes / 1e3:.0f}" for one in (fresh, known))],
    ]
    print_table(f"{figures['instants']} instants", ["", "nothing computed", "processed"], rows)
    out.print(
        "aside: signals {signals_s:.1f} s, writing and grasps {find_s:.1f} s".format(**figures)
    )


if __name__ == "__main__":
    tyro.cli(main)
