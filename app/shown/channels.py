"""What the plots show: named curves with units, of a hand or of bare sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float, Int64

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
from handstudio.signals import Signals

OVERVIEW, SPEEDS, SIGNALS = "overview", "speeds", "signals"
"""What can be plotted, besides all angles of one part of the hand."""

OF_TAKES = (SPEEDS, SIGNALS)
"""What is there of takes alone."""

_FINGERS = ("index", "middle", "ring", "little")
_PARTS = ("thumb", *_FINGERS, "wrist")
_MOST_SENSORS = 4  # without a hand: more curves than this say nothing


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: what it is called and its colour."""

    label: str
    colour: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Plot:
    """Curves that share a pair of axes, in this unit over seconds."""

    title: str
    curves: tuple[Curve, ...]
    unit: str = "°"


def sets_of(layout: Layout) -> dict[str, str]:
    """What can be plotted of a layout, by name, in words."""
    sets = {OVERVIEW: _("Overview")}
    if layout.is_hand:
        sets |= {name: _part_words(name) for name in _PARTS if _group(layout, name)}
        sets[SPEEDS] = _("Speeds of the overview")
    return {**sets, SIGNALS: _("Signals of a sensor")}


def plots_of(layout: Layout, chosen: str = OVERVIEW, sensor: str = "") -> tuple[Plot, ...]:
    """The plots of a layout, top to bottom; of signals, those of one sensor."""
    if chosen == SIGNALS:
        return _signal_plots(sensor)
    if not layout.is_hand:
        return _sensor_plots(layout)
    plots = tuple(plot for plot, _names in _hand_plots(layout, chosen, language()))
    if chosen == SPEEDS:
        return tuple(replace(plot, unit="°/s") for plot in plots)
    return plots


def values_of(setup: Setup, motion: Motion, chosen: str = OVERVIEW) -> Float[Array, "n c"]:
    """Values of all curves of angles in the order of the plots [deg]."""
    if setup.layout.is_hand:
        by_name = {angle.name: angle for angle in measured_angles(setup.layout)}
        wanted = [by_name[name] for name in _names(setup.layout, chosen)]
        degrees: Array = np.rad2deg(angles_of(setup, motion, wanted))
        return degrees
    return _sensor_values(setup.layout, motion)


def speeds_of(setup: Setup, motion: Motion, at: Int64[Array, " n"]) -> Float[Array, "n c"]:
    """Speeds of the overview's angles at some instants [deg/s], over the two beside each."""
    before, after = np.maximum(at - 1, 0), np.minimum(at + 1, len(motion) - 1)
    turned = values_of(setup, picked(motion, after)) - values_of(setup, picked(motion, before))
    seconds = (motion.time_us[after] - motion.time_us[before]) * 1e-6
    turned = (turned + 180.0) % 360.0 - 180.0
    return np.asarray(turned / np.where(seconds > 0.0, seconds, np.inf)[:, None])


def signals_of(signals: Signals, at: Int64[Array, " n"], sensor: int) -> Float[Array, "n 9"]:
    """What one sensor told at some instants: turn rates [deg/s], forces [m/s2], field [uT]."""
    kinds = np.rad2deg(signals.gyr[at, sensor]), signals.acc[at, sensor], signals.mag[at, sensor]
    return np.concatenate(kinds, axis=1, dtype=np.float64)


def picked(motion: Motion, index: Int64[Array, " m"]) -> Motion:
    """Some instants of a motion."""
    return Motion(*(getattr(motion, name)[index] for name in Motion.__slots__))


def sds_of(setup: Setup, motion: Motion, chosen: str = OVERVIEW) -> Float[Array, "n c"]:
    """How sure the filter is of each curve: standard deviations [deg]; inf where it does not tell.

    Of an angle it is that of the joint's child relative to the sensor before the joint.
    """
    layout = setup.layout
    columns = _hand_sources(layout, chosen) if layout.is_hand else _sensor_sources(layout)
    degrees: Array = np.rad2deg(
        motion.sd_rad[:, [s for s, _of in columns], [k for _, k in columns]]
    )
    return degrees


