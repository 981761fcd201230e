"""Plots on the right: angles over time, the playhead, the same seconds in all of them."""

from __future__ import annotations

import html

import numpy as np
import viser
from viser import uplot

from app import colours, intents
from app.panels.base import Send, put, typed
from app.shown.channels import Curve, Plot
from app.views.page import Curves
from app.words import _
from handstudio.arrays import Array

_HEIGHT = 164
_WIDE_PX = 400.0
"""On narrow pages too: a panel of another width does not stay put away."""
_VEIL = "38"  # how much of a band's colour is seen, as a page writes it
_WIDEST = 30.0  # [deg]: a band is not to press the curves flat
_AXIS = "#9aa0aa"
_FONT = "12px sans-serif"
_GRID: uplot.Axis_Grid = {"stroke": "rgba(128,132,140,0.22)", "width": 1}


class PlotsPanel:
    """Stacked plots; made anew only when other curves are to be shown."""

    def __init__(self, gui: viser.GuiApi, send: Send, narrow: bool) -> None:
        self._gui = gui
        self._panel = gui.add_panel()
        self._tab = self._panel.add_tab(_("Angles"), viser.Icon.CHART_LINE)
        with self._panel.add_tab(_("Health"), viser.Icon.HEARTBEAT):
            self._health = gui.add_html("")
        self._panel.dock_right()
        self._panel.set_width(_WIDE_PX)
        if narrow:
            self._panel.minimize()
        with self._tab:
            self._empty = gui.add_markdown(_("Curves appear here once a device sends."))
            self._set = gui.add_dropdown(_("Curves"), (_("Overview"),), visible=False)
            self._sensor = gui.add_dropdown(_("Sensor"), ("",), visible=False)
        self._sets: dict[str, str] = {}  # names by words
        self._set.on_update(typed(lambda words: send(intents.ChooseCurves(self._sets[words]))))
        self._sensor.on_update(
            typed(lambda name: send(intents.ChooseCurves(self._sets[self._set.value], name)))
        )
        self._plots: tuple[Plot, ...] = ()
        self._more = False, False  # bands of error, and second curves
        self._drawn: Curves | None = None
        self._dark = True
        self._heads: list[viser.GuiHtmlHandle] = []
        self._handles: list[viser.GuiUplotHandle] = []

    def render(self, curves: Curves | None, dark: bool) -> None:
        """Show curves, or that there are none."""
        plots = curves.plots if curves is not None else ()
        more = _more(curves)
        if (plots, more, dark) != (self._plots, self._more, self._dark):
            self._dark, self._more = dark, more
            self._build(plots)
        self._offer(curves)
        if curves is None:
            return
        if _same(curves, self._drawn):
            return  # a take that stands still costs nothing
        self._drawn = curves
        first = 0
        for plot, head, handle in zip(plots, self._heads, self._handles, strict=True):
            part = slice(first, first + len(plot.curves))
            put(head, content=_head(plot, dark, _of(curves.rms, part)))
            handle.data = _data(curves, part, _SPANS.get(plot.unit, 40.0))
            first = part.stop

    def _offer(self, curves: Curves | None) -> None:
        """What can be plotted."""
        put(self._set, visible=curves is not None)
        put(self._sensor, visible=curves is not None and bool(curves.sensors))
        if curves is None:
            return
        self._sets = {words: name for name, words in curves.sets.items()}
        if self._set.options != tuple(self._sets):
            self._set.options = tuple(self._sets)
        put(self._set, value=curves.sets[curves.chosen])
        if curves.sensors:
            if self._sensor.options != curves.sensors:
                self._sensor.options = curves.sensors
            put(self._sensor, value=curves.sensor)

    def render_health(self, content: str) -> None:
        """Show how stream and sensors do."""
        put(self._health, content=content)

    def remove(self) -> None:
        """Take the panel off its page."""
        self._panel.remove()

    def _build(self, plots: tuple[Plot, ...]) -> None:
        for handle in (*self._heads, *self._handles):
            handle.remove()
        self._heads, self._handles = [], []
        self._plots, self._drawn = plots, None
        self._empty.visible = not plots
        with self._tab:
            for plot in plots:
                self._heads.append(self._gui.add_html(_head(plot, self._dark)))
                self._handles.append(self._add(plot, last=plot is plots[-1]))

    def _add(self, plot: Plot, last: bool) -> viser.GuiUplotHandle:
        banded, twice = self._more
        tints = [colours.css(curve.colour, self._dark) for curve in plot.curves]
        series = [uplot.Series(label="s")]
        bands: list[uplot.Band] = []
        for tint in tints if banded else []:
            # an upper and a lower edge, and what is between them
            bands.append({"series": (len(series), len(series) + 1), "fill": f"{tint}{_VEIL}"})
            series += [_edge(), _edge()]
        for curve, tint in zip(plot.curves, tints, strict=True):
            series.append(uplot.Series(label=curve.label, stroke=tint, width=1.5))
        for curve in plot.curves if twice else ():
            series.append(_dashed(curve, self._dark))
        series.append(uplot.Series(label=_("now"), stroke="#8a909a", width=1))
        seconds: uplot.Axis = {"stroke": _AXIS, "grid": _GRID, "size": 30}
        if last:
            seconds |= {"label": _("Time [s]"), "labelSize": 18, "labelFont": _FONT}
        return self._gui.add_uplot(
            data=tuple(np.zeros(1) for _ in series),
            series=tuple(series),
            bands=tuple(bands) or None,
            scales={"x": {"time": False}},
            axes=(
                seconds,
                {"stroke": _AXIS, "grid": _GRID, "size": 46},
            ),
            legend={"show": False},
            height=_HEIGHT + (18 if last else 0),
            padding=(8, 12, 0, 0),
        )


