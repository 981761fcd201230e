"""What is not ideal about real sensors: how strong each error is, and what it makes of a reading.

`strengths` says how much of what; `readout` is one kind of sensor by itself, without a wearer.
"""

from handstudio.simulation.imperfections.readout import (
    MPU9250,
    Biases,
    Readings,
    ReadoutState,
    SensorKind,
    draw_biases,
    read,
    switched_on,
)

__all__ = [
    "MPU9250",
    "Biases",
    "Readings",
    "ReadoutState",
    "SensorKind",
    "draw_biases",
    "read",
    "switched_on",
]
