"""A tracker in words: whether it is there, and whether the hand stands in its room."""

from __future__ import annotations

from app.state import State
from app.words import _, in_words
from handstudio.device.following import RootNow, RootPhase
from handstudio.device.live_tracker import LiveNow
from handstudio.device.tracker import TrackerNow, TrackerPhase
from handstudio.errors import HandstudioError
from handstudio.trackers.late_faults import Fate


def tracker_words(state: State) -> str:
    """What to say of the tracker, as Markdown; empty where none is chosen."""
    now = state.tracker.now
    if now is None:
        return ""
    said = [*_line(now.tracker), *_place(now), *_take(state)]
    return "\n\n".join(said)


def _line(tracker: TrackerNow) -> list[str]:
    """Whether it is there."""
    if tracker.phase is TrackerPhase.GONE:
        return [_("**Gone**: it tells nothing any more, and is looked for until it is back.")]
    if tracker.problem is not None:
        return _problem(tracker.problem)
    if tracker.phase is TrackerPhase.LOOKING:
        return [_("**Looking** for its stream …")]
    if tracker.unseen:
        return [_("**Not seen**: bring the terminal back to where the tracker sees it.")]
    if tracker.frozen:
        return [_("**Frozen**: it tells the same pose again and again. Start its streaming anew.")]
    return []


def _place(now: LiveNow) -> list[str]:
    """Whether the hand stands in its room."""
    if now.problem is not None:
        return _problem(now.problem)
    root = now.root
    if now.tracker.phase is TrackerPhase.LOOKING:
        return []
    match root.phase:
        case RootPhase.WAITING:
            return [_("It is there; the glove's motion is waited for.")]
        case RootPhase.LOOKING:
            looking = _("**Looking for its motion**: turn hand and forearm about. {seconds:.0f} s")
            why = [] if root.why is None or root.seconds < _LONG_S else _problem(root.why)
            return [looking.format(seconds=root.seconds), *why]
        case RootPhase.FOLLOWING:
            return [*_following(root)]


def _following(root: RootNow) -> list[str]:
    trouble = {
        Fate.JUMPED: _("**Elsewhere**: its poses do not fit the motion and are not taken."),
        Fate.AFRESH: _("**Elsewhere**: its poses do not fit the motion and are not taken."),
        Fate.MIRRORED: _("**Mirrored**: on the other side of the transmitter; put right."),
        Fate.TURNED: _("**Turned**: its attitude does not fit; was the terminal moved?"),
    }
    told = [] if root.trouble not in trouble else [trouble[root.trouble]]
    aligned = _("**In its room**: on {sensor}, {ms:.0f} ms late, ± {mm:.0f} mm.")
    far = _("**In its room**: on {sensor}; where is not known now.")
    if root.sd_m > _FAR_M:
        return [*told, far.format(sensor=root.sensor)]
    sd_mm = max(1.0, 1e3 * root.sd_m)
    return [*told, aligned.format(sensor=root.sensor, ms=1e3 * root.delay_s, mm=sd_mm)]


_FAR_M = 0.05
_LONG_S = 12.0  # so long it may take with nothing amiss


def _take(state: State) -> list[str]:
    recorder, now = state.newest.recorder, state.tracker.now
    if recorder is None or now is None or recorder.header.tracker == now.tracker.facts:
        return []
    return [_("The take that is on began without it; the next one has it.")]


def _problem(error: HandstudioError) -> list[str]:
    return [" ".join(in_words(error))]
