"""What a pen wrote, as files: SVG and PNG in its true size, CSV with every instant."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.errors import TakeError

INK_M = 0.0015
"""Width of a line."""

_MARGIN_M = 0.006
_DPI = 200
_INCH_M = 0.0254
_DOT_M = 1e-4  # so long is a stroke drawn at least, or it is nothing to draw


def trace_svg(writing: Writing) -> str:
    """The strokes, one path each, in millimetres."""
    (left, bottom), (width, height) = _page(writing)
    paths = []
    for points in _drawn(writing):
        x, y = 1e3 * (points[:, 0] - left), 1e3 * (bottom + height - points[:, 1])
        line = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(x, y, strict=True))
        paths.append(f'<path d="M {line}"/>')
    w, h = 1e3 * width, 1e3 * height
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{w:.1f}mm" height="{h:.1f}mm" '
        f'viewBox="0 0 {w:.1f} {h:.1f}"><rect width="100%" height="100%" fill="#ffffff"/>'
        f'<g fill="none" stroke="#000000" stroke-width="{1e3 * INK_M:.2f}" '
        f'stroke-linecap="round" stroke-linejoin="round">{"".join(paths)}</g></svg>\n'
    )


def trace_png(writing: Writing, dpi: float = _DPI) -> bytes:
    """The same as pixels, true size at these dots an inch."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only where it is wanted

    (left, bottom), (width, height) = _page(writing)
    figure = Figure(figsize=(width / _INCH_M, height / _INCH_M), dpi=dpi)
    panel = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    panel.set_axis_off()
    panel.set(xlim=(left, left + width), ylim=(bottom, bottom + height))
    for points in _drawn(writing):
        panel.plot(
            *points.T,
            color="black",
            linewidth=72.0 * INK_M / _INCH_M,
            solid_capstyle="round",
            solid_joinstyle="round",
        )
    out = BytesIO()
    figure.savefig(out, format="png", facecolor="white")
    return out.getvalue()


def trace_csv(writing: Writing) -> bytes:
    """Every instant from taking the pen to laying it down; stroke 0: it does not write."""
    import pyarrow as pa  # noqa: PLC0415 - takes a while to load
    import pyarrow.csv  # noqa: PLC0415

    number = np.zeros(len(writing.time_s))
    for count, stroke in enumerate(writing.strokes, start=1):
        number[stroke] = count
    columns = {
        "time_s": np.round(writing.time_s, 6),
        "stroke": number,
        **_named("page_{}_mm", "xy", 1e3 * writing.flat, 3),
        "height_mm": _rounded(1e3 * writing.plane.height(writing.tip), 3),
        **_named("tip_{}_mm", "xyz", 1e3 * writing.tip, 3),
        **_named("pen_{}", "xyz", writing.direction, 5),
    }
    out = BytesIO()
    options = pa.csv.WriteOptions(include_header=True, quoting_style="none")
    pa.csv.write_csv(pa.table(columns), out, options)
    return out.getvalue()


def told(writing: Writing) -> dict[str, Any]:
    """What there is to say of it."""
    size = np.ptp(writing.flat[writing.down], axis=0)
    tilt = np.rad2deg(np.arccos(np.clip(writing.plane.normal[2], -1.0, 1.0)))
    return {
        "start_s": float(writing.time_s[0]),
        "end_s": float(writing.time_s[-1]),
        "strokes": len(writing.strokes),
        "length_mm": round(1e3 * writing.length_m, 1),
        "width_mm": round(1e3 * float(size[0]), 1),
        "height_mm": round(1e3 * float(size[1]), 1),
        "plane_tilt_deg": round(float(tilt), 2),
        "off_plane_sd_mm": round(1e3 * writing.height_sd_m, 3),
        "grip_sd_mm": round(1e3 * writing.rigid_sd_m, 3),
        "pen_tip_sd_mm": [round(1e3 * float(sd), 2) for sd in writing.tip_sd_m],
    }


PAGE = "x to the right, y up the page, from the middle of what is written; tip from the elbow"
"""What the columns of the CSV mean beside their names."""


def csv_sidecar(writing: Writing, about: dict[str, Any]) -> bytes:
    """The metadata of an export with what there is to say of the writing."""
    known = about | {"page": PAGE, "writing": told(writing)}
    return msgspec.json.format(msgspec.json.encode(known))


def save(path: Path, content: bytes) -> Path:
    """Write a file.

    Raises:
        TakeError: it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Choose another folder, or close the program that has the file open.",
            path=path,
            reason=error.strerror or error,
        ) from error
    return path


FORMATS: dict[str, Callable[[Writing], bytes]] = {
    "svg": lambda writing: trace_svg(writing).encode(),
    "png": trace_png,
    "csv": trace_csv,
}
"""What a trace can be written as."""


def _page(writing: Writing) -> tuple[Array, Array]:
    """Lower left corner, and size."""
    written = writing.flat[writing.down]
    low, high = written.min(axis=0) - _MARGIN_M, written.max(axis=0) + _MARGIN_M
    return low, high - low


def _drawn(writing: Writing) -> list[Array]:
    """Points of every stroke; a dot has two."""
    parts = [writing.flat[stroke] for stroke in writing.strokes]
    return [p if len(p) > 1 else np.concatenate([p, p + _DOT_M]) for p in parts]


def _named(name: str, axes: str, values: Array, digits: int) -> dict[str, Array]:
    columns = zip(axes, _rounded(values, digits).T, strict=True)
    return {name.format(axis): column for axis, column in columns}


def _rounded(values: Array, digits: int) -> Array:
    rounded: Array = np.round(values, digits) + 0.0  # no minus before a zero
    return rounded
