"""What measures, angles and postures are called, and how their figures are said."""

from __future__ import annotations

from app.words import _
from handstudio.analysis.change import Change, Verdict
from handstudio.analysis.measure import Kind, Measure, WhyNot
from handstudio.analysis.tables import GroupName, written


def group_title(name: GroupName) -> str:
    """What a table of measures is called."""
    return {
        "range": _("Active range of motion"),
        "scores": _("Scores of fingers"),
        "opposition": _("Opposition of the thumb"),
        "repetitions": _("Repetitions"),
        "speed": _("Speed and smoothness"),
        "tremor": _("Tremor"),
        "independence": _("Finger independence"),
        "posture": _("Time in posture"),
    }[name]


def group_note(name: GroupName) -> str:
    """What one has to know to read it."""
    return {
        "range": _(
            "Extremes that were held for 0.05 s. Normal: what adults reach (AAOS, ASSH); a healthy "
            "person may be 10 to 20° off."
        ),
        "scores": _(
            "TAM: flexion of MCP, PIP and DIP at the best fist, less what is lacking at the best "
            "stretch; graded against 260°. Strickland: the same of PIP and DIP, against 175°."
        ),
        "opposition": _(
            "Kapandji: the highest of ten places that the thumb's pulp touched; in brackets the "
            "lowest and the highest it may be."
        ),
        "repetitions": _("Of joints that moved to and fro three times or more."),
        "speed": _(
            "SPARC and LDLJ: 0 would be smoothest, more negative is jerkier; means over the ways "
            "to and fro."
        ),
        "tremor": _("3 to 12 Hz, of joints that were held; RMS of the angle."),
        "independence": _(
            "1: the other fingers stay still while this one moves (individuation), or it stays "
            "still while others move (stationarity)."
        ),
        "posture": _("Share of the time in which the angle was known."),
    }[name]


def kind_name(kind: Kind) -> str:
    """What a column is called, with its unit."""
    return {
        "least": _("From [°]"),
        "most": _("To [°]"),
        "range": _("Range [°]"),
        "tam": _("TAM [°]"),
        "strickland": _("Strickland [%]"),
        "kapandji": _("Kapandji (0–10)"),
        "pronation": _("Pronation there [°]"),
        "cycles": _("Times"),
        "cycle_amplitude": _("Amplitude [°]"),
        "cycle_amplitude_cv": _("Amplitude varies by [%]"),
        "cycle_period": _("Period [s]"),
        "cycle_period_cv": _("Period varies by [%]"),
        "peak_speed": _("Peak speed [°/s]"),
        "mean_speed": _("Mean speed [°/s]"),
        "sparc": "SPARC",
        "ldlj": "LDLJ",
        "tremor_amplitude": _("RMS [°]"),
        "tremor_frequency": _("Peak [Hz]"),
        "individuation": _("Individuation"),
        "stationarity": _("Stationarity"),
        "time_in_posture": _("Time [%]"),
    }[kind]


def why_words(why: WhyNot) -> str:
    """Why a measure cannot be given."""
    return {
        "": "",
        "no_hand": _("there is no hand in this take"),
        "no_sensor": _("no sensor"),
        "in_doubt": _("in doubt throughout"),
        "no_start": _("no rest to count from"),
        "no_calibration": _("needs a calibration of the hand"),
        "too_short": _("too short"),
        "gaps": _("too many gaps"),
        "no_movement": _("no such movement"),
        "no_peak": _("no peak"),
        "moving": _("never held still"),
    }[why]


def grade_word(grade: str) -> str:
    """A grade of a score."""
    return {
        "excellent": _("excellent"),
        "good": _("good"),
        "fair": _("fair"),
        "poor": _("poor"),
    }.get(grade, "")


def verdict_words(verdict: Verdict) -> str:
    """What a change comes to."""
    return {
        "more": _("more"),
        "less": _("less"),
        "no detectable change": _("no detectable change"),
        "not judged": _("not judged"),
    }[verdict]


def about_name(about: str) -> str:
    """An angle, a finger or a posture as people call it; a posture of one's own stays."""
    postures = {
        "wrist_flexed_15": _("Wrist flexed beyond 15° (RULA)"),
        "wrist_extended_15": _("Wrist extended beyond 15° (RULA)"),
        "wrist_flexed_45": _("Wrist flexed beyond 45° (ISO 11228-3)"),
        "wrist_extended_45": _("Wrist extended beyond 45° (ISO 11228-3)"),
        "wrist_ulnar_20": _("Wrist bent to the ulnar side beyond 20° (ISO 11228-3)"),
        "wrist_radial_15": _("Wrist bent to the radial side beyond 15° (ISO 11228-3)"),
    }
    if about in postures:
        return postures[about]
    first, _sep, rest = about.partition("_")
    part = {
        "elbow": _("Elbow"),
        "forearm": _("Forearm"),
        "wrist": _("wrist").capitalize(),
        "ulnar": _("Edge of the palm"),
        "thumb": _("thumb").capitalize(),
        "index": _("Index"),
        "middle": _("Middle"),
        "ring": _("Ring"),
        "little": _("Little"),
    }.get(first)
    if part is None:
        return about
    joint, _sep, turn = rest.rpartition("_")
    turns = {
        "flexion": _("flexion"),
        "abduction": _("abduction"),
        "rotation": _("pronation"),
        "pronation": _("pronation"),
        "ulnar": _("ulnar deviation"),
    }
    joints = {"mcp": _("MCP"), "pip": _("PIP"), "dip": _("DIP"), "cmc": _("CMC"), "ip": _("IP")}
    between = "" if first == "ulnar" else joints.get(joint, "")
    return " ".join(filter(None, [part, between, turns.get(turn, turn)]))


def row_name(about: str) -> str:
    """What a row of measures is of; elbow and forearm have no sensor before them to count from."""
    name = about_name(about)
    if about in ("elbow_flexion", "forearm_pronation"):
        return _("{angle}, from where it began").format(angle=name)
    return name


def figure(measure: Measure | None) -> str:
    """Value and uncertainty with its grade, or why there is none."""
    if measure is None:
        return ""
    if measure.value is None:
        return f"– {why_words(measure.why)}".strip()
    return " ".join(filter(None, [written(measure), grade_word(measure.grade)]))


def unit_sign(change: Change) -> str:
    """The unit of a change, as it is written behind a figure."""
    return {"deg": "°", "deg/s": " °/s", "%": " %", "s": " s", "Hz": " Hz", "": ""}[change.unit]
