"""A joint found by trackers, as the page shows it: the guided finding, the verdict. Pure."""

from __future__ import annotations

import html
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from app.report.names import about_name
from app.shown.bones import hand_length, joint_radii
from app.state import JointFinding, State
from app.views.joint_plots import class_histogram, cloud_picture
from app.views.page import HandView, SensorsView
from app.views.pieces import AMBER, GREEN, GREY, RED, big, line, sentence, small, table
from app.words import _, in_words
from app.work.joint_work import FINDABLE, JointAnswer, TrackFile
from handstudio.arrays import Array
from handstudio.errors import HandstudioError
from handstudio.hand.skeleton import JOINTS, SEGMENTS
from handstudio.trackers.findings import TrackFinding
from handstudio.trackers.methods import METHODS
from handstudio.trackers.said import said
from handstudio.trackers.study import FAR_APART_M, LITTLE_BEND, UNSURE_M, Found, JointStudy
from handstudio.wizards.joint_course import JointCourse, JointPhase

_GOOD, _DOUBTFUL = (18, 184, 134), (245, 165, 36)


@dataclass(frozen=True, slots=True, eq=False)
class HaloView:
    """Round a joint of the hand that is shown: how well its centre was found.

    Attributes:
        place: The joint's centre, from the elbow [m].
        radius_m: The joint's drawn ball, and one standard deviation of the centre more.
        colour: Of the verdict.
        words: Which joint, and the deviation.
    """

    place: Float[Array, "3"]
    radius_m: float
    colour: tuple[int, int, int]
    words: str


def joint_names() -> dict[str, str]:
    """Joints that can be found, by what people call them."""
    return {joint_name(joint): joint for joint in FINDABLE}


def joint_name(joint: str) -> str:
    """What people call a joint."""
    return about_name(f"{joint}_")


def method_names() -> dict[str, str]:
    """Ways to a joint in words, the recommended one first."""
    words = {
        "rolling": _("Rolling joint, skin that slides"),
        "plane": _("Least varying point of the middle plane"),
        "steady": _("The same, steady axes only"),
        "variance": _("Least varying point"),
        "symmetric": _("Symmetric centre"),
        "helical": _("Pivot of helical axes"),
    }
    return {words.get(name, name): name for name in METHODS}


def terminals_of(file: TrackFile | None, clusters: str) -> tuple[str, ...]:
    """What can be chosen as a terminal: those of the file, or the clusters typed so far."""
    if file is None:
        return ()
    if not file.markers:
        return file.terminals
    names = (part.partition("=")[0].strip() for part in clusters.split(";") if "=" in part)
    return tuple(dict.fromkeys(filter(None, names)))


def file_html(finding: JointFinding) -> str:
    """What was given, or why it cannot be used."""
    if finding.reading:
        return _boxed(_("Reading the file …"))
    if finding.problem is not None:
        what, remedy = in_words(finding.problem)
        return _boxed(what, RED) + _boxed(remedy)
    if finding.file is None:
        return _boxed(
            _(
                "A recording of two terminals beside a joint: the finger held straight for 3 s, "
                "then bent for 20 s. Or a virtual finger shows how it goes."
            )
        )
    file = finding.file
    named = file.markers or file.terminals
    words = _("{name}: markers {names}") if file.markers else _("{name}: terminals {names}")
    shown = ", ".join(named[:_MANY]) + (" …" if len(named) > _MANY else "")
    return _boxed(words.format(name=file.name.replace("\\", "/").split("/")[-1], names=shown))


_MANY = 24


def sheet_html(state: State) -> str:
    """What is going on or came of it; empty: nothing, or a course of the glove is in its place."""
    finding = state.joint
    if state.guided is not None or state.result is not None:
        return ""
    if isinstance(finding.answer, JointAnswer):
        return _verdict(finding.answer, state)
    if finding.answer is not None:
        return _refused(finding.answer, finding.joint)
    if finding.course is not None and finding.course.phase is not JointPhase.INTRO:
        return _guided(finding.course, working=finding.working)
    if finding.working:
        preparing = finding.course is not None
        words = _("A virtual finger is prepared …") if preparing else _("Finding the joint …")
        return _frame(sentence(words) + _bar(state.work.share if state.work else 0.0))
    return ""


def sheet_is_open(state: State) -> bool:
    """Whether `sheet_html` says anything."""
    finding = state.joint
    if state.guided is not None or state.result is not None:
        return False
    begun = finding.course is not None and finding.course.phase is not JointPhase.INTRO
    return finding.answer is not None or begun or finding.working


def halo_of(state: State, view: HandView | SensorsView | None) -> HaloView | None:
    """Where the joint is on the hand that is shown; None: no such joint, or none was found."""
    answer = state.joint.answer
    if not isinstance(answer, JointAnswer) or not isinstance(view, HandView):
        return None
    best = next(iter(answer.study.found.values()), None)
    children = {joint.name: joint.child for joint in JOINTS}
    if best is None or answer.joint not in children:
        return None
    index = SEGMENTS.index(children[answer.joint])
    ball = float(joint_radii()[index]) * hand_length(view.skeleton)
    return HaloView(
        np.asarray(view.pose.t_world_joint[index]),
        ball + best.estimate.sd_m,
        _GOOD if answer.study.ok else _DOUBTFUL,
        f"{joint_name(answer.joint)} ± {1e3 * best.estimate.sd_m:.1f} mm",
    )


