"""Array types used in signatures.

Shapes are written with jaxtyping (``Float[Array, "n 3"]``); they are checked where tests run with
``--shapes`` and cost nothing otherwise.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]
