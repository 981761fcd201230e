"""A number that changes with compiled code: what is kept on disk must not be older than its source.

numba looks at the file of the function that is kept, not at those of the ones it calls.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any


def stamp(*namespaces: Mapping[str, Any]) -> int:
    """Of all compiled functions and all constants that these namespaces know; never 0."""
    code = [
        (kernel.py_func.__code__.co_code, repr(kernel.py_func.__code__.co_consts))
        for names in namespaces
        for kernel in names.values()
        if hasattr(kernel, "py_func")
    ]
    constants = [repr((k, v)) for names in namespaces for k, v in names.items() if k.isupper()]
    return zlib.crc32(repr((code, constants)).encode()) | 1
