"""Drawings of a report: ranges against what is usual, angles over time, spectra; as inline SVG.

Written by hand: they scale, print, and need nothing but the page they are in. Colours are classes
and custom properties of the page, so that they follow it.
"""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from app import colours
from app.report.names import about_name
from app.words import _
from handstudio.analysis.measure import Measure
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.tremor import BAND_HZ, Spectrum
from handstudio.arrays import Array

_WIDE = 760.0
_LEGEND = 152.0
_DASHES = ("", ' stroke-dasharray="5 3"', ' stroke-dasharray="1.5 2.5"')
"""Of the first curve in a colour, the second and the third."""

_POINTS = 900  # of a curve: more than it has pixels


def ranges_chart(measures: Sequence[Measure], before: dict[tuple[str, str], float]) -> str:
    """A bar from least to most of every angle with a norm, over the band of what is usual."""
    ends = {
        about: found
        for about in dict.fromkeys(m.about for m in measures)
        if len(found := _ends(measures, about)) == 2
    }
    if not ends:
        return ""
    left, right, row, top = 190.0, _WIDE - 14.0, 19.0, 24.0
    low, high = -100.0, 140.0
    height = top + row * len(ends) + 8.0

    def x(degrees: float) -> float:
        return left + (min(max(degrees, low), high) - low) / (high - low) * (right - left)

    parts = [_scale(x, range(-90, 140, 30), top, height)]
    for count, (about, (least, most)) in enumerate(ends.items()):
        y = top + row * (count + 0.5)
        colour = colours.css(colours.of_part(about), dark=False)
        usual = least.norm, most.norm
        if usual[0] is not None and usual[1] is not None:
            parts.append(_bar((x(usual[0]), x(usual[1])), y, 13.0, "usual"))
        parts.append(_text(left - 8.0, y + 3.5, about_name(about), "end"))
        old = [before.get((kind, about)) for kind in ("least", "most")]
        if old[0] is not None and old[1] is not None:
            parts.append(_bar((x(old[0]), x(old[1])), y + 5.0, 2.5, "before"))
        parts.append(_bar((x(least.value or 0.0), x(most.value or 0.0)), y, 6.0, "", colour))
        for end in (least, most):
            reach = 2.0 * (end.sd or 0.0)
            value = end.value or 0.0
            parts.append(_whisker(x(value - reach), x(value + reach), y))
    return _svg(_WIDE, height, parts, _("Ranges of motion against what is usual"))


def angles_chart(series: AngleSeries, title: str, names: Sequence[str]) -> str:
    """Angles over time with a band of one standard uncertainty, a line that follows the replay."""
    there = [name for name in names if name in series]
    curves = [(name, *_thinned(series, name)) for name in there]
    known = [values for _name, _time, values, _sd in curves if np.isfinite(values).any()]
    if not known:
        return ""
    left, right, top, bottom = 44.0, _WIDE - _LEGEND, 20.0, 150.0
    low = min(0.0, float(np.nanmin([np.nanmin(v) for v in known])))
    high = max(10.0, float(np.nanmax([np.nanmax(v) for v in known])))
    step = _step(high - low, 4)
    low, high = np.floor(low / step) * step, np.ceil(high / step) * step
    begin, end = float(series.time_s[0]), float(series.time_s[-1])
    span = max(end - begin, 1e-6)

    def x(second: Array) -> Array:
        return np.asarray(left + (second - begin) / span * (right - left))

    def y(degrees: Array) -> Array:
        return np.asarray(bottom - (degrees - low) / (high - low) * (bottom - top))

    parts = [_text(left, 12.0, title, "start", "title")]
    for tick in np.arange(low, high + 0.5 * step, step):
        at = float(y(tick))
        parts.append(f'<line class="grid" x1="{left}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}"/>')
        parts.append(_text(left - 6.0, at + 3.5, f"{tick:.0f}°".replace("-", "−"), "end"))
    seconds = _step(span, 8)
    for tick in np.arange(np.ceil(begin / seconds) * seconds, end, seconds):
        parts.append(_text(float(x(tick)), bottom + 14.0, f"{tick:g} s", "middle"))
    for count, (name, time_s, values, sd) in enumerate(curves):
        colour = colours.css(colours.of_part(name), dark=False)
        dash = _dash(there, name)
        band = _outline(x(time_s), y(values - sd), y(values + sd))
        parts.append(f'<path d="{band}" fill="{colour}" opacity=".18"/>')
        line = _line(x(time_s), y(values))
        parts.append(f'<path d="{line}" fill="none" stroke="{colour}" stroke-width="1.4"{dash}/>')
        label = top + 13.0 * count + 4.0
        parts.append(
            f'<line x1="{right + 8}" x2="{right + 26}" y1="{label}" y2="{label}" '
            f'stroke="{colour}" stroke-width="2.5"{dash}/>'
        )
        parts.append(_text(right + 31.0, label + 3.5, about_name(name), "start"))
    parts.append(
        f'<line class="now" data-x0="{left}" data-x1="{right}" data-t0="{begin:.3f}" '
        f'data-t1="{end:.3f}" x1="{left}" x2="{left}" y1="{top}" y2="{bottom}"/>'
    )
    return _svg(_WIDE, bottom + 20.0, parts, title)


