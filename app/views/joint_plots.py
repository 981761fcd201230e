"""Axes of a joint's turns, drawn: where they point, and how many are alike; as inline SVG. Pure."""

from __future__ import annotations

import html

import numpy as np

from app.views.pieces import GREEN, GREY
from app.words import _
from handstudio.trackers.study import JointStudy

_SIDE, _WIDE, _HIGH = 180.0, 330.0, 180.0
_RINGS_DEG = (10.0, 30.0, 60.0, 90.0)
_TEXT = 'font-size="11" fill="currentColor"'


def cloud_picture(study: JointStudy) -> str:
    """Axes seen along the finger's width, their distance from the middle their angle off it."""
    title = _("Axis of every turn, off the finger's width [°]")
    axes = study.axis_cloud
    middle, reach = _SIDE / 2.0, _SIDE / 2.0 - 14.0
    parts = []
    for ring in _RINGS_DEG:
        radius = reach * ring / 90.0
        parts.append(
            f'<circle cx="{middle}" cy="{middle}" r="{radius:.1f}" fill="none" stroke="{GREY}"/>'
            f'<text x="{middle + 2:.1f}" y="{middle - radius - 2:.1f}" {_TEXT}>{ring:.0f}</text>'
        )
    if len(axes):
        width, first, second = _seen_along(study)
        off = np.rad2deg(np.arccos(np.clip(axes @ width, -1.0, 1.0)))
        a, b = axes @ first, axes @ second
        flat = np.maximum(np.hypot(a, b), 1e-12)
        x = middle + reach * off / 90.0 * a / flat
        y = middle - reach * off / 90.0 * b / flat
        parts += [
            f'<circle cx="{one:.1f}" cy="{other:.1f}" r="1.4" fill="{GREEN}" fill-opacity=".35"/>'
            for one, other in zip(x[::_EVERY], y[::_EVERY], strict=True)
        ]
    return _figure(title, _SIDE, _SIDE, "".join(parts))


def class_histogram(study: JointStudy) -> str:
    """Frames by their axis' share across the finger; the fullest class stands out."""
    title = _("Frames by their axis' share across the finger")
    counts = study.class_counts
    left, right, top, bottom = 44.0, _WIDE - 8.0, 12.0, _HIGH - 36.0
    most = max(int(counts.max(initial=0)), 1)
    step = (right - left) / max(len(counts), 1)
    parts = [
        f'<rect x="{left + i * step:.1f}" y="{bottom - (bottom - top) * n / most:.1f}" '
        f'width="{max(step, 1.0):.1f}" height="{(bottom - top) * n / most:.1f}" '
        f'fill="{GREEN if i == study.fullest else "currentColor"}" '
        f'fill-opacity="{1.0 if i == study.fullest else 0.55}"/>'
        for i, n in enumerate(counts)
        if n
    ]
    parts.append(
        f'<path d="M{left} {top}V{bottom}H{right}" fill="none" stroke="currentColor" '
        'stroke-opacity=".6"/>'
    )
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x = left + (right - left) * share
        parts.append(
            f'<text x="{x:.1f}" y="{bottom + 14:.1f}" text-anchor="middle" {_TEXT}>{share:g}</text>'
        )
    for count in (0, most):
        y = bottom - (bottom - top) * count / most
        parts.append(
            f'<text x="{left - 4}" y="{y + 4:.1f}" text-anchor="end" {_TEXT}>{count}</text>'
        )
    below = _("share of the axis across the finger (1: along its width)")
    parts.append(
        f'<text x="{(left + right) / 2:.1f}" y="{_HIGH - 6:.1f}" text-anchor="middle" {_TEXT}>'
        f"{html.escape(below)}</text>"
    )
    aside = _("frames")
    parts.append(
        f'<text transform="translate(10 {(top + bottom) / 2:.1f}) rotate(-90)" '
        f'text-anchor="middle" {_TEXT}>{html.escape(aside)}</text>'
    )
    return _figure(title, _WIDE, _HIGH, "".join(parts))


_EVERY = 2  # of the points that a study has for drawing


def _seen_along(study: JointStudy) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Across the finger, and two axes of the tracker square to it, to the right and up."""
    width = study.width
    first = np.eye(3)[int(np.argmin(np.abs(width)))]
    first = first - (first @ width) * width
    first = first / np.linalg.norm(first)
    return width, first, np.cross(width, first)


def _figure(title: str, width: float, height: float, content: str) -> str:
    return (
        f'<figure style="margin:0"><figcaption style="font-size:.85rem;font-weight:600">'
        f'{html.escape(title)}</figcaption><svg role="img" aria-label="{html.escape(title)}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}">'
        f"{content}</svg></figure>"
    )
