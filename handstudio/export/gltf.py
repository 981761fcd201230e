"""The container of glTF 2.0 in one file (GLB): a description in JSON, then numbers in bytes.

Khronos, glTF 2.0 Specification (2021), sections 3.6 and 4: chunks of multiples of four bytes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import msgspec
import numpy as np

from handstudio.arrays import Array

FLOAT, INDEX = 5126, 5123
"""Kinds of component: 32-bit float, 16-bit index."""

_SHAPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_JSON, _BIN = 0x4E4F534A, 0x004E4942


@dataclass
class Document:
    """A scene under construction: its description, and where in the bytes each array will lie.

    Attributes:
        about: The description, to which nodes, meshes, animations, skins are added.
        known: Arrays that are small enough to be kept until they are written, by their place.
        size: Bytes of all arrays.
    """

    about: dict[str, Any]
    known: dict[int, bytes] = field(default_factory=dict)
    size: int = 0

    def add(self, values: Array) -> int:
        """Take in an array, (n,) or (n, 3, 4 or 16), floats or indices; returns its accessor."""
        kind = INDEX if values.dtype.kind == "u" else FLOAT
        data = np.ascontiguousarray(values, dtype="<u2" if kind == INDEX else "<f4")
        wide = 1 if data.ndim == 1 else data.shape[1]
        self.known[self.size] = data.tobytes()
        limits = {
            "min": np.atleast_1d(data.min(axis=0)).tolist(),
            "max": np.atleast_1d(data.max(axis=0)).tolist(),
        }
        return self.reserve(len(data), wide, kind, limits)

    def reserve(
        self, count: int, wide: int, kind: int = FLOAT, limits: dict[str, Any] | None = None
    ) -> int:
        """Room for an array that is written later; returns its accessor."""
        views, accessors = self._list("bufferViews"), self._list("accessors")
        length = count * wide * (2 if kind == INDEX else 4)
        views.append({"buffer": 0, "byteOffset": self.size, "byteLength": length})
        accessor = {
            "bufferView": len(views) - 1,
            "componentType": kind,
            "count": count,
            "type": _SHAPES[wide],
        }
        accessors.append(accessor | (limits or {}))
        self.size += -(-length // 4) * 4
        return len(accessors) - 1

    def place_of(self, accessor: int) -> int:
        """Where in the bytes of all arrays one lies."""
        view = self.about["accessors"][accessor]["bufferView"]
        return int(self.about["bufferViews"][view]["byteOffset"])

    def begin(self, file: BinaryIO) -> int:
        """Write all that is known, with zeros in the room for the rest; returns where bytes are."""
        self.about["buffers"] = [{"byteLength": self.size}]
        text = msgspec.json.encode(self.about)
        text += b" " * (-len(text) % 4)
        whole = 12 + 8 + len(text) + 8 + self.size
        file.write(struct.pack("<4sII", b"glTF", 2, whole))
        file.write(struct.pack("<II", len(text), _JSON) + text)
        file.write(struct.pack("<II", self.size, _BIN))
        first = file.tell()
        for place, data in self.known.items():
            file.seek(first + place)
            file.write(data)
        file.truncate(whole)
        return first

    def _list(self, name: str) -> list[dict[str, Any]]:
        items: list[dict[str, Any]] = self.about.setdefault(name, [])
        return items
