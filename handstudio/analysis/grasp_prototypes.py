"""Postures of the hand in the grasps of manufacturing: what `grasps` compares with.

Classes: M. Cutkosky, IEEE Trans. Robotics and Automation 5 (1989) 269, figure 4, the heavy wraps
apart; names of T. Feix et al., IEEE Trans. Human-Machine Systems 46 (2016) 66. Angles are means
over development subjects 1 and 2 of the simulator, four grasps a class, one of the usual size and
three of sizes all over the class's range (``python -m benchmarks.grasps --design``).
"""

from __future__ import annotations

from dataclasses import dataclass

from handstudio.hand.skeleton import FINGERS

ANGLES = (
    "ulnar_cmc_flexion",
    "thumb_cmc_flexion",
    "thumb_cmc_abduction",
    "thumb_cmc_rotation",
    "thumb_mcp_flexion",
    "thumb_ip_flexion",
    *(
        f"{finger}_{turn}"
        for finger in FINGERS[1:]
        for turn in ("mcp_flexion", "mcp_abduction", "pip_flexion", "dip_flexion")
    ),
)
"""Names of the angles of a posture, in their order."""

SD_DEG = (
    6, 8, 8, 8, 8, 8, 8, 9, 8, 7, 7,
    8, 8, 7, 8, 8, 7, 7, 8, 8, 7, 7,
)  # fmt: skip
"""How much each varies within a class, and 6 degrees for people we have not seen."""


@dataclass(frozen=True, slots=True)
class Prototype:
    """A class of grasps.

    Attributes:
        name: In snake_case.
        feix: In the GRASP taxonomy; empty where that has none.
        degrees: Mean posture, as `ANGLES`.
    """

    name: str
    feix: str
    degrees: tuple[int, ...]


OPEN = "platform_push"
"""An open hand may push something or nothing; the posture does not tell, so it is no grasp."""

PROTOTYPES = (
    Prototype(
        "heavy_wrap_large",
        "Large Diameter",
        (-3, 0, 47, 17, 36, 28, 21, 10, 45, 20, 40, 3, 47, 31, 36, 1, 45, 28, 32, -1, 35, 21),
    ),
    Prototype(
        "heavy_wrap_small",
        "Small Diameter",
        (-3, -4, 33, 0, 47, 55, 75, 7, 73, 43, 85, 1, 73, 46, 73, -4, 73, 50, 66, 1, 61, 36),
    ),
    Prototype(
        "medium_wrap",
        "Medium Wrap",
        (-3, -3, 41, 18, 46, 59, 51, 0, 64, 28, 66, 1, 63, 41, 53, 3, 60, 41, 43, -8, 50, 29),
    ),
    Prototype(
        "adducted_thumb",
        "Adducted Thumb",
        (-2, -4, 8, 4, 6, 7, 46, -12, 55, 37, 55, 6, 67, 46, 50, -2, 68, 46, 51, -1, 58, 40),
    ),
    Prototype(
        "light_tool",
        "Light Tool",
        (2, -2, 20, 19, 51, 72, 67, -17, 84, 58, 74, -6, 88, 59, 56, 5, 88, 59, 52, -2, 68, 46),
    ),
    Prototype(
        "thumb_4_finger",
        "Prismatic 4 Finger",
        (15, 8, 39, 18, 37, 30, 61, 3, 34, 22, 68, 4, 38, 26, 53, 2, 38, 27, 53, -3, 25, 15),
    ),
    Prototype(
        "thumb_3_finger",
        "Prismatic 3 Finger",
        (9, 7, 38, 18, 32, 28, 59, 4, 31, 21, 67, 3, 35, 22, 54, -1, 34, 22, 35, 0, 71, 47),
    ),
    Prototype(
        "thumb_2_finger",
        "Prismatic 2 Finger",
        (0, 7, 37, 18, 31, 28, 61, 4, 30, 22, 67, 4, 35, 22, 34, 1, 70, 47, 34, -1, 71, 47),
    ),
    Prototype(
        "thumb_index_finger",
        "Palmar Pinch",
        (0, 7, 13, 5, 30, 29, 50, 0, 41, 27, 34, -1, 71, 48, 35, 0, 73, 48, 36, 0, 71, 48),
    ),
    Prototype(
        "power_disk",
        "Power Disk",
        (-3, -10, 10, 16, 33, 39, 15, 10, 66, 45, 15, 6, 72, 49, 12, 12, 70, 49, 11, -1, 64, 43),
    ),
    Prototype(
        "power_sphere",
        "Power Sphere",
        (-1, 7, 37, 11, 32, 32, 40, 7, 51, 34, 44, -2, 50, 29, 33, -1, 48, 31, 36, 0, 49, 31),
    ),
    Prototype(
        "precision_disk",
        "Precision Disk",
        (2, 5, 28, 6, 17, 23, 43, 9, 38, 26, 45, 3, 36, 24, 37, 2, 35, 23, 36, -6, 31, 22),
    ),
    Prototype(
        "precision_sphere",
        "Precision Sphere",
        (7, 13, 35, 7, 20, 25, 52, 3, 38, 25, 53, 3, 39, 26, 41, -2, 38, 26, 43, -12, 24, 16),
    ),
    Prototype(
        "tripod",
        "Tripod",
        (0, 11, 30, 10, 18, 21, 58, 3, 26, 17, 61, 10, 31, 22, 36, 0, 71, 48, 33, 0, 70, 48),
    ),
    Prototype(
        "platform_push",
        "",
        (-1, -18, 9, 1, 1, 12, -2, 3, 3, 1, -2, 1, 4, 3, 0, 2, 3, 2, -1, 5, 3, 3),
    ),
    Prototype(
        "lateral_pinch",
        "Lateral",
        (0, 9, 15, 6, 16, 27, 48, 0, 68, 44, 45, 0, 65, 43, 46, -2, 65, 42, 46, 1, 65, 43),
    ),
)
"""In the order of Cutkosky's figure: power before precision, prismatic before circular."""
