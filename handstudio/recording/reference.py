"""Reference orientations beside a take: what an optical system saw, or a simulation knows.

The pipeline never reads these; comparisons do.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TakeError


@dataclass(frozen=True, slots=True)
class Reference:
    """Orientations of some sensors, NaN where unseen; world frame z up, any heading."""

    time_us: Int64[Array, " n"]
    sensors: tuple[str, ...]
    q_world_sensor: Float[Array, "n s 4"]


def reference_path(take: Path) -> Path:
    """Where the reference of an imported take lives."""
    return take.with_suffix(".reference.npz")


def save_reference(take: Path, reference: Reference) -> None:
    """Store a reference beside a take."""
    np.savez_compressed(
        reference_path(take),
        time_us=reference.time_us,
        sensors=np.array(reference.sensors),
        q_world_sensor=reference.q_world_sensor,
    )


def load_reference(take: Path) -> Reference:
    """The reference of a take.

    Raises:
        TakeError: there is none, or it cannot be read.
    """
    path = reference_path(take)
    try:
        with np.load(path) as file:
            sensors = tuple(str(name) for name in file["sensors"])
            return Reference(file["time_us"], sensors, file["q_world_sensor"])
    except (OSError, KeyError, ValueError) as error:
        raise TakeError(
            "{path}: no reference can be read ({reason}).",
            "Import the folder again with a reference.csv in it.",
            path=path,
            reason=error,
        ) from error
