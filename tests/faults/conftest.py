"""The gloves, lines and the capture that the tests of devices have."""

from __future__ import annotations

import importlib.util
from pathlib import Path

_place = Path(__file__).parents[1] / "device" / "conftest.py"
_spec = importlib.util.spec_from_file_location("rig_of_devices", _place)
assert _spec is not None
assert _spec.loader is not None
_rig = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_rig)

leaves_nothing_behind = _rig.leaves_nothing_behind
new_child = _rig.new_child
glove_process = _rig.glove_process
glove = _rig.glove
port = _rig.port
proxy = _rig.proxy
studio = _rig.studio
