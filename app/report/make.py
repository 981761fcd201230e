"""A report of a take: measured, drawn and put into one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias

import msgspec
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from app import words
from app.report.certificate import Listing, certificate_of
from app.report.charts import angles_chart, ranges_chart, spectra_chart
from app.report.method import method_of, sources
from app.report.replay import is_cut, replay_of
from app.report.tables import tables_of
from app.words import _
from handstudio.analysis.posture_time import DEFAULT_BANDS, Band
from handstudio.analysis.series import AngleSeries, series_of
from handstudio.analysis.tremor import spectrum_of
from handstudio.analysis.whole import tremor_angles
from handstudio.errors import TakeError
from handstudio.export.part import Window, cut
from handstudio.measure import Measured, Visit, measure
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.notes import load_notes
from handstudio.recording.take import Take
from handstudio.setup import Setup

Progress: TypeAlias = Callable[[float], None]

_FINGERS = ("index", "middle", "ring", "little")
_CHARTS = (
    ("mcp", ("thumb_mcp_flexion", *(f"{f}_mcp_flexion" for f in _FINGERS))),
    ("pip", ("thumb_ip_flexion", *(f"{f}_pip_flexion" for f in _FINGERS))),
    ("dip", tuple(f"{f}_dip_flexion" for f in _FINGERS)),
    ("wrist", ("wrist_flexion", "wrist_deviation_ulnar", "forearm_pronation")),
    ("thumb", ("thumb_cmc_flexion", "thumb_cmc_abduction", "thumb_cmc_rotation")),
)


@dataclass(frozen=True, slots=True)
class Report:
    """A page, and what was measured for it."""

    html: str
    measured: Measured


def report_of(
    take: Take,
    setup: Setup | None = None,
    window: Window | None = None,
    *,
    earlier: Take | None = None,
    other_side: Take | None = None,
    bands: Sequence[Band] = DEFAULT_BANDS,
    language: str = "en",
    progress: Progress = lambda _share: None,
) -> Report:
    """Measure a take, or a part of it, and tell it as a page in a language.

    The words of this process are of that language afterwards.

    Raises:
        TakeError: the part holds no instant, a take cannot be read, or the earlier one is of
            another hand.
    """
    words.use_language(language)
    measured = measure(
        take,
        setup,
        window,
        earlier=earlier,
        other_side=other_side,
        bands=bands,
        progress=lambda done: progress(0.8 * done),
    )
    chosen = setup or take.header.setup
    motion = process(take, chosen)
    part = cut(motion, window or Window())
    start_us = int(motion.time_us[0])
    page = _page(take, chosen, part, start_us, measured)
    progress(0.95)
    html = _template().render(page)
    progress(1.0)
    return Report(html, measured)


def save_report(html: str, target: Path) -> Path:
    """Write the page.

    Raises:
        TakeError: it cannot be written.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(html, encoding="utf-8")
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Choose another folder, or close the program that has the file open.",
            path=target,
            reason=error.strerror or error,
        ) from error
    return target


def report_path(take: Path, language: str) -> Path:
    """Where the report of a take is kept: beside it."""
    return take.with_suffix(f".report.{language}.html")


def _page(
    take: Take, setup: Setup, motion: Motion, start_us: int, measured: Measured
) -> dict[str, Any]:
    """Everything that the template puts into its places."""
    recorded = datetime.fromisoformat(measured.visit.start_utc)
    hand = setup.layout.is_hand
    series = series_of(setup, motion, start_us) if hand else None
    replay = replay_of(setup, motion, start_us) if hand else None
    return {
        "language": words.language(),
        "words": _headings(),
        "title": _("Report of a hand"),
        "facts": _facts(take, setup, measured.visit, recorded),
        "earlier": None if measured.earlier is None else _earlier(measured.earlier),
        "other_side": None if measured.other_side is None else _other_side(measured.other_side),
        "warnings": _warnings(setup, measured.visit),
        "tables": tables_of(measured) if hand else [],
        "ranges": Markup(ranges_chart(measured.measures, _before(measured))),
        "charts": [] if series is None else _charts(series),
        "replay": None if replay is None else Markup(_as_script(replay)),
        "replay_note": _replay_note(replay),
        "certificate": _filled(certificate_of(setup, recorded)),
        "method": method_of(take, setup, motion),
        "sources": sources(),
        "notes": _notes(take),
        "player": Markup(_text("player.js")),
    }


