"""The tree filter and its smoother: what neighbours say of each other, and named faults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import msgspec
import numpy as np
import pytest

from handstudio import pipeline
from handstudio.arrays import Array
from handstudio.fusion.mechanism import FREE, Mechanism, bare
from handstudio.fusion.tree_filter import TreeFilter, TreeState
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M
from handstudio.hand_fit import fit_of, hand_mechanism, mechanism_of
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion
from handstudio.samples import Event, Gap, ImuSamples, Why
from handstudio.setup import HandModel, JointGeometry, Setup, filter_named, smoothing
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.mounting import nominal_mounting
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject
from handstudio.smoothing import Smoother

RATE_HZ = 100.0
SECONDS = 26
SETUP = Setup(
    glove(), RATE_HZ, filter=TreeFilter(), hand=HandModel(hand_length_m=ADULT_HAND_LENGTH_M)
)
NAMES = glove().names
GYR_BIAS = np.deg2rad(np.random.default_rng(4).normal(0.0, 0.8, (len(NAMES), 3)))
HAND, TIP = NAMES.index("SN11"), NAMES.index("SN17")


@lru_cache(maxsize=1)
def exact() -> tuple[ImuSamples, Array]:
    """The showcase on the ideal hand, and its truth."""
    time_us = 4_000_000 + np.arange(round(SECONDS * RATE_HZ)) * 10_000
    samples, truth = signals(ideal_subject("right"), glove(), showcase("right"), time_us)
    return samples, truth.q_world_sensor


@lru_cache(maxsize=1)
def performed() -> tuple[ImuSamples, Array]:
    """The showcase on the ideal hand, as common chips read it, with noise and biases; the truth."""
    clean, truth = exact()
    rng = np.random.default_rng(5)
    shape = clean.gyr.shape
    noisy = replace(
        clean,
        gyr=clean.gyr
        + rng.normal(0.0, np.deg2rad(0.07), shape)
        + np.deg2rad(rng.normal(0.0, 0.8, shape[1:])),
        acc=clean.acc + rng.normal(0.0, 0.015, shape) + rng.normal(0.0, 0.03, shape[1:]),
        mag=clean.mag + rng.normal(0.0, 0.4, shape),
    )
    return noisy, truth


def motion_of(events: list[Event], setup: Setup = SETUP) -> Motion:
    return pipeline.run(setup, pipeline.begin(setup), events)[0]


def errors(motion: Motion, truth: Array, rows: slice = slice(200, None)) -> Array:
    """Angles to the truth [deg], (n, s), after the heading that all have in common."""
    e = so3.multiply(truth[rows], so3.conjugate(motion.q_world_sensor[rows]))
    off = np.angle(np.mean(np.exp(1j * so3.heading(e))))
    left: Array = np.rad2deg(so3.angle_between(so3.multiply(so3.about_z(-off), e), so3.IDENTITY))
    return left


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def without_compass(samples: ImuSamples) -> ImuSamples:
    return replace(samples, fresh=np.zeros_like(samples.fresh))


# --- what it is for -------------------------------------------------------------------------------


def test_it_is_better_than_a_filter_a_sensor():
    samples, truth = performed()
    alone = msgspec.structs.replace(SETUP, filter=filter_named("vqf"))
    ours, theirs = (rms(errors(motion_of([samples], s), truth)) for s in (SETUP, alone))
    assert ours < 1.0
    assert ours < 1.2 * theirs  # an easy case: exact compasses, nothing but noise and bias


def test_headings_hold_together_without_compasses():
    """Started ten degrees apart, as nothing but gravity would leave them."""
    samples, truth = exact()
    apart = np.deg2rad(np.random.default_rng(2).normal(0.0, 10.0, len(NAMES)))
    tree, fit = TreeFilter(), fit_of(SETUP)
    places = nominal_mounting(SETUP.layout, fit.skeleton).t_segment_sensor
    joints = hand_mechanism(SETUP.layout, fit, places, np.zeros(len(NAMES)))
    joints = replace(joints, lever_sd_m=np.full(len(NAMES), 0.002))
    state = tree.begin(len(NAMES), RATE_HZ)
    for sensor, q in enumerate(so3.multiply(so3.about_z(apart), truth[0])):
        state = tree.place(state, sensor, q, np.zeros(3), float(np.deg2rad(15.0)))
    steps = np.ones(len(samples))
    blind = without_compass(samples)
    together = tree.fused(state, blind, steps, blind.valid, joints).q_world_sensor
    alone = tree.fused(state, blind, steps, blind.valid, bare(len(NAMES))).q_world_sensor
    late = slice(-300, None)
    joined = [s for s in range(len(NAMES)) if joints.parent[s] >= 0 or s in joints.parent]

    def scatter(q: Array) -> float:
        off = so3.heading(so3.multiply(truth[late], so3.conjugate(q[late])))[:, joined]
        return float(np.rad2deg(np.std(off, axis=1).mean()))

    assert scatter(alone) > 7.0
    assert scatter(together) < 3.0


def test_what_it_says_of_its_errors_holds():
    samples, truth = performed()
    motion = motion_of([samples])
    rows = slice(300, None)
    e = so3.log(so3.multiply(truth[rows], so3.conjugate(motion.q_world_sensor[rows])))
    inside = np.abs(e) < 2.0 * motion.sd_rad[rows, :, :1]
    assert inside.mean() > 0.8
    assert np.isfinite(motion.sd_rad).all()


def test_its_cost_is_a_sensors_however_many_there_are():
    """By what is computed: a sensor that nothing joins changes no digit of the others."""
    samples, _ = performed()
    few, steps = samples[:200], np.ones(200)
    tree = TreeFilter()
    alone = tree.fused(tree.begin(20, RATE_HZ), few, steps, few.valid, bare(20))
    doubled = ImuSamples(
        few.time_us,
        *(np.concatenate([getattr(few, n)] * 2, axis=1) for n in ImuSamples.__slots__[1:]),
    )
    both = tree.fused(tree.begin(40, RATE_HZ), doubled, steps, doubled.valid, bare(40))
    np.testing.assert_array_equal(both.q_world_sensor[:, :20], alone.q_world_sensor)
    np.testing.assert_array_equal(both.q_world_sensor[:, 20:], alone.q_world_sensor)


def test_nothing_happens_where_euler_angles_have_no_heading():
    """A sensor turns about y through 90 degrees and on, forth and back."""
    n = 1200
    angle = np.deg2rad(90.0) * (1.0 - np.cos(2.0 * np.pi * np.arange(n) / 400.0))
    q = so3.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)[:, None]
    rate = np.gradient(angle) * RATE_HZ
    back = so3.conjugate(q)
    flags = np.ones((n, 1), dtype=bool)
    samples = ImuSamples(
        np.arange(n) * 10_000,
        np.stack([0 * rate, rate, 0 * rate], axis=-1)[:, None],
        so3.rotate(back, np.array([0.0, 0.0, 9.80665])),
        so3.rotate(back, np.array([31.0, 0.0, -35.0])),
        flags,
        flags,
        ~flags,
    )
    tree = TreeFilter()
    out = tree.run(tree.begin(1, RATE_HZ), samples, np.ones(n), flags)[0]
    assert np.rad2deg(so3.angle_between(out[100:], q[100:]).max()) < 0.5


# --- the smoother ---------------------------------------------------------------------------------


def smoothed(events: list[Event], setup: Setup, cuts: int = 1) -> Motion:
    smoother, state, parts = Smoother(smoothing(setup)), pipeline.begin(setup), []
    for event in events:
        length = -(-len(event) // cuts) if isinstance(event, ImuSamples) else 1
        pieces = (
            [event[i : i + length] for i in range(0, len(event), length)]
            if isinstance(event, ImuSamples)
            else [event]
        )
        for piece in pieces:
            motion, state = smoother.run(state, [piece])
            parts.append(motion)
    return pipeline.join([*parts, smoother.rest()])


def test_with_the_future_in_mind_it_is_better_still():
    samples, truth = performed()
    blind = without_compass(samples)
    late = slice(1000, -500)
    causal = rms(errors(motion_of([blind]), truth, late))
    assert rms(errors(smoothed([blind], SETUP), truth, late)) < causal


def test_smoothing_gives_every_instant_once_also_over_gaps():
    samples, _ = performed()
    events: list[Event] = [samples[:900], Gap(Why.LOST, 3), samples[903:1500], samples[2100:]]
    causal, whole = motion_of(events), smoothed(events, SETUP, cuts=7)
    np.testing.assert_array_equal(whole.time_us, causal.time_us)
    np.testing.assert_array_equal(whole.doubt, causal.doubt)
    assert np.isfinite(whole.q_world_sensor).all()


def test_only_the_tree_is_smoothed():
    with pytest.raises(Exception, match="smoothed"):
        Smoother(msgspec.structs.replace(SETUP, filter=filter_named("vqf")))


# --- joints of a layout that is no hand -----------------------------------------------------------


def test_a_setup_may_say_where_a_joint_is_and_how_it_turns():
    setup = msgspec.structs.replace(
        SETUP,
        layout=msgspec.structs.replace(glove("right", ["SN1", "SN11"]), side="unknown"),
        joints=(
            JointGeometry(
                "wrist", (0.0, 0.1, 0.0), (0.0, -0.05, 0.0), 0.002, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
            ),
        ),
    )
    joints = mechanism_of(setup)
    assert joints.parent.tolist() == [-1, 0]
    assert joints.axes[1] == 2
    np.testing.assert_allclose(
        so3.rotate(joints.q_parent_joint[1], np.array([1.0, 0.0, 0.0])), [1, 0, 0]
    )
    np.testing.assert_allclose(joints.t_sensor_joint[1], [0.0, -0.05, 0.0])


def test_what_was_learnt_of_one_hands_axes_is_not_believed_of_the_next():
    """The joints as they are, after ten seconds of axes that were told wrong."""
    samples, truth = exact()
    right = mechanism_of(SETUP)
    off = so3.exp(np.random.default_rng(3).normal(0.0, np.deg2rad(10.0), (len(NAMES), 3)))
    wrong = replace(right, q_sensor_joint=so3.multiply(off, right.q_sensor_joint))
    tree, first, rest = TreeFilter(), samples[:1000], samples[1000:]
    begun = tree.begin(len(NAMES), RATE_HZ)
    misled = tree.fused(begun, first, np.ones(1000), first.valid, wrong).state
    new = tree.rejoined(misled)
    assert np.rad2deg(np.abs(misled.turn)).max() > 5.0
    assert not new.turn.any()
    np.testing.assert_array_equal(new.q, misled.q)
    np.testing.assert_array_equal(new.cov, misled.cov)

    def off_at_first(state: TreeState) -> float:
        part = rest[:200]
        q = tree.fused(state, part, np.ones(200), part.valid, right).q_world_sensor
        return rms(np.rad2deg(so3.angle_between(q, truth[1000:1200])))

    assert off_at_first(new) < off_at_first(misled)


# --- ranges of joints -----------------------------------------------------------------------------

OPEN = np.tile([-np.inf, np.inf], (len(NAMES), 2, 1))
PROXIMAL = NAMES.index("SN15")


def test_within_their_ranges_joints_tell_nothing():
    samples, _ = performed()
    joints, tree = mechanism_of(SETUP), TreeFilter()
    part, begun = samples[:800], tree.begin(len(NAMES), RATE_HZ)
    ended, open_ended = (
        tree.run(begun, part, np.ones(800), part.valid, m)[0]
        for m in (joints, replace(joints, range_rad=OPEN))
    )
    np.testing.assert_array_equal(ended, open_ended)


@pytest.mark.parametrize("degrees", [-80.0, 80.0])
def test_a_finger_that_begins_where_none_can_be_is_led_back(degrees):
    """Its heading is wrong by 80 degrees: more to the side than any finger goes. Nothing moves."""
    samples, truth = exact()
    still = without_compass(samples[:200])
    up = so3.rotate(so3.conjugate(truth[0]), np.array([0.0, 0.0, 9.80665]))
    still = replace(still, gyr=np.zeros_like(still.gyr), acc=np.tile(up, (200, 1, 1)))
    tree, joints = TreeFilter(), replace(mechanism_of(SETUP), axes=np.full(len(NAMES), FREE))
    finger = [NAMES.index(n) for n in ("SN15", "SN16", "SN17")]
    state = tree.begin(len(NAMES), RATE_HZ)
    for sensor, q in enumerate(truth[0]):
        turned = so3.multiply(so3.about_z(np.deg2rad(degrees)), q) if sensor in finger else q
        sd = np.deg2rad(40.0 if sensor in finger else 5.0)
        state = tree.place(state, sensor, turned, np.zeros(3), float(sd))

    def off(joints: Mechanism) -> float:
        q = tree.run(state, still, np.ones(200), still.valid, joints)[0][-1, PROXIMAL]
        return float(np.rad2deg(so3.angle_between(q, truth[0, PROXIMAL])))

    assert off(joints) < 50.0  # its end is at 45
    assert off(replace(joints, range_rad=OPEN)) > 75.0


# --- named faults ---------------------------------------------------------------------------------


def with_signal(samples: ImuSamples, kind: str, change: Callable[[Array], None]) -> ImuSamples:
    signal = getattr(samples, kind).copy()
    change(signal)
    return replace(samples, **{kind: signal})


def test_a_gyro_spike_turns_nothing_by_two_degrees():
    samples, truth = performed()

    def spike(gyr: Array) -> None:
        gyr[1200, TIP] = np.deg2rad([1900.0, -1900.0, 1900.0])

    motion = motion_of([with_signal(samples, "gyr", spike)])
    near = slice(1195, 1260)
    assert (
        errors(motion, truth, near)[:, TIP].max()
        < errors(motion_of([samples]), truth, near)[:, TIP].max() + 2.0
    )


def test_a_saturated_throw_is_flagged_and_found_back_within_seconds():
    samples, truth = performed()
    saturated = samples.saturated.copy()
    saturated[1200:1210, TIP] = True

    def short(gyr: Array) -> None:
        gyr[1200:1210, TIP] *= 0.4
        gyr[1200:1210, TIP] += np.deg2rad(120.0)

    motion = motion_of([with_signal(replace(samples, saturated=saturated), "gyr", short)])
    assert (motion.doubt[1200:1210, TIP] & Doubt.SATURATED).all()
    off = errors(motion, truth)[:, TIP]
    assert off[1015:1060].max() > 5.0  # it was hit hard
    assert off[-600:].max() < 6.0
    assert errors(motion, truth)[:, HAND].max() < 4.0  # neighbours that know better are not dragged


def test_a_magnet_at_the_wrist_is_not_believed():
    samples, truth = performed()

    def magnet(mag: Array) -> None:
        mag[900:1600] += so3.rotate(so3.conjugate(truth[900:1600]), np.array([-10.0, 60.0, 20.0]))

    motion = motion_of([with_signal(samples, "mag", magnet)])
    assert rms(errors(motion, truth)) < rms(errors(motion_of([samples]), truth)) + 1.0


def test_a_dead_sensor_is_carried_by_its_neighbours_and_flagged():
    samples, truth = performed()
    valid = samples.valid.copy()
    valid[1000:, TIP] = False
    motion = motion_of([replace(samples, valid=valid)])
    assert (motion.doubt[1000:, TIP] & Doubt.SILENT).all()
    others = np.delete(errors(motion, truth), TIP, axis=1)
    assert rms(others) < 1.2
    held = so3.angle_between(truth[1000:, TIP], truth[1000, TIP])
    carried = so3.angle_between(truth[1000:, TIP], motion.q_world_sensor[1000:, TIP])
    assert rms(carried) < rms(held)
    assert motion.sd_rad[-1, TIP, 0] > 5.0 * motion.sd_rad[-1, HAND, 0]


def test_two_percent_of_lost_packets_cost_little():
    samples, truth = performed()
    kept = np.random.default_rng(3).random(len(samples)) > 0.02
    edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
    events: list[Event] = [samples[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    motion = motion_of(events)
    rows = np.flatnonzero(kept)
    assert rms(errors(motion, truth[rows])) < rms(errors(motion_of([samples]), truth)) + 0.3


def test_a_cable_out_for_five_seconds_is_survived():
    samples, truth = performed()
    motion = motion_of([samples[:1000], Gap(Why.LOST, 500), samples[1500:]])
    assert np.isfinite(motion.q_world_sensor).all()
    assert (motion.doubt[1000] & Doubt.UNPLACED).all()
    rows = np.concatenate([np.arange(1000), np.arange(1500, len(samples))])
    late = slice(-400, None)
    assert rms(errors(motion, truth[rows], late)) < 4.0


def test_a_start_in_motion_is_found_within_seconds():
    samples, truth = performed()
    begun = samples[700:]
    motion = motion_of([begun])
    assert rms(errors(motion, truth[700:], slice(-400, None))) < 4.0


def test_a_board_that_slips_is_followed():
    """Its sensor truly turns by eight degrees: the filter follows it, and drags nobody along."""
    samples, truth = performed()
    n = 100
    share = np.zeros(len(samples))
    share[1200 : 1200 + n] = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))
    share[1200 + n :] = 1.0
    slip = so3.exp(np.deg2rad(8.0) * share[:, None] * np.array([0.6, 0.0, 0.8]))
    turned = so3.multiply(truth[:, TIP], slip)
    rate = so3.log(so3.multiply(so3.conjugate(slip[:-1]), slip[1:])) * RATE_HZ
    changed = replace(
        samples, gyr=samples.gyr.copy(), acc=samples.acc.copy(), mag=samples.mag.copy()
    )
    back = so3.conjugate(slip)
    changed.gyr[:, TIP] = so3.rotate(back, samples.gyr[:, TIP])
    changed.gyr[1:, TIP] += rate
    changed.acc[:, TIP] = so3.rotate(back, samples.acc[:, TIP])
    changed.mag[:, TIP] = so3.rotate(back, samples.mag[:, TIP])
    truly = truth.copy()
    truly[:, TIP] = turned
    motion = motion_of([changed])
    off = errors(motion, truly)
    assert rms(off[-500:, TIP]) < 5.0
    assert rms(np.delete(off, TIP, axis=1)) < 1.3


@pytest.mark.long
def test_ten_minutes_at_rest_turn_nothing():
    still = performed()[0][:100]
    rng = np.random.default_rng(9)
    n = 60_000
    shape = (n, len(NAMES), 3)
    long = ImuSamples(
        np.arange(n) * 10_000,
        GYR_BIAS + rng.normal(0.0, np.deg2rad(0.07), shape),
        still.acc.mean(axis=0) + rng.normal(0.0, 0.015, shape),
        still.mag.mean(axis=0) + rng.normal(0.0, 0.4, shape),
        np.zeros(shape[:2], dtype=bool),
        np.ones(shape[:2], dtype=bool),
        np.zeros(shape[:2], dtype=bool),
    )
    motion = motion_of([long])
    turned = so3.angle_between(motion.q_world_sensor[-1], motion.q_world_sensor[1000])
    assert np.rad2deg(turned.max()) < 2.0
