"""What hands do all day, without anything in them; labelled work.

Paces are ours, kept to what is known of people: a keystroke is 80 ms down and as much up, a
throw turns the fingers by some 1000 deg/s, a snap of them is the fastest thing a hand does.
"""

from __future__ import annotations

from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.reach import acted, bent, raised
from handstudio.simulation.postures import Posture, thumb
from handstudio.simulation.trajectory import Trajectory, labelled, through_stops

Steps = list[tuple[float, Posture]]

_TYPING_S = 15.0
_KEY_MM = 4.0  # how far the wrist travels between keys


def _ball_throw(actor: Actor, _: str) -> Trajectory:
    """Nine throws, the elbow on the table: cocked, whipped forward, let go, and back at ease."""
    ease = raised(actor.subject)
    ball = bent(actor.subject, 40.0, 42.0) | thumb(8.0, 35.0, 20.0, 25.0)
    held = ease | ball
    cocked = held | {"elbow_flexion": 105.0, "wrist_flexion": -40.0, "elbow_rotation": -12.0}
    # the wrist follows the elbow, and the fingers let go on the way
    half = held | bent(actor.subject, 28.0, 26.0) | {"elbow_flexion": 74.0, "wrist_flexion": -16.0}
    thrown = ease | bent(actor.subject, 26.0, 24.0) | thumb(-8.0, 20.0, 5.0, 5.0)
    thrown |= {"elbow_flexion": 34.0, "wrist_flexion": 26.0}
    through = thrown | bent(actor.subject, 34.0, 28.0)
    through |= {"elbow_flexion": 28.0, "wrist_flexion": 36.0}
    steps: Steps = []
    for _repeat in range(9):
        steps += [(0.7, held), (0.6, cocked), (0.25, cocked)]
        steps += [(0.14, half), (0.13, thrown), (0.18, through), (0.6, ease), (0.4, ease)]
    return labelled(acted(actor, "ball_throw", ease, steps, seconds=30.0), "work")


def _pouring(actor: Actor, _: str) -> Trajectory:
    """Take a bottle, lift, pour into a glass, set it upright and down."""
    upright = raised(actor.subject) | {"elbow_flexion": 15.0, "forearm_pronation": -80.0}
    open_ = upright | bent(actor.subject, 5.0, 20.0) | thumb(-5.0, 45.0, 5.0, 5.0)
    grip = upright | bent(actor.subject, 45.0, 55.0) | thumb(10.0, 45.0, 20.0, 30.0)
    up = grip | {"elbow_flexion": 38.0, "elbow_up_mm": 60.0, "wrist_deviation_ulnar": -8.0}
    tilted = up | {"forearm_pronation": -5.0, "elbow_up_mm": 110.0, "wrist_deviation_ulnar": 8.0}
    more = tilted | {"forearm_pronation": 12.0, "wrist_flexion": 10.0}
    steps: Steps = [(0.9, open_), (0.7, grip), (0.4, grip)]
    for _repeat in range(2):
        steps += [(1.0, up), (1.1, tilted), (1.2, more), (0.5, more), (0.9, up), (0.5, up)]
    steps += [(1.0, grip), (0.4, grip), (0.6, open_), (0.8, upright)]
    return labelled(acted(actor, "pouring", upright, steps), "work")


def _typing(actor: Actor, _: str) -> Trajectory:
    """Bursts of keystrokes of random fingers, the thumb for the blank, and pauses between."""
    rng = actor.rng("typing keys")
    home = raised(actor.subject) | bent(actor.subject, 25.0, 35.0)
    home |= {"elbow_flexion": 12.0, "wrist_flexion": -15.0} | thumb(-5.0, 10.0, 8.0, 5.0)
    steps: Steps = []
    spent = 0.0
    while spent < _TYPING_S:
        for _key in range(int(rng.integers(5, 14))):
            finger = FINGERS[int(rng.choice(5, p=[0.16, 0.26, 0.26, 0.18, 0.14]))]
            over, down = _key_of(actor, home, finger, rng.uniform(-6.0, 6.0), rng.uniform(0.8, 1.2))
            north, west = (float(x) for x in rng.normal(0.0, _KEY_MM, 2))
            shift = {"elbow_north_mm": north, "elbow_west_mm": west}
            steps += [(0.09, over | shift), (0.08, down | shift), (0.09, home | shift)]
            spent += 0.26
        pause = float(rng.uniform(0.3, 1.1))
        steps += [(0.25, home), (pause, home)]
        spent += 0.25 + pause
    return labelled(acted(actor, "typing", home, steps, curve=through_stops), "work")


