"""Health in words and figures: what is wrong and what to do, each sensor, the stream. Pure."""

from __future__ import annotations

import html
from dataclasses import dataclass

from app.state import State
from app.views.trust import distrusted, surest_words
from app.words import _
from handstudio.device.orders import Phase
from handstudio.health.findings import Finding, Kind
from handstudio.health.view import HealthView, SensorView
from handstudio.pipeline import Motion
from handstudio.setup import Setup

PAGE_LATE_MS = 150.0
"""A page that shows a pose this long after it was sent feels detached; half of it is noticed."""


@dataclass(frozen=True, slots=True)
class Advice:
    """A finding in words: what, how much against which limit, what to do."""

    title: str
    figure: str
    remedy: str
    act: bool


def advice_of(finding: Finding, names: tuple[str, ...]) -> Advice:
    """A finding in words; ``names`` are those of the layout's sensors."""
    title, unit, remedy = _words()[finding.kind]
    who = ", ".join(names[i] for i in finding.sensors if i < len(names))
    figure = _("{value} {unit}, limit {limit}").format(
        value=f"{finding.value:.3g}", unit=unit, limit=f"{finding.limit:.3g}"
    )
    return Advice(" ".join(filter(None, [title, who])), figure, remedy, finding.level == "act")


def page_advice(page_ms: float | None) -> Advice | None:
    """What to say of a page that shows the hand late; None where it does not."""
    if page_ms is None or page_ms < PAGE_LATE_MS:
        return None
    return Advice(
        _("This page is late"),
        _("{value} {unit}, limit {limit}").format(
            value=f"{page_ms:.0f}", unit="ms", limit=f"{PAGE_LATE_MS:.0f}"
        ),
        _("Close other tabs and programs, or hide the plots; what is recorded is not affected."),
        act=False,
    )


def worst_of(state: State) -> Advice | None:
    """The finding to act on first; None: nothing needs acting."""
    names = state.newest.setup.layout.names if state.newest.setup is not None else ()
    acts = [finding for finding in state.newest.findings if finding.level == "act"]
    return advice_of(acts[0], names) if acts else None


def as_html(state: State) -> str:
    """The whole sheet as the page shows it."""
    newest = state.newest
    if newest.setup is None:
        return _line(_("How stream and sensors do is shown here once a device sends."), 0.75)
    names = newest.setup.layout.names
    advices = [advice_of(finding, names) for finding in newest.findings]
    late = page_advice(state.page_ms)
    advices += [late] if late is not None else []
    advices.sort(key=lambda advice: not advice.act)
    parts = [_advice(advice) for advice in advices] or [_all_well(state)]
    parts.append(_sensors(newest.health, newest.findings, names))
    if newest.motion is not None and newest.phase is Phase.STREAMING:
        parts.append(_trust(newest.setup, newest.motion))
    parts.append(_figures(newest.health, state.page_ms))
    return "".join(parts)


_RED, _AMBER, _GREEN = "#e5484d", "#f5a524", "#12b886"


def _all_well(state: State) -> str:
    if state.newest.phase is not Phase.STREAMING:
        return _line(_("The device does not send; these are its last figures."), 0.75)
    well = html.escape(_("All is well: nothing to act on."))
    return f'<div style="padding:.6em .75em;font-size:.85rem;color:{_GREEN}">✓ {well}</div>'


def _advice(advice: Advice) -> str:
    colour = _RED if advice.act else _AMBER
    return (
        f'<div style="margin:.45em .75em;padding:.4em .7em;border-left:3px solid {colour};'
        'font-size:.82rem;line-height:1.4">'
        f"<b>{html.escape(advice.title)}</b> {html.escape(advice.figure)}"
        f'<div style="opacity:.8">{html.escape(advice.remedy)}</div></div>'
    )


def _sensors(health: HealthView, findings: tuple[Finding, ...], names: tuple[str, ...]) -> str:
    """One tile a sensor; what is wrong colours it, its figures are told under the pointer."""
    levels: dict[int, str] = {}
    for finding in findings:
        for sensor in finding.sensors:
            if levels.get(sensor) != "act":
                levels[sensor] = finding.level
    tiles = []
    for i, name in enumerate(names):
        view = health.sensors[i] if i < len(health.sensors) else SensorView()
        colour = {"act": _RED, "note": _AMBER}.get(levels.get(i, ""), "")
        edge = colour or "rgba(128,132,140,.45)"
        warmth = "" if view.celsius is None else f"{view.celsius:.0f}°"
        tiles.append(
            f'<div title="{html.escape(_told(name, view))}" style="border:1px solid {edge};'
            f"border-radius:4px;padding:.1em .3em;font-size:.7rem;line-height:1.35;color:"
            f'{colour or "inherit"}">{html.escape(name)} <span style="opacity:.6">{warmth}</span>'
            "</div>"
        )
    grid = "display:grid;grid-template-columns:repeat(5,1fr);gap:4px;padding:.2em .75em .6em"
    return f'<div style="{grid}">{"".join(tiles)}</div>'


def _told(name: str, view: SensorView) -> str:
    figures = [
        (_("not answering"), view.silent_percent, "%"),
        (_("at its limit"), view.saturated_percent, "%"),
        (_("noise against usual"), view.noise, "x"),
        (_("field changed by"), view.field_percent, "%"),
        (_("temperature"), view.celsius, "°C"),
        (_("warmer than at first by"), view.warmed_celsius, "°C"),
    ]
    told = [f"{words} {value:.3g} {unit}" for words, value, unit in figures if value is not None]
    return "\n".join([name, *told])


