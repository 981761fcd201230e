"""What a pose of crossed coils is worth at a distance: noise against range, and metal nearby."""

from __future__ import annotations

from typing import Any

import numpy as np

from handstudio.maths import so3
from handstudio.shell import print_table
from handstudio.simulation.trackers import Metal, bent_by_metal
from handstudio.trackers.dipole import signals
from handstudio.trackers.dipole_pose import closed_form, refined

DISTANCES_M = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
NOISE_AT = 0.2
SHARE = 2.5e-4
"""Noise of a signal, of the strongest at 200 mm, the range of the seed's (0096): 0.1 mm there."""

_DRAWS = 400
_METAL_RADIUS_M = 0.05


def coil_range(seed: int = 1) -> list[dict[str, float]]:
    """A row a distance: errors of both ways, RMS over directions and attitudes, and the sd told."""
    rng = np.random.default_rng(seed)
    noise = SHARE * 2.0 / NOISE_AT**3
    return [_at(distance, noise, rng) for distance in DISTANCES_M]


def show_range(rows: list[dict[str, float]]) -> None:
    """As a table."""
    print_table(
        "Crossed coils: noise 1 in 4000 of the strongest signal at 200 mm",
        ["distance [mm]", "closed form [mm]", "refined [mm]", "told [mm]", "refined [deg]",
         "told [deg]", "100 mm of metal 300 mm away [mm]"],
        [
            [
                f"{row['distance_mm']:.0f}",
                *(f"{row[key]:.3g}" for key in ("closed_mm", "refined_mm", "told_mm",
                                                "refined_deg", "told_deg", "metal_mm")),
            ]
            for row in rows
        ],
    )  # fmt: skip


def _at(distance: float, noise: float, rng: np.random.Generator) -> dict[str, float]:
    way = rng.standard_normal((_DRAWS, 3))
    t = distance * way / np.linalg.norm(way, axis=1, keepdims=True)
    q = so3.normalize(rng.standard_normal((_DRAWS, 4)))
    heard = signals(t, q) + noise * rng.standard_normal((_DRAWS, 3, 3))
    closed, q_closed = closed_form(heard, towards=t)
    best = refined(heard, closed, q_closed, noise)
    sd = np.sqrt(np.diagonal(best.covariance, axis1=1, axis2=2))
    bent, _ = bent_by_metal(t, q, (Metal((0.0, 0.3, 0.0), _METAL_RADIUS_M),))
    return {
        "distance_mm": 1e3 * distance,
        "closed_mm": 1e3 * _rms(closed - t),
        "refined_mm": 1e3 * _rms(best.t_room_terminal - t),
        "told_mm": 1e3 * float(np.sqrt(np.mean(np.sum(sd[:, :3] ** 2, axis=1)))),
        "refined_deg": float(
            np.rad2deg(np.sqrt(np.mean(so3.angle_between(best.q_room_terminal, q) ** 2)))
        ),
        "told_deg": float(np.rad2deg(np.sqrt(np.mean(np.sum(sd[:, 3:] ** 2, axis=1))))),
        "metal_mm": 1e3 * float(np.median(np.linalg.norm(bent - t, axis=1))),
    }


def _rms(vectors: Any) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))