def _guided(course: JointCourse, *, working: bool) -> str:
    who = small(_("A virtual finger does it; with a tracker of your own, record it to a file."))
    if working:
        return _frame(sentence(_("Finding the joint …")) + _bar(1.0) + who)
    left = max(0.0, course.lasts_s - course.done_s)
    straight = course.phase is JointPhase.STRAIGHT
    words = (
        _("Hold the finger straight.") if straight else _("Now bend and stretch it, all the way.")
    )
    moved = ""
    if course.moved:
        again = _("It moved {count} times while it was to be straight: counted anew.")
        moved = line(again.format(count=course.moved))
    beside = sentence(words) + line(_("{left:.0f} s to go").format(left=np.ceil(left)))
    share = course.done_s / course.lasts_s if course.lasts_s else 0.0
    return _frame(big("—" if straight else "⤵", GREEN, beside) + _bar(share) + moved + who)


def _refused(error: HandstudioError, joint: str) -> str:
    what, remedy = in_words(error)
    title = _("No joint was found: {joint}").format(joint=joint_name(joint))
    return _frame(big("✗", RED, sentence(title, RED) + line(what) + line(remedy)))


def _verdict(answer: JointAnswer, state: State) -> str:
    study = answer.study
    best = next(iter(study.found.values()), None)
    colour = GREEN if study.ok else AMBER
    word = _("The joint can be used.") if study.ok else _("The joint is doubtful.")
    told = [sentence(f"{joint_name(answer.joint)}: {word}", colour)]
    if best is not None:
        told.append(line(_figures(study, best)))
    if answer.off_m is not None:
        told.append(
            line(
                _("The virtual finger's true centre is {off:.1f} mm from there.").format(
                    off=1e3 * answer.off_m
                )
            )
        )
    parts = [big("✓" if study.ok else "!", colour, "".join(told))]
    parts += [_listed(error, AMBER) for error in study.poor]
    parts += [_listed(error, AMBER) for error in study.refused.values() if best is not None]
    parts += [_finding(each) for each in study.findings]
    if best is not None:
        parts.append(_centres(study, best))
    parts.append(
        '<div style="display:flex;gap:1em;flex-wrap:wrap;margin-top:.5em">'
        f"{cloud_picture(study)}{class_histogram(study)}</div>"
    )
    if best is not None:
        parts.append(small(_where(answer, state)))
    source = answer.source or _("virtual finger")
    parts.append(small(_("{source}, {frames} frames").format(source=source, frames=study.frames)))
    return _frame("".join(parts))


def _figures(study: JointStudy, best: Found) -> str:
    """What the verdict is by, each with its limit."""
    return _(
        "Both terminals place it {apart:.2f} mm apart (limit {far:.0f}); its place is known to "
        "{sd:.1f} mm (limit {unsure:.0f}); bent by {bend:.0f}° (at least {little:.0f})."
    ).format(
        apart=1e3 * best.apart_m,
        far=1e3 * FAR_APART_M,
        sd=1e3 * best.estimate.sd_m,
        unsure=1e3 * UNSURE_M,
        bend=np.rad2deg(study.bend_rad),
        little=np.rad2deg(LITTLE_BEND),
    )


def _centres(study: JointStudy, best: Found) -> str:
    estimate = best.estimate
    rows = [
        (name, _place(place, covariance))
        for name, place, covariance in (
            (study.upper, estimate.p_upper, estimate.upper_covariance),
            (study.lower, estimate.p_lower, estimate.lower_covariance),
        )
    ]
    titles = (_("Centre from terminal"), "x [mm]", "y [mm]", "z [mm]")
    return table(titles, [("", (name, *cells)) for name, cells in rows])


def _place(place: Array, covariance: Array) -> tuple[str, ...]:
    sd = np.sqrt(np.diag(covariance))
    return tuple(
        f"{1e3 * p:.1f} ± {1e3 * s:.1f}".replace("-", "−") for p, s in zip(place, sd, strict=True)
    )


def _where(answer: JointAnswer, state: State) -> str:
    """What the picture of the hand can tell of it, and what not."""
    if state.newest.motion is None and state.review is None:
        return _("No hand is shown: connect a glove or open a take to see the joint on it.")
    return _(
        "On the hand, the pale ball is round its {joint}: one standard deviation larger than the "
        "joint's own. Terminals are not tied to that hand, so how far its joint is from the centre "
        "found here is not known."
    ).format(joint=joint_name(answer.joint))


def _finding(finding: TrackFinding) -> str:
    return _listed(said(finding), GREEN if finding.made_good else AMBER)


def _listed(error: HandstudioError, colour: str) -> str:
    what, remedy = in_words(error)
    return (
        f'<div style="border-left:3px solid {colour};padding-left:.6em;margin-top:.4em;'
        f'font-size:.95rem;line-height:1.35">{html.escape(what)} '
        f'<span style="opacity:.8">{html.escape(remedy)}</span></div>'
    )


def _bar(share: float) -> str:
    percent = 100.0 * min(max(share, 0.0), 1.0)
    return (
        f'<div style="background:{GREY};height:.8rem;border-radius:.4rem;margin:.8rem 0">'
        f'<div style="background:{GREEN};height:100%;border-radius:.4rem;width:{percent:.0f}%">'
        "</div></div>"
    )


def _frame(content: str) -> str:
    return f'<div style="padding:.6em 1em .3em">{content}</div>'


def _boxed(words: str, colour: str = "inherit") -> str:
    return (
        f'<div style="padding:.1em .75em;font-size:.82rem;line-height:1.4;color:{colour};'
        f'overflow-wrap:anywhere">{html.escape(words)}</div>'
    )
