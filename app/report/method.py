"""How the figures of a report came about: everything an export says of itself, in words."""

from __future__ import annotations

from typing import Any

from app.words import _
from handstudio.export.metadata import of_part, of_take
from handstudio.hand.angles import ROOT_ANGLES
from handstudio.kinematics import has_start
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.setup import NOMINAL_ZERO, Setup


def method_of(take: Take, setup: Setup, motion: Motion) -> list[tuple[str, str]]:
    """Filter, convention, zero, rates, loss, software and the hash of the raw file."""
    start_us = int(motion.time_us[0])
    about = {**of_take(take, setup), **of_part(setup, motion, start_us, "angles")}
    smooth = _("with the future taken in") if setup.smooth else _("as live, without the future")
    name = {"tree": _("one filter over the whole hand"), "vqf": "VQF"}
    tag = str(about["filter"]["type"])
    out = [
        (_("Filter"), f"{tag} ({name[tag]}), {smooth}" if tag in name else f"{tag}, {smooth}"),
        (_("Angles"), _convention()),
        (_("Zero"), _zero(setup)),
        (_("Headings"), _headings(setup)),
        (_("Sampling"), _sampling(about)),
        (_("Software"), f"{about['software']}, {_('recorded with')} {about['recorded_with']}"),
        (_("Raw file"), str(about["raw_file"])),
        ("SHA-256", str(about["raw_sha256"])),
    ]
    if has_start(motion):
        out.insert(3, (_("Elbow and forearm"), _from_start()))
    found = [f"{one['kind']} ({', '.join(one['sensors']) or '–'})" for one in about["findings"]]
    if found:
        out.append((_("Findings"), "; ".join(found)))
    return out


def sources() -> list[tuple[str, str]]:
    """What each measure is, in a line, and where it is from."""
    return [
        (
            _("Active range of motion"),
            _(
                "Extremes of a running median over 0.05 s; normal ranges as taught by AAOS and "
                "ASSH."
            ),
        ),
        ("TAM", _("American Society for Surgery of the Hand; share of 260°.")),
        ("Strickland", "Strickland & Glogovac, J. Hand Surg. 5 (1980) 537"),
        ("Kapandji", "Kapandji, Ann. Chir. Main 5 (1986) 67"),
        (
            "SPARC, LDLJ",
            "Balasubramanian et al., IEEE Trans. Biomed. Eng. 59 (2012) 2126; "
            "J. NeuroEng. Rehabil. 12 (2015) 112",
        ),
        (_("Tremor"), "Welch, IEEE Trans. Audio 15 (1967) 70; 3–12 Hz"),
        (_("Finger independence"), "Häger-Ross & Schieber, J. Neurosci. 20 (2000) 8542"),
        (
            _("Time in posture"),
            "RULA, McAtamney & Corlett, Appl. Ergon. 24 (1993) 91; ISO 11228-3:2007",
        ),
        (
            _("Detectable change"),
            _(
                "1.96 √2 times the standard error of one measurement, which is never taken below "
                "2° of an angle."
            ),
        ),
    ]


def _convention() -> str:
    return _(
        "One rotation a joint, intrinsic flexion, deviation, rotation (about x, z, y); clinical "
        "signs after the ISB (Wu et al. 2005)."
    )


def _zero(setup: Setup) -> str:
    if setup.zero == NOMINAL_ZERO:
        return _("nominal mounting: sensor axes taken as segment axes")
    if setup.zero == "flat hand, functional axes":
        return _("the flat hand of the calibration, functional axes")
    return setup.zero


def _from_start() -> str:
    names = ", ".join(ROOT_ANGLES)
    return _(
        "{names}: from the forearm's attitude at the first rest (palm down), the upper arm taken "
        "as still: no sensor is on it."
    ).format(names=names)


def _headings(setup: Setup) -> str:
    if setup.heading_rad:
        return _("aligned by a turn of the whole arm, sensor by sensor")
    return _("by each sensor's compass")


def _sampling(about: dict[str, Any]) -> str:
    rate, loss = about["measured_rate_hz"], about["loss_percent"]
    measured = "–" if rate is None else f"{rate:.1f} Hz"
    lost = "–" if loss is None else f"{loss:.2f} %"
    return _("{nominal:g} Hz nominal, {measured} measured, {lost} lost").format(
        nominal=about["nominal_rate_hz"], measured=measured, lost=lost
    )
