"""Allan deviation drawn: every axis, the lines through their mean, the thesis's for comparison."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from handstudio.calibration.allan import AxisNoise, mean_of
from handstudio.calibration.noise import Noise
from handstudio.errors import CalibrationError
from handstudio.samples import STANDARD_GRAVITY

DEG, G = math.pi / 180.0, STANDARD_GRAVITY
"""One of the thesis's units in SI: its figures are in deg/s and G."""

THESIS_WHITE = {"gyr": (6.2e-3, 6.9e-3), "acc": (1.10e-4, 1.19e-4)}
THESIS_WALK = {"gyr": (1.41e-4, 6.15e-4), "acc": (1.1e-6, 8.7e-6)}
"""Table 4.1, 20 sensors, means of three axes: deg/sqrt(s), G sqrt(s); deg/s^1.5, G/sqrt(s)."""

_BLUE, _GREY = "#4477aa", "0.4"


def draw(noise: Noise, path: Path) -> None:
    """Write the picture; the ending says which kind: png, svg, pdf.

    Raises:
        CalibrationError: it cannot be written, or the library that draws is not installed.
    """
    try:
        import matplotlib as mpl  # noqa: PLC0415 - only where it is wanted

        mpl.use("Agg")
        from matplotlib import pyplot as plt  # noqa: PLC0415
    except ImportError as error:
        raise CalibrationError(
            "A picture needs matplotlib, which is not installed ({reason}).",
            "Install it, or go without --picture.",
            reason=error,
        ) from error
    figure, axes = plt.subplots(1, 2, figsize=(12, 5.5), layout="constrained")
    gyr = [axis for sensor in noise.sensors for axis in sensor.gyr]
    acc = [axis for sensor in noise.sensors for axis in sensor.acc]
    _panel(axes[0], gyr, DEG, "gyr")
    axes[0].set(title="Gyroscope", ylabel="Allan deviation [deg/s]")
    _panel(axes[1], acc, G, "acc")
    axes[1].set(title="Accelerometer", ylabel="Allan deviation [G]")
    minutes = ", ".join(f"{seconds / 60.0:.3g}" for seconds in noise.durations_s)
    figure.suptitle(
        f"{len(noise.sensors)} sensors at rest, {minutes} min at {noise.rate_hz:g} Hz: "
        "every axis, 95 % interval shaded"
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)
    except (OSError, ValueError) as error:  # ValueError: an ending that is no picture's
        raise CalibrationError(
            "{path}: the picture cannot be written ({reason}).",
            "Choose another folder, and a name that ends in .png, .svg or .pdf.",
            path=path,
            reason=error,
        ) from error
    finally:
        plt.close(figure)


def _panel(panel: Any, found: list[AxisNoise], unit: float, kind: str) -> None:
    tau = np.array(found[0].tau_s)
    opacity = min(0.12, 1.5 / len(found))
    for axis in found:
        low, high = np.array(axis.low) / unit, np.array(axis.high) / unit
        panel.fill_between(tau, low, high, color=_BLUE, alpha=opacity, lw=0)
        panel.loglog(tau, np.array(axis.sigma) / unit, color=_BLUE, lw=0.6, alpha=0.5)
    white = mean_of([axis.white for axis in found])
    walk = mean_of([axis.walk for axis in found])
    q, k = white.value / unit, walk.value / unit
    panel.loglog(tau, q / np.sqrt(tau), "--", color="k", lw=1, label=f"white noise, mean {q:.3g}")
    panel.plot(1.0, q, "o", color="k", ms=5)
    if walk.value > 0.0:
        said = f"walk, mean {k:.2g}" + ("" if walk.distinct else " (not distinct on every axis)")
        panel.loglog(tau, k * np.sqrt(tau / 3.0), ":", color="k", lw=1, label=said)
        panel.plot(3.0, k, "s", color="k", ms=5)
    for at, between in ((1.0, THESIS_WHITE[kind]), (3.0, THESIS_WALK[kind])):
        label = "thesis, table 4.1: 20 sensors" if at == 1.0 else None
        panel.plot([at, at], between, color="tab:red", lw=4, alpha=0.6, label=label)
    everything = np.concatenate([axis.sigma for axis in found]) / unit
    panel.set_ylim(min(0.5 * everything.min(), 0.5 * THESIS_WALK[kind][0]), 2.0 * everything.max())
    panel.set_xlabel("averaging time [s]")
    panel.grid(which="major", color=_GREY, alpha=0.25)
    panel.legend(loc="upper right", fontsize=9)
