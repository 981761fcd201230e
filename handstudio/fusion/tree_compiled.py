"""How the tree filter's loops are compiled, and a number that changes with their code."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

from numba import njit

compiled = njit(error_model="numpy")
"""A division by zero is infinite, as in numpy: with a way out of every function at every division a
step takes twice as long, for the same digits."""

_KEPT: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True}
kept = njit(**_KEPT)
"""And kept on disk; other threads go on meanwhile. numba looks at the file of the function that is
kept, not at those of the ones it calls: it has to know a `stamp`."""


def stamp(*namespaces: Mapping[str, Any]) -> int:
    """Of all compiled functions and constants that these namespaces know, and of how; never 0."""
    code = [
        (kernel.py_func.__code__.co_code, repr(kernel.py_func.__code__.co_consts))
        for names in namespaces
        for kernel in names.values()
        if hasattr(kernel, "py_func")
    ]
    constants = [repr((k, v)) for names in namespaces for k, v in names.items() if k.isupper()]
    return zlib.crc32(repr((code, constants, _KEPT)).encode()) | 1