def spectra_chart(spectra: dict[str, Spectrum]) -> str:
    """Amplitude spectra of angles that were held, the band of tremor shaded."""
    shown = {name: s for name, s in spectra.items() if s.windows}
    if not shown:
        return ""
    left, right, top, bottom = 56.0, _WIDE - _LEGEND, 20.0, 170.0
    inside = {name: (s.frequency_hz >= 1.0) & (s.frequency_hz <= 15.0) for name, s in shown.items()}
    roots = {name: np.rad2deg(np.sqrt(s.power[inside[name]])) for name, s in shown.items()}
    low = np.floor(np.log10(max(min(float(r.min()) for r in roots.values()), 1e-5)))
    high = np.ceil(np.log10(max(float(r.max()) for r in roots.values())))
    high = max(high, low + 1.0)

    def x(hertz: Array | float) -> Array:
        return np.asarray(left + (np.asarray(hertz) - 1.0) / 14.0 * (right - left))

    def y(root: Array) -> Array:
        seen = np.maximum(root, 10.0**low)  # what is less lies on the lower edge
        return np.asarray(bottom - (np.log10(seen) - low) / (high - low) * (bottom - top))

    a, b = (float(x(edge)) for edge in BAND_HZ)
    parts = [
        f'<rect class="usual" x="{a:.1f}" y="{top}" width="{b - a:.1f}" height="{bottom - top}"/>'
    ]
    parts.append(
        _text(left, 12.0, _("Spectrum of angles that were held [°/√Hz]"), "start", "title")
    )
    for power in np.arange(low, high + 0.5):
        at = float(y(np.array(10.0**power)))
        parts.append(f'<line class="grid" x1="{left}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}"/>')
        parts.append(_text(left - 6.0, at + 3.5, f"{10.0**power:g}", "end"))
    for hertz in (1, 3, 6, 9, 12, 15):
        parts.append(_text(float(x(hertz)), bottom + 14.0, f"{hertz} Hz", "middle"))
    for count, (name, spectrum) in enumerate(shown.items()):
        colour = colours.css(colours.of_part(name), dark=False)
        dash = _dash(list(shown), name)
        line = _line(x(spectrum.frequency_hz[inside[name]]), y(roots[name]))
        parts.append(f'<path d="{line}" fill="none" stroke="{colour}" stroke-width="1.3"{dash}/>')
        label = top + 13.0 * count + 4.0
        parts.append(
            f'<line x1="{right + 8}" x2="{right + 26}" y1="{label}" y2="{label}" '
            f'stroke="{colour}" stroke-width="2.5"{dash}/>'
        )
        parts.append(_text(right + 31.0, label + 3.5, about_name(name), "start"))
    return _svg(_WIDE, bottom + 20.0, parts, _("Spectrum of angles that were held [°/√Hz]"))


def _ends(measures: Sequence[Measure], about: str) -> list[Measure]:
    kinds = ("least", "most")
    found = {m.kind: m for m in measures if m.about == about and m.value is not None}
    return [found[kind] for kind in kinds if kind in found and found[kind].norm is not None]


def _dash(names: Sequence[str], name: str) -> str:
    """Curves of one colour differ by their dashes."""
    alike = [each for each in names if colours.of_part(each) == colours.of_part(name)]
    return _DASHES[alike.index(name) % len(_DASHES)]


def _thinned(
    series: AngleSeries, name: str
) -> tuple[Float[Array, " p"], Float[Array, " p"], Float[Array, " p"]]:
    """As many instants as can be seen: time, angle and uncertainty [deg]."""
    pick = np.unique(np.linspace(0, len(series.time_s) - 1, _POINTS).round().astype(int))
    return (
        series.time_s[pick],
        np.rad2deg(series.of(name)[pick]),
        np.rad2deg(series.sds(name)[pick]),
    )


def _pieces(values: Array) -> list[slice]:
    known = np.isfinite(values)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], known, [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _line(x: Array, y: Array) -> str:
    return "".join(_through(x[part], y[part]) for part in _pieces(y))


def _outline(x: Array, low: Array, high: Array) -> str:
    out = []
    for part in _pieces(low + high):
        there, back = _through(x[part], high[part]), _through(x[part][::-1], low[part][::-1])
        out.append(f"{there}L{back[1:]}Z")
    return "".join(out)


def _through(x: Array, y: Array) -> str:
    points = [f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True)]
    return f"M{points[0]}L{' '.join(points[1:] or points)}"


def _step(span: float, count: int) -> float:
    """A round step that divides a span about so often."""
    rough = span / count
    power = 10.0 ** np.floor(np.log10(rough))
    return float(next(m * power for m in (1.0, 2.0, 3.0, 5.0, 10.0) if m * power >= rough))


def _scale(x: object, ticks: range, top: float, height: float) -> str:
    assert callable(x)
    out = []
    for tick in ticks:
        at = x(float(tick))
        kind = "axis" if tick == 0 else "grid"
        out.append(
            f'<line class="{kind}" x1="{at:.1f}" x2="{at:.1f}" y1="{top}" y2="{height - 6}"/>'
        )
        out.append(_text(at, top - 7.0, f"{tick}°".replace("-", "−"), "middle"))
    return "".join(out)


def _bar(ends: tuple[float, float], y: float, thick: float, kind: str, colour: str = "") -> str:
    a, b = ends
    fill = f' fill="{colour}"' if colour else ""
    return (
        f'<rect class="{kind}" x="{min(a, b):.1f}" y="{y - 0.5 * thick:.1f}" '
        f'width="{max(abs(b - a), 1.0):.1f}" height="{thick}" rx="2"{fill}/>'
    )


def _whisker(a: float, b: float, y: float) -> str:
    return f'<line class="whisker" x1="{a:.1f}" x2="{b:.1f}" y1="{y:.1f}" y2="{y:.1f}"/>'


def _text(x: float, y: float, words: str, anchor: str, kind: str = "") -> str:
    return (
        f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">'
        f"{html.escape(words)}</text>"
    )


def _svg(width: float, height: float, parts: Sequence[str], title: str) -> str:
    return (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'aria-label="{html.escape(title)}">{"".join(parts)}</svg>'
    )