def _same(curves: Curves, drawn: Curves | None) -> bool:
    """Whether these are the values that were drawn last, with the playhead where it was."""
    if drawn is None or curves.now_s != drawn.now_s:
        return False
    return curves.values is drawn.values and curves.second is drawn.second


def _more(curves: Curves | None) -> tuple[bool, bool]:
    """Whether there are bands of error, and second curves."""
    return (False, False) if curves is None else (curves.sds is not None, curves.second is not None)


def _edge() -> uplot.Series:
    return uplot.Series(label="±", stroke="transparent", width=0, points={"show": False})


def _dashed(curve: Curve, dark: bool) -> uplot.Series:
    stroke = colours.css(colours.apart(curve.colour, dark), dark=True)
    return uplot.Series(label=curve.label, stroke=stroke, width=1, dash=(6, 5))


def _of(figures: Array | None, part: slice) -> Array | None:
    return None if figures is None else figures[..., part]


def _head(plot: Plot, dark: bool, rms: Array | None = None) -> str:
    """Title, unit, which colour is what and by how much it differs, in a line above the plot."""
    figures = np.full(len(plot.curves), np.nan) if rms is None else rms
    labels = " ".join(
        f'<span style="color:{colours.css(curve.colour, dark)};white-space:nowrap">'
        f"&#9632; {html.escape(curve.label)}{_figure(float(figure), plot.unit)}</span>"
        for curve, figure in zip(plot.curves, figures, strict=True)
    )
    return (
        '<div style="font-size:.78rem;line-height:1.3;padding:.35em .75em 0">'
        f"<b>{html.escape(plot.title)} [{html.escape(plot.unit)}]</b> {labels}</div>"
    )


def _figure(rms: float, unit: str) -> str:
    return f" {rms:.1f}{unit}" if np.isfinite(rms) else ""


def _data(curves: Curves, part: slice, span: float) -> tuple[Array, ...]:
    """Aligned data: time, the curves, and the playhead as a spike from the lowest to the highest.

    It lies on the lower edge of the plot elsewhere, and its ends hold the plot's limits still.
    Holes (NaN) would upset the page's own ranging, so there are none.
    """
    second = _of(curves.second, part)
    shown = [curves.values[:, part], *([] if second is None else [second])]
    values = np.concatenate([*_edges(curves, part), *shown], axis=1)
    low, high = _limits(values, span)
    time_s, columns = curves.time_s, list(values.T)
    # live, it stands at the newest instant: beyond it the curves would be drawn without data
    now = float(time_s[-1]) if curves.now_s is None else curves.now_s
    now = min(max(now, float(time_s[0])), float(time_s[-1]))  # outside, it stands at the edge
    at = min(max(int(np.searchsorted(time_s, now, side="right")), 1), len(time_s))
    thin = (curves.to_s - curves.from_s) * 1e-5
    edge = [max(now - thin, time_s[at - 1]), now + thin]
    columns = [np.insert(column, at, [column[at - 1]] * 2) for column in columns]
    spike = np.full(len(time_s) + 2, low)
    spike[at : at + 2] = high
    return (np.insert(time_s, at, edge), *columns, spike)


def _edges(curves: Curves, part: slice) -> list[Array]:
    """Upper and lower edge of each curve's band, side by side; no width where nobody knows."""
    sds = _of(curves.sds, part)
    if sds is None:
        return []
    off = np.minimum(np.where(np.isfinite(sds), sds, 0.0), _WIDEST)
    values = curves.values[:, part]
    return [np.stack([values + off, values - off], axis=2).reshape(len(values), -1)]


_SPANS = {"°": 40.0, "°/s": 80.0, "m/s²": 8.0, "µT": 20.0}
"""How much of its unit a plot shows at least: noise is not to look like motion."""


def _limits(values: Array, span: float) -> tuple[float, float]:
    """Whole quarters of a span around all that is shown, at least a span apart."""
    if not np.isfinite(values).any():
        return -span / 2, span / 2
    step = span / 4
    low = float(np.floor(np.nanmin(values) / step) * step)
    high = float(np.ceil(np.nanmax(values) / step) * step)
    lacking = max(0.0, span - (high - low))
    return low - lacking / 2, high + lacking / 2
