"""What to show, from the state alone: texts, figures, poses. Pure; knows no viser."""

from __future__ import annotations

import html
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from app.shown.channels import OF_TAKES, SIGNALS, Plot, plots_of, sets_of
from app.shown.live import SPAN_S
from app.shown.look import ABOVE_SHEET, Camera, View, camera_for, course_camera, lowered
from app.state import State
from app.views.comparison import comparison_words
from app.views.health import worst_of
from app.views.room import overlooking, room_words, stand_of, standing
from app.views.timeline import rest_words
from app.words import _, in_words
from handstudio.arrays import Array
from handstudio.device.health import HealthView
from handstudio.device.orders import Newest, Phase
from handstudio.hand.pose import Pose, moved
from handstudio.hand.skeleton import Skeleton
from handstudio.hand_fit import fit_of
from handstudio.kinematics import doubtful_segments, pose_of
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup


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

    layout: Layout
    skeleton: Skeleton
    pose: Pose
    doubtful: Bool[Array, " k"]
    dead: Bool[Array, " k"]
    lit: frozenset[str]  # names of the sensors to point out


@dataclass(frozen=True, slots=True, eq=False)
class SensorsView:
    """Sensors to draw where there is no hand."""

    names: tuple[str, ...]
    q_world_sensor: Float[Array, "s 4"]


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Plots with their data; ``now_s`` is where the playhead stands.

    Attributes:
        sets: What can be plotted, by name, in words.
        chosen: Name of what is.
        sensors: Those of which signals can be; none live.
        sensor: The one whose signals are.
        sds: Standard deviations of the values, inf where the filter does not tell.
        second: The same curves of the motion that is compared with.
        rms: And by how much each differs.
    """

    plots: tuple[Plot, ...]
    sets: dict[str, str]
    chosen: str
    time_s: Float[Array, " n"]
    values: Float[Array, "n c"]
    from_s: float
    to_s: float
    now_s: float | None
    sds: Float[Array, "n c"] | None = None
    second: Float[Array, "n c"] | None = None
    rms: Float[Array, " c"] | None = None
    sensors: tuple[str, ...] = ()
    sensor: str = ""


def status_of(state: State) -> Status:
    """The status line for the line to the device and the take that is recorded."""
    newest = state.newest
    match newest.phase:
        case Phase.IDLE:
            advice = " ".join(filter(None, [_("Choose one under Device."), _shared(state)]))
            return Status(_("No device"), "", advice, alarm=False)
        case Phase.CONNECTING:
            return Status(_("Connecting"), newest.address, _("Asking who is there."), alarm=False)
        case Phase.FAILED:
            what, remedy = in_words(newest.problem) if newest.problem is not None else ("", "")
            return Status(_("Not connected"), what, remedy, alarm=True)
        case Phase.LOST:
            return _lost(newest)
        case Phase.STREAMING:
            return _streaming(state)


def figures_of(health: HealthView) -> str:
    """Rate, loss and latency with their units."""
    return " · ".join(
        [
            f"{health.rate_hz:.0f} Hz",
            _("loss {percent:.2g} %").format(percent=health.loss_percent),
            _("latency {ms:.1f} ms").format(ms=health.latency_p99_ms),
        ]
    )


def scene_of(state: State) -> HandView | SensorsView | None:
    """What stands in the centre now; None: nothing to show yet."""
    shown = _shown(state)
    if shown is None:
        return None
    setup, motion = shown
    if not setup.layout.is_hand:
        return SensorsView(setup.layout.names, motion.q_world_sensor[0])
    fit = fit_of(setup)
    pose = pose_of(setup, motion.q_world_sensor, fit)
    doubtful = doubtful_segments(setup, motion.doubt & ~np.uint8(Doubt.SILENT))[0]
    dead = doubtful_segments(setup, motion.doubt & np.uint8(Doubt.SILENT))[0]
    pose = _in_room(state, setup, pose)
    single = Pose(pose.q_world_segment[0], pose.t_world_joint[0], pose.t_world_tip[0])
    lit = frozenset[str]()
    if state.review is None and state.shaking is not None and state.shaking.sensor is not None:
        lit = frozenset({setup.layout.names[state.shaking.sensor]})
    return HandView(setup.layout, fit.skeleton, single, doubtful, dead, lit)


def _in_room(state: State, setup: Setup, pose: Pose) -> Pose:
    """The live hand where a tracker sees it, from where it was when that was found."""
    tracking = state.tracker
    if state.review is not None or tracking.now is None or tracking.anchor is None:
        return pose
    root = tracking.now.root
    if root.t_room_elbow is None or root.q_room_world is None or root.setup != setup:
        return pose
    elbow, q_room_world = tracking.anchor
    q_world_room = so3.conjugate(q_room_world)
    q_world_now = so3.multiply(q_world_room, root.q_room_world)
    t_world_elbow = so3.rotate(q_world_room, root.t_room_elbow - elbow)
    return moved(pose, q_world_now[None], t_world_elbow[None])


def overlay_of(state: State) -> str:
    """Words in the middle of the picture where there is no hand to see, or it is not of now."""
    streaming = (
        _("Connected; waiting for the first motion …") if state.newest.motion is None else ""
    )
    words = {
        Phase.IDLE: _("No device yet: connect one on the left, or try the virtual glove."),
        Phase.CONNECTING: _("Connecting …"),
        Phase.FAILED: _("Not connected: the left side says why."),
        Phase.LOST: _("Device lost: this is the hand as it was last seen."),
        Phase.STREAMING: streaming,
    }
    return words[state.newest.phase] if state.review is None else ""


def looks_near(state: State) -> bool:
    """Whether the step that is on leaves the arm about where it is."""
    if state.guided is None:
        return False
    step = state.guided.course.step
    return step.kind not in ("turn", "tumble") and not step.joint.startswith(("elbow", "wrist"))


def camera_of(state: State, view: HandView | SensorsView | None) -> Camera:
    """Where the picture is taken from."""
    if state.guided is not None and state.view is View.DESK:
        return course_camera(state.guided.course.layout.side, near=looks_near(state))
    if isinstance(view, HandView):
        camera = camera_for(state.view, view.skeleton, standing(view.pose, stand_of(state)))
    else:
        camera = camera_for(state.view, None, None)
    if state.view is View.DESK:
        camera = overlooking(camera, state)
    above = state.review is not None or state.joint.answer is not None
    return lowered(camera, ABOVE_SHEET) if above else camera


def curves_of(state: State) -> Curves | None:
    """What the plots show now."""
    review, live = state.review, state.live
    if review is not None:
        layout, seen = review.setup.layout, review.seen
        choice = review.choice
        plots = plots_of(layout, choice.name, layout.names[choice.sensor])
        window = review.from_s, max(review.to_s, review.from_s + 0.1)
        sds = None if seen.sds is None else _told(seen.sds)
        which = plots, sets_of(layout), choice.name
        curves = Curves(*which, seen.time_s, seen.values, *window, review.at_s, sds)
        curves = replace(curves, second=seen.second, rms=seen.rms)
        if choice.name != SIGNALS:
            return curves
        return replace(curves, sensors=layout.names, sensor=layout.names[choice.sensor])
    if live is None or len(live.time_s) == 0:
        return None
    newest = float(live.time_s[-1])
    start = max(0.0, newest - SPAN_S)
    layout = live.setup.layout
    sets = {name: words for name, words in sets_of(layout).items() if name not in OF_TAKES}
    which = plots_of(layout, live.chosen), sets, live.chosen
    end = max(newest, SPAN_S)
    return Curves(*which, live.time_s, live.values, start, end, now_s=None, sds=_told(live.sds))


def _told(sds: Float[Array, "n c"]) -> Float[Array, "n c"] | None:
    """Nothing where no filter tells anything."""
    return sds if np.isfinite(sds).any() else None


def caption_of(state: State) -> str:
    """What the picture shows, in words: whose hand, live or which take, and what is missing."""
    review = state.review
    if review is not None:
        what = _("Replay · {name} · {subject}").format(
            name=review.take.path.stem, subject=review.take.header.subject
        )
        smooth = _("smoothed") if review.setup.smooth else ""
        second = comparison_words(review.comparison) if review.comparison is not None else ""
        return " · ".join(
            filter(
                None,
                [
                    what,
                    rest_words(review),
                    room_words(state),
                    smooth,
                    second,
                    _missing(review.setup),
                ],
            )
        )
    newest = state.newest
    if newest.setup is None or newest.motion is None:
        return _("No hand yet")
    device = newest.setup.device.name if newest.setup.device else newest.address
    doubts = _doubts(newest.setup, newest.motion)
    missing = _missing(newest.setup)
    return " · ".join(filter(None, [_("Live"), device, doubts, missing]))


def _missing(setup: Setup) -> str:
    """Why there is no hand, where there is none."""
    why = setup.layout.no_hand
    return "" if why is None else in_words(why)[0]


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
        return Status(_("Device lost"), *in_words(newest.problem), alarm=True)
    advice = _("Check the cable; it is picked up again by itself.")
    if newest.recorder is not None:
        advice += " " + _("The take goes on, the gap will be marked.")
    return Status(_("Device lost"), newest.address, advice, alarm=True)


def _streaming(state: State) -> Status:
    newest = state.newest
    word = _("Recording") if newest.recorder is not None else _("Connected")
    advice = worst_of(state)
    if advice is not None:
        told = f"{advice.title}: {advice.remedy}"
        return Status(word, figures_of(newest.health), told, alarm=True)
    return Status(word, figures_of(newest.health), _shared(state), alarm=False)


def _shared(state: State) -> str:
    """That somebody else may be pressing buttons too."""
    if state.pages < 2:
        return ""
    return _("{count} pages are open; each of them controls this studio.").format(count=state.pages)


def _doubts(setup: Setup, motion: Motion) -> str:
    unplaced = int(((motion.doubt[0] & np.uint8(Doubt.UNPLACED)) != 0).sum())
    if unplaced == 0:
        return ""
    if unplaced == len(setup.layout.sensors):
        return _("hold the hand still for half a second to begin")
    return _("{count} sensors wait for half a second of rest").format(count=unplaced)
