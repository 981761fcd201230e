"""Every way to a joint, by name, and which frames each takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.trackers.estimate import JointEstimate
from handstudio.trackers.helical import mean_helical
from handstudio.trackers.least_variance import in_plane, least_variance
from handstudio.trackers.pair import Pair
from handstudio.trackers.plane import Plane, middle_plane
from handstudio.trackers.rolling import rolling
from handstudio.trackers.steady_axis import WIDTH, steady_axis
from handstudio.trackers.symmetric import centre

Finder: TypeAlias = Callable[[Pair, Plane | None], JointEstimate]


@dataclass(frozen=True, slots=True)
class Method:
    """A way to a joint.

    Attributes:
        name: By which it is chosen.
        what: In a sentence, for a person.
        source: Who it is from.
        find: Does it.
        steady: On frames with a steady axis only.
    """

    name: str
    what: str
    source: str
    find: Finder
    steady: bool = False


_ALL = (
    Method(
        "rolling",
        "Least squares over a joint that rolls under terminals that skin carries along",
        "ours",
        rolling,
    ),
    Method(
        "plane",
        "The point of the finger's middle plane whose distance varies least",
        "JP patent application, 0045 to 0074",
        in_plane,
    ),
    Method(
        "steady",
        "The same on frames with a steady axis",
        "JP patent application, 0075 to 0091",
        in_plane,
        steady=True,
    ),
    Method(
        "variance",
        "The point anywhere whose distance varies least",
        "JP patent application, 0038 to 0044",
        least_variance,
    ),
    Method(
        "symmetric",
        "Two points that stay together, and the axis of rotation",
        "Ehrig et al. 2006, 2007",
        centre,
    ),
    Method("helical", "The pivot of finite helical axes", "Woltring 1991", mean_helical),
)

METHODS: Mapping[str, Method] = {method.name: method for method in _ALL}
"""By name, the recommended one first."""


def method_named(name: str) -> Method:
    """The method of this name.

    Raises:
        TrackError: there is none.
    """
    if name not in METHODS:
        raise TrackError(
            "{name!r} is no way to find a joint.",
            "Choose one of {known}.",
            name=name,
            known=", ".join(METHODS),
        )
    return METHODS[name]


def estimated(
    pair: Pair,
    method: Method,
    *,
    plane: Plane | None = None,
    width: Float[Array, "3"] = WIDTH,
) -> JointEstimate:
    """The joint by a method; `TrackError` where it refuses.

    Args:
        pair: A joint bent.
        method: Which way.
        plane: Where it lies across the finger; the middle plane by the whole motion unless given.
        width: Across the finger in the room's axes at rest, for methods that want a steady axis.
    """
    plane = middle_plane(pair) if plane is None else plane
    if not method.steady:
        return method.find(pair, plane)
    used = steady_axis(pair, width=width).used
    found = method.find(pair.of(np.asarray(used)), plane)
    return replace(found, method=method.name)
