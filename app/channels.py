"""What the plots show: named curves with units, of a hand or of bare sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from app import colours
from app.words import _, language
from handstudio.arrays import Array
from handstudio.hand.angles import joint_index
from handstudio.hand.skeleton import SEGMENTS
from handstudio.kinematics import angles_of, measured_angles, relative_rotations
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup

_MOST_SENSORS = 4  # without a hand: more curves than this say nothing


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: what it is called and its colour."""

    label: str
    colour: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Plot:
    """Curves that share a pair of axes, degrees over seconds."""

    title: str
    curves: tuple[Curve, ...]


def plots_of(layout: Layout) -> tuple[Plot, ...]:
    """The plots of a layout, top to bottom."""
    if layout.is_hand:
        return tuple(plot for plot, _names in _hand_plots(layout, language()))
    return _sensor_plots(layout)


def values_of(setup: Setup, motion: Motion) -> Float[Array, "n c"]:
    """Values of all curves in the order of the plots [deg]."""
    if setup.layout.is_hand:
        by_name = {angle.name: angle for angle in measured_angles(setup.layout)}
        wanted = [
            by_name[name]
            for _plot, names in _hand_plots(setup.layout, language())
            for name in names
        ]
        degrees: Array = np.rad2deg(angles_of(setup, motion, wanted))
        return degrees
    return _sensor_values(setup.layout, motion)


def sds_of(setup: Setup, motion: Motion) -> Float[Array, "n c"]:
    """How sure the filter is of each curve: standard deviations [deg]; inf where it does not tell.

    Of an angle it is that of the joint's child relative to the sensor before the joint.
    """
    layout = setup.layout
    columns = _hand_sources(layout) if layout.is_hand else _sensor_sources(layout)
    degrees: Array = np.rad2deg(
        motion.sd_rad[:, [s for s, _of in columns], [k for _, k in columns]]
    )
    return degrees


_OWN, _RELATIVE = 0, 1  # of `Motion.sd_rad`


def _hand_sources(layout: Layout) -> list[tuple[int, int]]:
    joints = {angle.name: angle.joint for angle in measured_angles(layout)}
    names = [name for _plot, names in _hand_plots(layout, language()) for name in names]
    children = [SEGMENTS[joint_index(joints[name])] for name in names]
    return [(layout.drivers[child], _RELATIVE) for child in children]


def _sensor_sources(layout: Layout) -> list[tuple[int, int]]:
    shown = range(min(len(layout.names), _MOST_SENSORS))
    own = [(sensor, _OWN) for sensor in shown for _part in range(3)]
    joints = layout.instrumented_joints
    return own + [(layout.drivers[joint.child], _RELATIVE) for joint in joints]


@cache
def _hand_plots(layout: Layout, _language: str) -> tuple[tuple[Plot, tuple[str, ...]], ...]:
    measured = {angle.name for angle in measured_angles(layout)}
    fingers = ("index", "middle", "ring", "little")
    groups: list[tuple[str, list[str], Callable[[str], str]]] = [
        (
            _("MCP flexion"),
            ["thumb_mcp_flexion", *(f"{f}_mcp_flexion" for f in fingers)],
            _finger,
        ),
        (
            _("PIP flexion, thumb IP"),
            ["thumb_ip_flexion", *(f"{f}_pip_flexion" for f in fingers)],
            _finger,
        ),
        (_("DIP flexion"), [f"{f}_dip_flexion" for f in fingers], _finger),
        (
            _("Wrist and thumb base"),
            ["wrist_flexion", "wrist_deviation_ulnar", "thumb_cmc_abduction", "thumb_cmc_flexion"],
            _whole,
        ),
    ]
    shades = {"wrist_deviation_ulnar": colours.FOREARM, "thumb_cmc_flexion": colours.THUMB_PALE}
    out = []
    for title, names, label in groups:
        present = tuple(name for name in names if name in measured)
        curves = tuple(Curve(label(n), shades.get(n, colours.of_part(n))) for n in present)
        if present:
            out.append((Plot(title, curves), present))
    return tuple(out)


def _finger(name: str) -> str:
    finger = name.split("_", maxsplit=1)[0]
    return {
        "thumb": _("thumb"),
        "index": _("index"),
        "middle": _("middle"),
        "ring": _("ring"),
        "little": _("little"),
    }[finger]


def _whole(name: str) -> str:
    return {
        "wrist_flexion": _("wrist flexion"),
        "wrist_deviation_ulnar": _("ulnar deviation"),
        "thumb_cmc_abduction": _("thumb abduction"),
        "thumb_cmc_flexion": _("thumb flexion"),
    }[name]


def _sensor_plots(layout: Layout) -> tuple[Plot, ...]:
    parts = (_("roll"), _("pitch"), _("heading"))
    plots = [
        Plot(name, tuple(Curve(part, colours.of_index(i)) for i, part in enumerate(parts)))
        for name in layout.names[:_MOST_SENSORS]
    ]
    across = [joint.name for joint in layout.instrumented_joints]
    if across:
        curves = tuple(Curve(name, colours.of_index(i)) for i, name in enumerate(across))
        plots.append(Plot(_("Turn across the joint"), curves))
    return tuple(plots)


def _sensor_values(layout: Layout, motion: Motion) -> Array:
    columns = []
    for sensor in range(min(len(layout.names), _MOST_SENSORS)):
        m = so3.to_matrix(motion.q_world_sensor[:, sensor])
        columns += [
            np.arctan2(m[:, 2, 1], m[:, 2, 2]),
            -np.arcsin(np.clip(m[:, 2, 0], -1.0, 1.0)),
            np.arctan2(m[:, 1, 0], m[:, 0, 0]),
        ]
    for q in relative_rotations(layout, motion.q_world_sensor).values():
        columns.append(np.linalg.norm(so3.log(q), axis=-1))
    degrees: Array = np.rad2deg(np.stack(columns, axis=-1))
    return degrees
