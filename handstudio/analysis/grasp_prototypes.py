"""Postures of the hand in the grasps of manufacturing: what `grasps` compares with.

Classes: M. Cutkosky, IEEE Trans. Robotics and Automation 5 (1989) 269, figure 4, the heavy wraps
apart; names of T. Feix et al., IEEE Trans. Human-Machine Systems 46 (2016) 66. Angles are means
over development subjects 1 to 3 of the simulator, nine grasps a class, a third of the usual size
and the others of sizes all over the class's range (``python -m benchmarks.grasps --design``).
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
    6, 9, 8, 8, 8, 8, 8, 9, 8, 7, 8,
    8, 8, 7, 8, 8, 8, 7, 8, 8, 8, 7,
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
        (-2, 1, 48, 18, 37, 27, 23, 11, 45, 21, 40, 3, 47, 30, 36, 0, 45, 28, 33, 0, 35, 21),
    ),
    Prototype(
        "heavy_wrap_small",
        "Small Diameter",
        (-3, -3, 31, 0, 47, 55, 76, 5, 74, 44, 84, 0, 75, 47, 73, -3, 74, 51, 66, 1, 62, 36),
    ),
    Prototype(
        "medium_wrap",
        "Medium Wrap",
        (-2, -1, 40, 18, 46, 58, 51, 3, 65, 29, 64, 0, 63, 40, 53, 3, 60, 40, 44, -7, 50, 29),
    ),
    Prototype(
        "adducted_thumb",
        "Adducted Thumb",
        (-1, -4, 8, 4, 6, 7, 47, -12, 56, 38, 54, 5, 68, 46, 51, -1, 69, 47, 52, -1, 59, 40),
    ),
    Prototype(
        "light_tool",
        "Light Tool",
        (4, -3, 20, 19, 51, 72, 68, -16, 82, 57, 73, -6, 87, 58, 55, 4, 88, 59, 51, -2, 67, 45),
    ),
    Prototype(
        "thumb_4_finger",
        "Prismatic 4 Finger",
        (15, 6, 39, 18, 37, 29, 62, 3, 34, 22, 68, 4, 38, 25, 53, 1, 39, 26, 53, -3, 24, 15),
    ),
    Prototype(
        "thumb_3_finger",
        "Prismatic 3 Finger",
        (9, 8, 37, 18, 32, 28, 60, 4, 32, 21, 66, 4, 35, 22, 54, -1, 34, 22, 34, 0, 71, 47),
    ),
    Prototype(
        "thumb_2_finger",
        "Prismatic 2 Finger",
        (0, 7, 36, 18, 32, 28, 61, 4, 30, 22, 67, 5, 34, 22, 34, 1, 70, 47, 34, -1, 71, 47),
    ),
    Prototype(
        "thumb_index_finger",
        "Palmar Pinch",
        (0, 7, 14, 7, 30, 28, 50, 1, 42, 27, 34, -1, 70, 48, 36, 0, 72, 48, 36, 0, 71, 48),
    ),
    Prototype(
        "power_disk",
        "Power Disk",
        (-3, -8, 9, 16, 31, 38, 16, 9, 64, 43, 15, 6, 68, 47, 13, 10, 66, 46, 12, -1, 60, 41),
    ),
    Prototype(
        "power_sphere",
        "Power Sphere",
        (0, 8, 37, 11, 32, 31, 41, 6, 52, 34, 43, 0, 50, 29, 33, -2, 48, 31, 37, -1, 48, 31),
    ),
    Prototype(
        "precision_disk",
        "Precision Disk",
        (4, 6, 28, 6, 17, 23, 44, 8, 39, 26, 44, 3, 36, 23, 37, 1, 35, 24, 36, -6, 31, 21),
    ),
    Prototype(
        "precision_sphere",
        "Precision Sphere",
        (8, 14, 35, 8, 21, 25, 53, 3, 38, 25, 53, 3, 38, 25, 40, -2, 38, 27, 42, -12, 25, 16),
    ),
    Prototype(
        "tripod",
        "Tripod",
        (0, 11, 30, 10, 18, 21, 59, 3, 26, 17, 60, 10, 31, 21, 35, 0, 70, 48, 33, 0, 70, 48),
    ),
    Prototype(
        "platform_push",
        "",
        (-1, -16, 10, 1, 1, 10, -2, 3, 3, 1, -1, 1, 4, 3, 0, 2, 3, 2, -1, 4, 3, 3),
    ),
    Prototype(
        "lateral_pinch",
        "Lateral",
        (0, 9, 15, 7, 16, 27, 48, 1, 68, 44, 45, 0, 65, 43, 45, -2, 65, 42, 46, 1, 65, 44),
    ),
)
"""In the order of Cutkosky's figure: power before precision, prismatic before circular."""
