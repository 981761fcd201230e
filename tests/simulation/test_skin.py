"""Sensors on skin: exact derivatives, oscillators against an integrator, stated sizes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from handstudio.hand.skeleton import SEGMENTS, nominal_skeleton
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.simulation.imperfections.strengths import Imperfections, parse
from handstudio.simulation.mounting import Mounting, nominal_mounting, segment_indices
from handstudio.simulation.moving import Moving
from handstudio.simulation.postures import channels
from handstudio.simulation.skin import (
    DAMPING,
    LAG_AT_ELBOW,
    SLIDE_M_RAD,
    SLIP_DEG,
    SLIP_M,
    TILT_RAD_M,
    WOBBLE_ELSEWHERE_HZ,
    on_skin,
    settled,
    skin_of,
    turned_by,
)
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import CHANNELS, JointMotion, held, through_stops
from handstudio.simulation.worn import Sensed, begin, sense, wear

STEP_US = 1000
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])

sides = pytest.mark.parametrize("side", ["right", "left"])


def differences(values: np.ndarray, stencil: np.ndarray, order: int) -> np.ndarray:
    n = len(values) - 8
    return sum(c * values[k : k + n] for k, c in enumerate(stencil)) / (STEP_US * 1e-6) ** order


def moved(what: str, side: str = "right") -> Sensed:
    """A stretch of one smooth, fast movement of all joints, while the board slips."""
    postures = np.random.default_rng(2).uniform(-1.2, 1.2, size=(4, CHANNELS))
    postures[0] = 0.0
    postures[:, -3:-1] = 0.0  # the elbow goes up and down only, the same on both sides
    if side == "left":
        postures[:, :-3].reshape(4, -1, 3)[..., 1:] *= -1.0
    worn = wear(subject(3, side), glove(side), parse(what), 5)
    worn = replace(worn, skin=replace(worn.skin, slip_start_s=0.4))
    motion = through_stops(np.array([0.0, 0.6, 1.2, 1.8]), postures)
    _, state = sense(worn, begin(worn), motion, np.arange(0, 610_000, STEP_US), 1000)
    return sense(worn, state, motion, np.arange(610_000, 1_190_000, STEP_US), 1000)[0]


def test_a_rotation_vector_turns_a_frame_exactly():
    rng = np.random.default_rng(1)
    t = np.arange(-20, 21)[:, None, None] * STEP_US * 1e-6
    r0, r1, r2 = rng.normal(size=(3, 50, 3)) * np.array([0.6, 4.0, 60.0])[:, None, None]
    r0[:5] *= 1e-9
    r = r0 + r1 * t + 0.5 * r2 * t**2
    frames = turned_by(r, r1 + r2 * t, np.broadcast_to(r2, r.shape))
    assert np.linalg.norm(r, axis=-1).max() > 1.5
    np.testing.assert_allclose(frames.q, so3.exp(r), atol=1e-15)
    rate = so3.multiply(differences(frames.q, FIRST, 1), so3.conjugate(frames.q[4:-4]))
    np.testing.assert_allclose(2.0 * rate[..., 1:], frames.omega[4:-4], atol=1e-9)
    alpha = differences(frames.omega, FIRST, 1)
    np.testing.assert_allclose(alpha, frames.alpha[4:-4], rtol=1e-9, atol=1e-8)


def test_large_rotations_are_exact_too():
    r = so3.log(so3.normalize(np.random.default_rng(2).normal(size=(200, 4))))
    dr = np.random.default_rng(3).normal(size=r.shape)
    step = 1e-5
    omega = turned_by(r, dr, np.zeros_like(r)).omega
    turned = so3.multiply(so3.exp(r + step * dr), so3.conjugate(so3.exp(r - step * dr)))
    np.testing.assert_allclose(omega, so3.log(turned) / (2.0 * step), atol=1e-8)


@sides
@pytest.mark.parametrize("what", ["slide", "rock", "board_slip", "slide,rock,board_slip,mounting"])
def test_what_sensors_on_skin_read_is_how_they_truly_move(what, side):
    sensed = moved(what, side)
    assert_consistent(sensed, 1e-7)


@sides
def test_wobbling_sensors_read_how_they_truly_move(side):
    """Drive and its slope jump at instants: differences there are less exact than elsewhere."""
    sensed = moved("soft_tissue,board_slip,mounting", side)
    rigid = moved("mounting", side)
    assert np.abs(sensed.samples.acc - rigid.samples.acc).max() > 3.0
    assert_consistent(sensed, 2e-3)


def assert_consistent(sensed: Sensed, tolerance: float) -> None:
    truth, samples = sensed.truth, sensed.samples
    q_sensor_world = so3.conjugate(truth.q_world_sensor[4:-4])
    rate = so3.multiply(q_sensor_world, differences(truth.q_world_sensor, FIRST, 1))
    gyr = 2.0 * rate[..., 1:]
    assert np.abs(samples.gyr[4:-4] - gyr).max() < tolerance * np.abs(gyr).max()
    lift = differences(truth.t_world_sensor, SECOND, 2)
    lift[..., 2] += sensed.worn.world.gravity_mps2
    acc = so3.rotate(q_sensor_world, lift)
    felt = np.abs(acc - [0.0, 0.0, 9.8]).max()
    assert np.abs(samples.acc[4:-4] - acc).max() < tolerance * felt


def test_a_wobble_is_what_an_integrator_makes_of_a_straight_drive():
    layout, skeleton = glove(sensors=["SN1", "SN16"]), nominal_skeleton("right")
    nominal = nominal_mounting(layout, skeleton)
    flat = nominal.t_segment_sensor * [1.0, 1.0, 0.0]
    on = tuple(segment_indices(layout))
    mounting = Mounting(nominal.q_segment_sensor, flat)
    skin = skin_of(Imperfections(wobble=2.0), skeleton, mounting, on, seed=4)
    rng = np.random.default_rng(5)
    time_s = np.cumsum(rng.uniform(0.0005, 0.02, 60))
    pushed = rng.normal(0.0, 10.0, (60, 2, 3))
    frames = segments_that_are_pushed(pushed)
    sensors, _ = on_skin(skin, settled(skin), time_s, joints_at_rest(60), frames)
    displaced = sensors.t - flat

    for sensor, pole in enumerate(skin.poles):
        for axis, give in enumerate((2.0, 2.0, 0.6)):

            def slope(t, y, push=-give * pushed[:, sensor, axis], pole=pole):
                drive = np.interp(t, time_s, push)
                return [y[1], drive + 2.0 * pole.real * y[1] - abs(pole) ** 2 * y[0]]

            y = [0.0, 0.0]
            for i in range(59):  # from knee to knee of the drive
                span = (time_s[i], time_s[i + 1])
                y = solve_ivp(slope, span, y, rtol=1e-10, atol=1e-13).y[:, -1]
                assert displaced[i + 1, sensor, axis] == pytest.approx(y[0], abs=1e-9)
                assert sensors.v[i + 1, sensor, axis] == pytest.approx(y[1], abs=1e-7)


def test_a_wobble_rings_down_at_its_own_frequency_and_tilts_the_board():
    layout, skeleton = glove(sensors=["SN16"]), nominal_skeleton("right")
    mounting = nominal_mounting(layout, skeleton)
    on = tuple(segment_indices(layout))
    skin = skin_of(Imperfections(wobble=1.0), skeleton, mounting, on, seed=4)
    pushed = np.zeros((2000, 1, 3))
    pushed[1:3, 0, 1] = 20.0
    time_s = np.arange(2000) * 1e-4
    sensors, _ = on_skin(
        skin, settled(skin), time_s, joints_at_rest(2000), segments_that_are_pushed(pushed)
    )
    pole = skin.poles[0]
    assert abs(pole) / (2.0 * np.pi) == pytest.approx(WOBBLE_ELSEWHERE_HZ, rel=0.4)
    assert -pole.real / abs(pole) == pytest.approx(DAMPING)
    tilt = so3.log(sensors.q)[:, 0]
    # after the push: y goes as exp(-a t) sin(w t), and half a turn later it is mirrored
    half = round(np.pi / pole.imag / 1e-4)
    expected = -np.exp(pole.real * half * 1e-4) * tilt[100, 0]
    assert tilt[100 + half, 0] == pytest.approx(expected, rel=0.02)
    assert np.abs(tilt[:, 1:]).max() < 1e-12
    along = sensors.t[:, 0, 1] - mounting.t_segment_sensor[0, 1]
    height = mounting.t_segment_sensor[0, 2]
    np.testing.assert_allclose(tilt[:, 0], -TILT_RAD_M * (along + height * tilt[:, 0]), atol=1e-8)


def segments_that_are_pushed(a: np.ndarray) -> Moving:
    """Frames that do not turn and stay about where they are."""
    zero = np.zeros_like(a)
    q = np.broadcast_to(so3.IDENTITY, (*a.shape[:-1], 4))
    return Moving(q, zero, zero, zero, zero, a)


def joints_at_rest(n: int) -> JointMotion:
    zero = np.zeros((n, len(SEGMENTS), 3))
    return JointMotion(zero, zero, zero, (zero[:, 0], zero[:, 0], zero[:, 0]))


def displaced(what: str, posture: dict[str, float], side: str = "right", seed: int = 5):
    """Tilt [rad] and shift [m] of every sensor on its segment in a held posture."""
    someone = subject(3, side)
    worn = wear(someone, glove(side), parse(what), seed)
    sensed, _ = sense(worn, begin(worn), held(channels(posture, side), 1.0), np.arange(1), 100)
    on = list(worn.skin.on)
    q_segment_world = so3.conjugate(sensed.segments.q[0, on])
    place = so3.rotate(q_segment_world, sensed.sensors.t[0] - sensed.segments.t[0, on])
    nominal = nominal_mounting(worn.layout, someone.skeleton)
    return (
        so3.log(so3.multiply(q_segment_world, sensed.sensors.q[0])),
        place - nominal.t_segment_sensor,
    )


@sides
def test_skin_is_drawn_towards_a_bent_joint(side):
    bent = {"index_pip_flexion": 90.0}
    slides = [displaced("slide", bent, side, seed)[1] for seed in range(30)]
    mean = np.mean(slides, axis=0)
    names = glove(side).names
    expected = SLIDE_M_RAD * np.deg2rad(90.0)
    assert mean[names.index("SN16"), 1] == pytest.approx(-expected, rel=0.25)
    assert mean[names.index("SN15"), 1] == pytest.approx(expected, rel=0.25)
    others = [i for i, name in enumerate(names) if name not in ("SN15", "SN16")]
    np.testing.assert_allclose(mean[others], 0.0, atol=1e-15)


@sides
def test_the_skin_of_the_forearm_lags_behind_its_rotation(side):
    tilts = [displaced("slide", {"forearm_pronation": -90.0}, side, seed)[0] for seed in range(30)]
    lag = np.rad2deg(np.mean(tilts, axis=0)[:3, 1])
    # supination turns a right forearm about +y; the skin stays behind, less so near the wrist
    sign = -1.0 if side == "right" else 1.0
    expected = sign * LAG_AT_ELBOW * 90.0 * np.array([0.30, 0.22, 0.14])
    np.testing.assert_allclose(lag, expected, rtol=0.25)
    assert (np.abs(tilts)[:, 3:] < 1e-12).all()


@pytest.mark.long
def test_boards_pitch_as_joints_bend():
    postures = {f"{finger}_pip_flexion": 45.0 for finger in ("index", "middle", "ring", "little")}
    tilts = np.array([displaced("rock", postures, seed=seed)[0] for seed in range(40)])
    names = glove().names
    fingers = [names.index(f"SN{n}") for n in (5, 6, 8, 9, 12, 13, 15, 16)]
    pitch = np.rad2deg(tilts[:, fingers, 0])
    assert pitch.std() == pytest.approx(1.2, rel=4.0 / np.sqrt(2 * pitch.size))
    assert abs(pitch.mean()) < 4.0 * 1.2 / np.sqrt(pitch.size)
    assert np.abs(tilts[..., 1:]).max() < 1e-12


@pytest.mark.long
def test_a_pip_angle_errs_as_skin_markers_do_against_tomography():
    """Half and full fists, as Metcalf et al. took them: an RMS error below 4 degrees."""
    names, errors = glove().names, []
    for mcp, pip, dip in ((45.0, 45.0, 30.0), (85.0, 95.0, 65.0)):
        fist = {}
        for finger in ("index", "middle", "ring", "little"):
            fist[f"{finger}_mcp_flexion"], fist[f"{finger}_pip_flexion"] = mcp, pip
            fist[f"{finger}_dip_flexion"] = dip
        tilts = np.array([displaced("rock", fist, seed=seed)[0] for seed in range(40)])
        for proximal, distal in (("SN15", "SN16"), ("SN12", "SN13"), ("SN8", "SN9")):
            pair = tilts[:, [names.index(proximal), names.index(distal)], 0]
            errors.append(np.rad2deg(pair[:, 1] - pair[:, 0]))
    assert 3.0 < np.sqrt(np.mean(np.square(errors))) < 4.0


def test_a_board_slips_once_and_stays():
    shifts, tilts = [], []
    for seed in range(20):
        worn = wear(subject(3), glove(), Imperfections(board_slip=1.0), seed)
        assert 10.0 <= worn.skin.slip_start_s <= 40.0
        start_us = int(worn.skin.slip_start_s * 1e6)
        time_us = np.array([0, start_us - 1000, start_us + 1_001_000, 300_000_000])
        rest = held(channels({}, "right"), 1.0)
        sensed, _ = sense(worn, begin(worn), rest, time_us, 100)
        q, t = sensed.truth.q_world_sensor, sensed.truth.t_world_sensor
        np.testing.assert_array_equal(q[1], q[0])
        np.testing.assert_array_equal(t[3], t[2])
        tilts.append(np.rad2deg(so3.log(so3.multiply(so3.conjugate(q[0]), q[3]))))
        shifts.append(worn.skin.slip_shift)
    assert np.std(tilts) == pytest.approx(SLIP_DEG, rel=4.0 / np.sqrt(2 * np.size(tilts)))
    assert np.std(shifts) == pytest.approx(SLIP_M, rel=4.0 / np.sqrt(2 * np.size(shifts)))


def test_a_left_hand_wobbles_as_the_mirror_image_of_a_right_one():
    what = "soft_tissue,board_slip,mounting"
    right, left = (moved(what, side).samples for side in ("right", "left"))
    np.testing.assert_allclose(left.acc, right.acc * [-1.0, 1.0, 1.0], atol=1e-8)
    np.testing.assert_allclose(left.gyr, right.gyr * [1.0, -1.0, -1.0], atol=1e-9)


def test_without_soft_tissue_and_slip_a_sensor_is_fixed_to_its_segment():
    assert wear(subject(3), glove(), Imperfections(mounting=1.0), 5).skin.is_rigid
    for name in ("slide", "rock", "wobble", "board_slip"):
        assert not wear(subject(3), glove(), Imperfections(**{name: 0.1}), 5).skin.is_rigid
