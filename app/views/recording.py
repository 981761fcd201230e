"""A recording in words and figures: the big sheet, the disk, how far it can be trusted. Pure."""

from __future__ import annotations

import html
from dataclasses import dataclass

import numpy as np

from app.state import State
from app.words import _
from handstudio.device.orders import Phase
from handstudio.pipeline import Doubt


@dataclass(frozen=True, slots=True)
class Trust:
    """How far what is recorded now can be trusted: a word, and why not further."""

    word: str
    why: str
    good: bool


def trust_of(state: State) -> Trust:
    """The level of trust of a take that would begin, or goes on, now."""
    newest = state.newest
    if newest.setup is None or newest.motion is None:
        return Trust(_("nothing to record"), _("No device sends."), good=False)
    if newest.phase is Phase.LOST:
        return Trust(_("interrupted"), _("The device is away; the gap is marked."), good=False)
    unplaced = int(((newest.motion.doubt[0] & np.uint8(Doubt.UNPLACED)) != 0).sum())
    if unplaced:
        why = _("{count} sensors have not rested yet: hold the hand still for half a second.")
        return Trust(_("not placed"), why.format(count=unplaced), good=False)
    if state.subject is None or state.subject.hand_length_mm is None:
        why = _("Average hand, {mm:.0f} mm: measure the hand and enter it under Record.")
        return Trust(_("average hand"), why.format(mm=state.hand_length_mm), good=False)
    why = _("Average proportions for {mm:.0f} mm; joints are not calibrated.")
    return Trust(_("hand length only"), why.format(mm=state.hand_length_mm), good=True)


def disk_of(state: State) -> str:
    """What the disk can still hold, in words; empty where it is not known."""
    disk = state.disk
    if disk is None:
        return ""
    hours = disk.seconds_left / 3600.0
    size = f"{disk.free_bytes / 1e9:.1f} GB"
    if hours >= 100.0:
        return _("{size} free, days of recording").format(size=size)
    if hours >= 2.0:
        return _("{size} free, {hours:.0f} h of recording").format(size=size, hours=hours)
    return _("{size} free, {minutes:.0f} min of recording").format(size=size, minutes=hours * 60)


def clock_of(seconds: float) -> str:
    """Seconds as a person reads them: 1:02.3."""
    minutes, rest = divmod(max(0.0, seconds), 60.0)
    return f"{int(minutes)}:{rest:04.1f}"


def sheet_of(state: State) -> str:
    """What is read from two metres away: the count before a take, or its time; else nothing.

    A course of calibration has a sheet of its own.
    """
    if state.guided is not None:
        return ""
    if state.countdown is not None:
        return _sheet(
            str(state.countdown.shown),
            _("Ready: {name}").format(name=state.settings.take_name),
            _("Space or R calls it off."),
            _AMBER,
        )
    recorder = state.newest.recorder
    if recorder is None:
        return ""
    lost = state.newest.phase is Phase.LOST
    trust = trust_of(state)
    facts = [
        f"{recorder.path.stem} · {recorder.header.subject}",
        _("{megabytes:.1f} MB").format(megabytes=recorder.bytes / 1e6),
        _("marks: {count}").format(count=state.marks),
    ]
    low = state.disk is not None and state.disk.low
    notes = [
        _("Trust: {word}").format(word=trust.word),
        disk_of(state),
        _("Space or R ends it, M marks."),
    ]
    clock = clock_of(recorder.seconds)
    colour = _AMBER if lost or low else _RED
    return _sheet(clock, " · ".join(facts), " · ".join(filter(None, notes)), colour)


_RED, _AMBER = "#e5484d", "#f5a524"


def _sheet(large: str, line: str, small: str, colour: str) -> str:
    return (
        '<div style="display:flex;align-items:center;gap:1em;padding:.5em .9em">'
        f'<div style="font:600 2.7rem/1 ui-monospace,monospace;color:{colour};'
        f'font-variant-numeric:tabular-nums">{html.escape(large)}</div>'
        f'<div style="font-size:.85rem;line-height:1.45"><b>{html.escape(line)}</b>'
        f'<div style="opacity:.75">{html.escape(small)}</div></div></div>'
    )
