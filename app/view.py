"""What to show, from the state alone: texts, figures, poses. Pure; knows no viser."""

from __future__ import annotations

import html
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from app.channels import Plot, plots_of
from app.live import SPAN_S
from app.studio import State
from app.words import _
from handstudio.arrays import Array
from handstudio.device.health import HealthView
from handstudio.device.orders import Newest, Phase
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import Skeleton
from handstudio.kinematics import doubtful_segments, pose_of, skeleton_of
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup

LATE_MS = 100.0
"""A hand that is shown later than this feels detached."""

LOSS_PERCENT = 1.0
"""More lost instants than this are worth a look at cable and rate."""


@dataclass(frozen=True, slots=True)
class Status:
    """The status line: a word of state, the figures behind it, and whether to act."""

    word: str
    figures: str
    advice: str
    alarm: bool


@dataclass(frozen=True, slots=True, eq=False)
class HandView:
    """A hand to draw."""

    skeleton: Skeleton
    pose: Pose
    doubtful: Bool[Array, " k"]
    dead: Bool[Array, " k"]


@dataclass(frozen=True, slots=True, eq=False)
class SensorsView:
    """Sensors to draw where there is no hand."""

    names: tuple[str, ...]
    q_world_sensor: Float[Array, "s 4"]


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Plots with their data; ``now_s`` is where the playhead stands."""

    plots: tuple[Plot, ...]
    time_s: Float[Array, " n"]
    values: Float[Array, "n c"]
    from_s: float
    to_s: float
    now_s: float | None


def status_of(state: State) -> Status:
    """The status line for the line to the device and the take that is recorded."""
    newest = state.newest
    match newest.phase:
        case Phase.IDLE:
            return Status(_("No device"), "", _("Choose one under Device."), alarm=False)
        case Phase.CONNECTING:
            return Status(_("Connecting"), newest.address, "", alarm=False)
        case Phase.FAILED:
            problem = newest.problem
            return Status(
                _("Not connected"),
                problem.what if problem else "",
                problem.remedy if problem else "",
                alarm=True,
            )
        case Phase.LOST:
            return _lost(newest)
        case Phase.STREAMING:
            return _streaming(newest)


def figures_of(health: HealthView) -> str:
    """Rate, loss and latency with their units."""
    return " · ".join(
        [
            f"{health.rate_hz:.0f} Hz",
            _("loss {percent:.2g} %").format(percent=health.loss_percent),
            _("latency {ms:.1f} ms").format(ms=health.latency_p99_ms),
        ]
    )


def recording_of(newest: Newest) -> str:
    """How the take that is recorded stands; empty where there is none."""
    recorder = newest.recorder
    if recorder is None:
        return ""
    return _("{name}: {clock}, {megabytes:.1f} MB").format(
        name=recorder.path.stem,
        clock=clock_of(recorder.seconds),
        megabytes=recorder.bytes / 1e6,
    )


def clock_of(seconds: float) -> str:
    """Seconds as a person reads them: 1:02.3."""
    minutes, rest = divmod(max(0.0, seconds), 60.0)
    return f"{int(minutes)}:{rest:04.1f}"


def scene_of(state: State) -> HandView | SensorsView | None:
    """What stands in the centre now; None: nothing to show yet."""
    shown = _shown(state)
    if shown is None:
        return None
    setup, motion = shown
    if not setup.layout.is_hand:
        return SensorsView(setup.layout.names, motion.q_world_sensor[0])
    pose = pose_of(setup, motion.q_world_sensor)
    doubtful = doubtful_segments(setup, motion.doubt & ~np.uint8(Doubt.SILENT))[0]
    dead = doubtful_segments(setup, motion.doubt & np.uint8(Doubt.SILENT))[0]
    single = Pose(pose.q_world_segment[0], pose.t_world_joint[0], pose.t_world_tip[0])
    return HandView(skeleton_of(setup), single, doubtful, dead)


def curves_of(state: State) -> Curves | None:
    """What the plots show now."""
    review, live = state.review, state.live
    if review is not None:
        plots = plots_of(review.setup.layout)
        end = max(review.duration_s, 0.1)
        return Curves(plots, review.plot_time_s, review.plot_values, 0.0, end, now_s=review.at_s)
    if live is None or len(live.time_s) == 0:
        return None
    newest = float(live.time_s[-1])
    start = max(0.0, newest - SPAN_S)
    plots = plots_of(live.setup.layout)
    return Curves(plots, live.time_s, live.values, start, max(newest, SPAN_S), now_s=None)


def caption_of(state: State) -> str:
    """What the picture shows, in words: whose hand, live or which take, and what is missing."""
    review = state.review
    if review is not None:
        what = _("Replay · {name} · {subject}").format(
            name=review.take.path.stem, subject=review.take.header.subject
        )
        return " · ".join(filter(None, [what, review.setup.layout.missing_for_hand]))
    newest = state.newest
    if newest.setup is None or newest.motion is None:
        return _("No hand yet")
    device = newest.setup.device.name if newest.setup.device else newest.address
    doubts = _doubts(newest.setup, newest.motion)
    missing = newest.setup.layout.missing_for_hand
    return " · ".join(filter(None, [_("Live"), device, doubts, missing]))


def as_html(status: Status) -> str:
    """The status line as the page shows it."""
    colour = "#e24b4a" if status.alarm else "inherit"
    figures = f'<span style="opacity:.75"> {html.escape(status.figures)}</span>'
    advice = f'<div style="opacity:.85">{html.escape(status.advice)}</div>'
    return (
        f'<div style="font-size:.8rem;line-height:1.35;padding:.4em .75em .2em">'
        f'<b style="color:{colour}">{html.escape(status.word)}</b>'
        f"{figures if status.figures else ''}{advice if status.advice else ''}</div>"
    )


def _shown(state: State) -> tuple[Setup, Motion] | None:
    if state.review is not None:
        return state.review.setup, state.review.instant
    newest = state.newest
    if newest.setup is None or newest.motion is None:
        return None
    return newest.setup, newest.motion


def _lost(newest: Newest) -> Status:
    if newest.problem is not None:
        return Status(_("Device lost"), newest.problem.what, newest.problem.remedy, alarm=True)
    advice = _("Check the cable; it is picked up again by itself.")
    if newest.recorder is not None:
        advice += " " + _("The take goes on, the gap will be marked.")
    return Status(_("Device lost"), newest.address, advice, alarm=True)


def _streaming(newest: Newest) -> Status:
    health = newest.health
    advice = ""
    if newest.setup is not None and health.silent:
        names = ", ".join(newest.setup.layout.names[i] for i in health.silent)
        advice = _("{names} not answering: check its cable.").format(names=names)
    elif health.loss_percent > LOSS_PERCENT:
        advice = _("Packets get lost: check the cable, or lower the rate.")
    elif health.latency_p99_ms > LATE_MS:
        advice = _("The hand is shown late: close other programs, or lower the rate.")
    word = _("Recording") if newest.recorder is not None else _("Connected")
    return Status(word, figures_of(health), advice, alarm=bool(advice))


def _doubts(setup: Setup, motion: Motion) -> str:
    unplaced = int(((motion.doubt[0] & np.uint8(Doubt.UNPLACED)) != 0).sum())
    if unplaced == 0:
        return ""
    if unplaced == len(setup.layout.sensors):
        return _("hold the hand still for half a second to begin")
    return _("{count} sensors wait for half a second of rest").format(count=unplaced)
