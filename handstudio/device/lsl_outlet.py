"""Streaming poses by the Lab Streaming Layer: what a virtual tracker does. Needs ``trackers``."""

from __future__ import annotations

from typing import Any

from handstudio.device.lsl import library
from handstudio.simulation.streamed import RATE_HZ, ToldPose

_COLUMNS = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")


class LslOutlet:
    """A stream of one terminal's poses.

    Args:
        name: Of the stream.
        terminal: Of the terminal.

    Raises:
        DeviceError: the layer is not installed.
    """

    def __init__(self, name: str, terminal: str) -> None:
        self._lsl = library()
        info: Any = self._lsl.StreamInfo(
            name, "MoCap", len(_COLUMNS), RATE_HZ, self._lsl.cf_double64, name
        )
        channels = info.desc().append_child("channels")
        for column in _COLUMNS:
            channels.append_child("channel").append_child_value("label", f"{terminal}_{column}")
        self._outlet: Any = self._lsl.StreamOutlet(info)

    def tell(self, pose: ToldPose, ago_s: float) -> None:
        """Send a pose that was told so long ago."""
        at_s = self._lsl.local_clock() - ago_s
        self._outlet.push_sample([*pose.t_room_terminal, *pose.q_room_terminal], at_s)