_OWN, _RELATIVE = 0, 1  # of `Motion.sd_rad`


def _hand_sources(layout: Layout, chosen: str) -> list[tuple[int, int]]:
    joints = {angle.name: angle.joint for angle in measured_angles(layout)}
    children = [SEGMENTS[joint_index(joints[name])] for name in _names(layout, chosen)]
    return [(layout.drivers[child], _RELATIVE) for child in children]


def _sensor_sources(layout: Layout) -> list[tuple[int, int]]:
    shown = range(min(len(layout.names), _MOST_SENSORS))
    own = [(sensor, _OWN) for sensor in shown for _part in range(3)]
    joints = layout.instrumented_joints
    return own + [(layout.drivers[joint.child], _RELATIVE) for joint in joints]


def _names(layout: Layout, chosen: str) -> list[str]:
    """Names of the angles in the plots, in their order."""
    return [name for _plot, names in _hand_plots(layout, chosen, language()) for name in names]


@cache
def _hand_plots(
    layout: Layout, chosen: str, _language: str
) -> tuple[tuple[Plot, tuple[str, ...]], ...]:
    if chosen in _PARTS:
        return tuple(_one_each(layout, chosen))
    measured = {angle.name for angle in measured_angles(layout)}
    groups: list[tuple[str, list[str], Callable[[str], str]]] = [
        (
            _("MCP flexion"),
            ["thumb_mcp_flexion", *(f"{f}_mcp_flexion" for f in _FINGERS)],
            _finger,
        ),
        (
            _("PIP flexion, thumb IP"),
            ["thumb_ip_flexion", *(f"{f}_pip_flexion" for f in _FINGERS)],
            _finger,
        ),
        (_("DIP flexion"), [f"{f}_dip_flexion" for f in _FINGERS], _finger),
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


def _one_each(layout: Layout, part: str) -> list[tuple[Plot, tuple[str, ...]]]:
    """Every angle of a part of the hand in a plot of its own."""
    curve = Curve(_part_words(part), colours.of_part(f"{part}_"))
    return [
        (Plot(_angle_words(name.removeprefix(f"{part}_")), (curve,)), (name,))
        for name in _group(layout, part)
    ]


def _group(layout: Layout, part: str) -> list[str]:
    arm = ("wrist_", "elbow_", "forearm_", "ulnar_cmc_") if part == "wrist" else (f"{part}_",)
    return [angle.name for angle in measured_angles(layout) if angle.name.startswith(arm)]


def _part_words(part: str) -> str:
    return _("wrist and forearm") if part == "wrist" else _finger(part)


def _angle_words(name: str) -> str:
    return {
        "mcp_flexion": _("MCP flexion"),
        "mcp_abduction": _("MCP abduction"),
        "mcp_deviation_ulnar": _("MCP ulnar deviation"),
        "pip_flexion": _("PIP flexion"),
        "dip_flexion": _("DIP flexion"),
        "cmc_flexion": _("CMC flexion"),
        "cmc_abduction": _("CMC abduction"),
        "cmc_rotation": _("CMC rotation"),
        "ip_flexion": _("IP flexion"),
        "flexion": _("wrist flexion"),
        "deviation_ulnar": _("ulnar deviation"),
        "elbow_flexion": _("elbow flexion"),
        "forearm_pronation": _("forearm pronation"),
        "ulnar_cmc_flexion": _("ulnar CMC flexion"),
    }[name]


def _signal_plots(sensor: str) -> tuple[Plot, ...]:
    axes = tuple(Curve(axis, colours.of_index(i)) for i, axis in enumerate("xyz"))
    return (
        Plot(_("{sensor} gyroscope").format(sensor=sensor), axes, "°/s"),
        Plot(_("{sensor} accelerometer").format(sensor=sensor), axes, "m/s²"),
        Plot(_("{sensor} magnetometer").format(sensor=sensor), axes, "µT"),
    )


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