def _key_of(
    actor: Actor, home: Posture, finger: str, aside: float, depth: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Over a key and down on it."""
    if finger == "thumb":
        over = {**home, "thumb_cmc_abduction": 6.0}
        return over, over | {"thumb_cmc_abduction": 6.0 + 9.0 * depth, "thumb_ip_flexion": 14.0}
    over = {**home, **bent(actor.subject, 19.0, 38.0, aside, [finger])}
    struck = bent(actor.subject, 19.0 + 13.0 * depth, 38.0 - 3.0 * depth, aside, [finger])
    return over, over | struck


def _tissue(actor: Actor, _: str) -> Trajectory:
    """Reach for a tissue, pull it out of the box, wipe the table, crumple it and let it fall."""
    ease = raised(actor.subject)
    reaching = ease | bent(actor.subject, 28.0, 30.0) | thumb(2.0, 22.0, 12.0, 8.0, 10.0)
    reaching |= {"elbow_flexion": 22.0, "wrist_flexion": 25.0, "elbow_north_mm": 40.0}
    pinching = reaching | bent(actor.subject, 52.0, 32.0, 3.0, ["index"])
    pinching |= bent(actor.subject, 52.0, 34.0, 3.0, ["middle"])
    pinching |= thumb(17.0, 17.0, 20.0, 8.0, 24.0)
    pulled = pinching | {"elbow_flexion": 62.0, "wrist_flexion": -22.0, "elbow_up_mm": 60.0}
    # wiping: the hand laid on the tissue, the arm swung to and fro on the table
    laid = ease | bent(actor.subject, 16.0, 22.0) | thumb(5.0, 18.0, 12.0, 12.0)
    laid |= {"elbow_flexion": 15.0, "wrist_flexion": -2.0}
    here = laid | {"elbow_rotation": 16.0, "elbow_north_mm": 25.0, "wrist_deviation_ulnar": 8.0}
    there = laid | {"elbow_rotation": -16.0, "elbow_north_mm": -15.0, "wrist_deviation_ulnar": -8.0}
    turned = pulled | {"forearm_pronation": -70.0, "wrist_flexion": 0.0}
    loose = turned | bent(actor.subject, 45.0, 55.0) | thumb(10.0, 30.0, 25.0, 25.0, 15.0)
    tight = turned | bent(actor.subject, 78.0, 92.0) | thumb(12.0, 22.0, 42.0, 48.0, 10.0)
    rolled = turned | bent(actor.subject, 62.0, 84.0) | thumb(20.0, 30.0, 30.0, 30.0, 18.0)
    open_ = turned | bent(actor.subject, 5.0, 8.0) | thumb(-10.0, 20.0, 0.0, 0.0)
    steps: Steps = [(0.9, reaching), (0.4, pinching), (0.2, pinching), (0.35, pulled)]
    steps += [(0.3, pulled), (0.8, laid)]
    steps += [step for _ in range(6) for step in ((0.42, here), (0.42, there))]
    steps += [(0.4, laid), (0.6, turned)]
    for _repeat in range(4):
        steps += [(0.28, loose), (0.3, tight), (0.25, rolled), (0.25, tight)]
    steps += [(0.3, tight), (0.3, open_), (0.4, open_), (1.0, ease)]
    return labelled(acted(actor, "tissue", ease, steps), "work")


def _spinning_top(actor: Actor, _: str) -> Trajectory:
    """Take a top by its stem, wind up slowly, snap, and spread the fingers out of its way."""
    ease = raised(actor.subject)
    low = ease | {"elbow_flexion": 20.0, "wrist_flexion": 20.0}
    low |= bent(actor.subject, 60.0, 70.0, fingers=["ring", "little"])
    low |= bent(actor.subject, 40.0, 40.0, fingers=["index", "middle"])
    taken = low | bent(actor.subject, 52.0, 30.0, 4.0, ["index"])
    taken |= bent(actor.subject, 56.0, 32.0, 6.0, ["middle"]) | thumb(17.0, 16.0, 20.0, 8.0, 24.0)
    wound = taken | bent(actor.subject, 34.0, 14.0, 4.0, ["index"])
    wound |= bent(actor.subject, 38.0, 16.0, 6.0, ["middle"]) | thumb(22.0, 16.0, 38.0, 32.0, 28.0)
    # thumb and fingers pass one another: the thumb straightens, the fingers bend
    snapped = taken | bent(actor.subject, 66.0, 62.0, 4.0, ["index"])
    snapped |= bent(actor.subject, 68.0, 60.0, 4.0, ["middle"]) | thumb(2.0, 14.0, 6.0, -8.0, 12.0)
    away = low | bent(actor.subject, 10.0, 15.0, 6.0) | thumb(-10.0, 18.0, 0.0, -5.0)
    away |= {"elbow_up_mm": 30.0}
    steps: Steps = []
    for _repeat in range(3):
        steps += [(0.9, taken), (0.3, taken), (0.5, wound), (0.15, wound), (0.1, snapped)]
        steps += [(0.05, snapped), (0.3, away), (1.0, away)]
    return labelled(acted(actor, "spinning_top", ease, [*steps, (0.8, ease)]), "work")


CHORES = (
    Motion("ball_throw", "Nine throws from the elbow, thirty seconds", _ball_throw),
    Motion("pouring", "A bottle is lifted, poured from twice and set down", _pouring),
    Motion("typing", "Bursts of keystrokes", _typing),
    Motion("tissue", "A tissue is pulled out, wiped with and crumpled", _tissue),
    Motion("spinning_top", "A top is spun by thumb and fingers, three times", _spinning_top),
)
