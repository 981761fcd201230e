"""Formats of exports, as they are offered: those that this take can become."""

from __future__ import annotations

from app.words import _
from handstudio.errors import TakeError
from handstudio.export.formats import FORMATS, Format
from handstudio.export.part import Content
from handstudio.layout import Layout


def offered(layout: Layout) -> dict[str, Format]:
    """Formats by what they are called on the page, the spreadsheet's first."""
    words = {
        "csv": _("CSV (spreadsheets)"),
        "parquet": _("Parquet (data science)"),
        "mot": _("MOT (angles for OpenSim)"),
        "sto": _("STO (sensors for OpenSense)"),
        "trc": _("TRC (positions)"),
        "c3d": _("C3D (positions)"),
        "bvh": _("BVH (skeleton)"),
        "glb": _("GLB (animated 3-D)"),
        "glb-skin": _("GLB with skin (animated 3-D)"),
        "mcap": _("MCAP (Foxglove, Rerun)"),
        "svg": _("SVG (plots of angles)"),
    }
    return {words[name]: each for name, each in FORMATS.items() if _possible(each, layout)}


def contents(chosen: Format, layout: Layout) -> dict[str, Content]:
    """What a format can hold of a take of this layout, as it is called; empty: no choice."""
    words: dict[str, Content] = {
        _("Joint angles"): "angles",
        _("Orientations"): "orientations",
        _("Segments"): "segments",
        _("Positions"): "positions",
    }
    if len(chosen.contents) == 1:
        return {}
    return {w: c for w, c in words.items() if c in chosen.contents and _possible(chosen, layout, c)}


def _possible(chosen: Format, layout: Layout, content: Content | None = None) -> bool:
    try:
        chosen.content(content, layout)
    except TakeError:
        return False
    return True