def _trust(setup: Setup, motion: Motion) -> str:
    """What is not trusted now, a line a sensor."""
    found = distrusted(setup, motion)
    if not found:
        return _line(surest_words(motion), 0.75)
    cells = "".join(
        f'<tr><td style="padding:.05em .8em .05em 0">{html.escape(one.sensor)}</td>'
        f'<td style="padding:.05em .8em .05em 0">{html.escape(one.segment)}</td>'
        f'<td style="color:{_AMBER}">{html.escape(one.why)}</td></tr>'
        for one in found
    )
    title = html.escape(_("Not to be trusted now"))
    return (
        f'<div style="padding:.3em .75em .4em;font-size:.78rem;line-height:1.3"><b>{title}</b>'
        f'<table style="border-collapse:collapse">{cells}</table></div>'
    )


def _figures(health: HealthView, page_ms: float | None) -> str:
    rows = [
        (_("Rate"), _rate(health)),
        (_("Loss"), f"{health.loss_percent:.2g} % ({health.missing})"),
        (_("Damaged packets"), f"{health.damaged}"),
        (_("Dropped by device"), f"{health.dropped_by_device}"),
        (_("Restarts"), f"{health.restarts}"),
        (_("Jitter, 95 %"), f"{health.jitter_p95_ms:.1f} ms"),
        (_("Byte to pose, 50 %"), f"{health.latency_p50_ms:.1f} ms"),
        (_("Byte to pose, 99 %"), f"{health.latency_p99_ms:.1f} ms"),
        (_("Pose to page and back"), "–" if page_ms is None else f"{page_ms:.0f} ms"),
        (_("Clock drift"), "–" if health.drift_ppm is None else f"{health.drift_ppm:+.0f} ppm"),
        (_("Warmest sensor"), "–" if health.celsius is None else f"{health.celsius:.0f} °C"),
    ]
    cells = "".join(
        f'<tr><td style="opacity:.75;padding:.1em 1em .1em 0">{html.escape(key)}</td>'
        f'<td style="text-align:right;font-variant-numeric:tabular-nums">{html.escape(value)}</td>'
        "</tr>"
        for key, value in rows
    )
    return (
        '<div style="padding:.3em .75em"><table style="width:100%;font-size:.8rem;'
        f'border-collapse:collapse">{cells}</table></div>'
    )


def _rate(health: HealthView) -> str:
    if health.nominal_rate_hz is None:
        return f"{health.rate_hz:.0f} Hz"
    return _("{rate:.0f} of {nominal:.0f} Hz").format(
        rate=health.rate_hz, nominal=health.nominal_rate_hz
    )


def _line(text: str, opacity: float) -> str:
    return (
        f'<div style="padding:.6em .75em;font-size:.82rem;opacity:{opacity}">'
        f"{html.escape(text)}</div>"
    )


def _words() -> dict[Kind, tuple[str, str, str]]:
    """What each finding is called, its unit, and what to do."""
    return {
        Kind.LOSS: (
            _("Instants get lost"),
            "%",
            _("Check the cable and its plugs; lower the rate if it goes on."),
        ),
        Kind.DAMAGED: (
            _("Packets arrive damaged"),
            "%",
            _("Change the cable, and keep it away from motors and chargers."),
        ),
        Kind.DROPPED: (
            _("The device drops instants"),
            "%",
            _("Lower the rate, close other programs, use a port of the computer, not a hub."),
        ),
        Kind.RESTARTED: (
            _("The device began anew"),
            _("times"),
            _("Check its supply and plug; then hold the hand still for half a second."),
        ),
        Kind.RATE: (
            _("The rate is not what the device says"),
            "%",
            _("Set the rate anew; if it stays, tell the maker: speeds are wrong by as much."),
        ),
        Kind.JITTER: (
            _("Data arrive unevenly"),
            "ms",
            _("Close other programs; use a port of the computer, not a hub."),
        ),
        Kind.LATE: (
            _("The hand is computed late"),
            "ms",
            _("Close other programs, or lower the rate. What is recorded is not affected."),
        ),
        Kind.DRIFT: (
            _("The device's clock runs differently"),
            "ppm",
            _("Do not match long takes to other recordings by time alone; tell the maker."),
        ),
        Kind.SILENT: (_("Not answering:"), "%", _("Check cable and plug of this sensor.")),
        Kind.STUCK: (
            _("Stuck:"),
            "s",
            _("Switch the glove off and on; if it comes back, the sensor is broken."),
        ),
        Kind.SATURATED: (
            _("At its limit:"),
            "%",
            _("Move more slowly and avoid knocks; angles at these instants are wrong."),
        ),
        Kind.NOISY: (
            _("Noisy:"),
            _("times the usual"),
            _("Check its soldering and supply; replace the sensor if it stays."),
        ),
        Kind.MAGNETIC: (
            _("Magnetic disturbance:"),
            "%",
            _(
                "Keep away from iron, magnets, phones and motors; take off rings. "
                "Heading is in doubt."
            ),
        ),
        Kind.WARMED: (
            _("Temperature changed:"),
            "°C",
            _("Hold the hand still for half a second before the next take; zero rates drift."),
        ),
    }