def _headings() -> dict[str, str]:
    return {
        "replay": _("The hand in motion"),
        "measures": _("Measures"),
        "plots": _("Angles over time"),
        "certificate": _("Certificate of calibration"),
        "method": _("Method"),
        "sources": _("What the measures are"),
        "notes": _("Notes"),
        "play": _("Play"),
        "pause": _("Pause"),
        "speed": _("Speed"),
        "time": _("Time"),
        "hand": _("The hand; drag to turn it, turn the wheel to come nearer"),
        "drag": _("Drag to turn it, turn the wheel to come nearer."),
        "uncertainty": _(
            "± one standard uncertainty of filter, calibration and skin; two cover 95 of 100. A "
            "change counts from what measuring twice would give in 1 of 20."
        ),
        "legend_usual": _("usual"),
        "legend_now": _("reached, ± two standard uncertainties"),
        "legend_before": _("earlier visit"),
        "short": _("short of usual, or not asked for"),
        "changed": _("changed"),
        "offline": _("This page needs no network: everything is in it."),
    }


def _facts(take: Take, setup: Setup, visit: Visit, recorded: datetime) -> list[tuple[str, str]]:
    sides = {"left": _("left"), "right": _("right"), "unknown": _("unknown")}
    device = setup.device
    length = 1e3 * (setup.subject or setup.hand).hand_length_m
    return [
        (_("Subject"), visit.subject),
        (_("Which hand"), sides[visit.side]),
        (_("Hand length"), f"{length:.0f} mm"),
        (_("Visit"), visit.visit),
        (_("Take"), take.path.stem),
        (_("Recorded"), f"{recorded:%Y-%m-%d %H:%M} UTC"),
        (_("Part"), f"{visit.start_s:.2f}–{visit.end_s:.2f} s"),
        (_("Device"), "–" if device is None else f"{device.name} {device.serial_number}".strip()),
        (_("Angles known"), f"{visit.known_percent:.0f} %"),
    ]


def _earlier(earlier: Visit) -> str:
    return _("Compared with {take} of {visit}, calibration {calibration}.").format(
        take=earlier.take, visit=earlier.visit, calibration=_calibration(earlier)
    )


def _other_side(other: Visit) -> str:
    return _("The other hand: {take} of {visit}, calibration {calibration}.").format(
        take=other.take, visit=other.visit, calibration=_calibration(other)
    )


def _calibration(visit: Visit) -> str:
    return _("none") if visit.calibration.startswith("none") else visit.calibration


def _warnings(setup: Setup, visit: Visit) -> list[str]:
    out = []
    if not setup.layout.is_hand and setup.layout.no_hand is not None:
        out.append(" ".join(words.in_words(setup.layout.no_hand)))
    elif setup.subject is None:
        out.append(
            _("Without a calibration of the hand angles carry the tilt of the sensors' mounting.")
        )
    if setup.layout.is_hand and visit.known_percent < 99.5:
        out.append(
            _(
                "Of all angles {share:.0f} % are missing or in doubt; they count for nothing."
            ).format(share=100.0 - visit.known_percent)
        )
    if setup.layout.is_hand and not visit.uncertainty_told:
        out.append(
            _("This filter does not tell how sure it is: 1.5° stand for it in the uncertainties.")
        )
    return out


def _before(measured: Measured) -> dict[tuple[str, str], float]:
    return {(change.kind, change.about): change.before for change in measured.changes}


def _charts(series: AngleSeries) -> list[Markup]:
    titles = {
        "mcp": _("MCP flexion"),
        "pip": _("PIP flexion, thumb IP"),
        "dip": _("DIP flexion"),
        "wrist": _("Wrist and forearm"),
        "thumb": _("Base of the thumb"),
    }
    charts = [angles_chart(series, titles[name], names) for name, names in _CHARTS]
    spectra = {}
    for name in tremor_angles(series):
        found = spectrum_of(series.time_s, series.of(name))
        if found is not None:
            spectra[name] = found
    charts.append(spectra_chart(spectra))
    return [Markup(chart) for chart in charts if chart]


def _replay_note(replay: dict[str, Any] | None) -> str:
    if replay is None or not is_cut(replay):
        return ""
    minutes = replay["frames"] / replay["hz"] / 60.0
    return _("The first {minutes:.0f} minutes of the part.").format(minutes=minutes)


def _filled(listings: Sequence[Listing]) -> list[Listing]:
    return [each for each in listings if each.facts or each.rows or each.warning]


def _notes(take: Take) -> list[str]:
    try:
        notes = load_notes(take.path)
    except TakeError as error:
        return [" ".join(words.in_words(error))]
    return [line for line in notes.text.splitlines() if line.strip()]


def _as_script(value: dict[str, Any]) -> str:
    """JSON that cannot end the element it stands in."""
    return msgspec.json.encode(value).decode().replace("<", "\\u003c")


def _template() -> Any:
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_text("page.html.j2"))


def _text(name: str) -> str:
    return resources.files("app.report").joinpath(name).read_text(encoding="utf-8")
