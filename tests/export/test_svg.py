"""SVG of plots: read as XML, its text is text, long curves keep their peaks."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from handstudio.export import svg as svg_module

_SVG = "{http://www.w3.org/2000/svg}"
_DC = "{http://purl.org/dc/elements/1.1/}"


def texts(path: Path) -> list[str]:
    return ["".join(node.itertext()).strip() for node in ET.parse(path).iter(f"{_SVG}text")]


def test_the_picture_names_angles_units_and_whose_they_are(into, whole):
    wanted = ("index_pip_flexion", "middle_pip_flexion", "thumb_ip_flexion")
    path = into("svg", whole, angles=wanted, start_s=1.0, end_s=3.0)
    words = texts(path)
    for label in ("PIP flexion", "Thumb", "index pip flexion", "angle [deg]", "time [s]"):
        assert label in words
    assert any("virtual-0" in each and "left hand" in each for each in words)
    told = json.loads(next(ET.parse(path).iter(f"{_DC}description")).text or "")
    assert told["raw_sha256"] == whole.take.sha256()


def test_nothing_is_drawn_over_a_gap(gappy):
    from handstudio.export.part import Part  # noqa: PLC0415

    part = Part(gappy.setup, gappy.motion, int(gappy.motion.time_us[0]), 0, "angles")
    time_s, degrees = svg_module._curves(part, part.angles)
    (gap,) = np.flatnonzero(np.isnan(degrees[:, -1]))
    assert (time_s[gap - 1], time_s[gap], time_s[gap + 1]) == (2.99, 2.99, 3.4)
    assert len(time_s) == len(gappy.motion) + 1


def test_of_long_curves_the_peaks_are_drawn():
    time_s = np.arange(100_000) * 0.01
    values = np.zeros((100_000, 2))
    values[54_321, 0], values[54_322, 1] = 80.0, -40.0
    values[:1000, 1] = np.nan
    drawn_s, drawn = svg_module._thinned(time_s, values)
    assert len(drawn_s) == len(drawn) <= 3000
    assert (drawn[:, 0].max(), np.nanmin(drawn[:, 1])) == (80.0, -40.0)
    at = drawn_s[int(np.argmax(drawn[:, 0]))]
    assert abs(at - 543.21) < 1.0
    assert np.isnan(drawn[: 2 * (1000 // 67), 1]).all()
