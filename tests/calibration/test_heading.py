"""Headings: exact where sensors are, equal to the thesis's, and safe from any one sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.analysis.hand_error import heading_scatter
from handstudio.calibration.attitude import attitude
from handstudio.calibration.heading import HeadingAlignment, align, at_peak
from handstudio.calibration.heading_fit import CALIBRATED
from handstudio.calibration.level_headings import compass_headings, robust_mean, shared_headings
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.simulation.imperfections.strengths import IDEAL, Imperfections, parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear

RATE_HZ = 100
NAMES = glove().names
FIELD = np.array([31.0, 0.0, -35.0])


def performed(
    what: Imperfections, seed: int = 3, motion: str = "quick_start"
) -> tuple[ImuSamples, np.ndarray]:
    """A virtual person's quick start, and the true attitudes."""
    someone = subject(seed)
    way = perform(motion, Actor(someone, seed))
    worn = wear(someone, glove(), what, seed)
    time_us = np.arange(round(way.duration_s * RATE_HZ)) * 10_000
    sensed, _ = sense(worn, begin(worn), way, time_us, RATE_HZ)
    return sensed.samples, sensed.truth.q_world_sensor


@pytest.fixture(scope="module")
def ideal() -> tuple[ImuSamples, np.ndarray]:
    return performed(IDEAL)


@pytest.fixture(scope="module")
def typical() -> tuple[ImuSamples, np.ndarray]:
    return performed(parse("typical"))


def parts(samples: ImuSamples) -> tuple[ImuSamples, ImuSamples, ImuSamples]:
    return samples[:200], samples[200:400], samples[400:600]


def aligned(samples: ImuSamples, **how: object) -> HeadingAlignment:
    return align(*parts(samples), NAMES, **how)  # type: ignore[arg-type]


def scatter_deg(samples: ImuSamples, true: np.ndarray, psi: np.ndarray) -> float:
    """Over sensors, of headings put on what accelerometers and compasses say."""
    rest = samples[:200]
    q = attitude(rest.acc.mean(axis=0), rest.mag.mean(axis=0))
    turned = so3.multiply(so3.about_z(psi), q)
    return float(np.rad2deg(heading_scatter(true[199:200], turned[None])))


def apart_deg(one: object, other: object, but: int = -1) -> float:
    """Most that headings differ by, what all share taken out."""
    off = (
        np.delete(np.asarray(one) - np.asarray(other), but)
        if but >= 0
        else (np.asarray(one) - np.asarray(other))
    )
    off = np.angle(np.exp(1j * (off - off[0])))
    return float(np.rad2deg(np.abs(off - np.median(off)).max()))


def changed(samples: ImuSamples, sensor: int, **arrays: np.ndarray) -> ImuSamples:
    made = {}
    for name, values in arrays.items():
        made[name] = getattr(samples, name).copy()
        made[name][:, sensor] = values
    return replace(samples, **made)


def turned(rate: np.ndarray, loose: np.ndarray | None = None, s: int = 5) -> ImuSamples:
    """Sensors at one place that turn with a rate in the world [rad/s]; some with one more."""
    rng = np.random.default_rng(2)
    start = so3.normalize(rng.standard_normal((s, 4)))
    n = len(rate)
    q, gyr, acc, mag = np.tile(start, (1, 1)), [], [], []
    for k in range(n):
        world = np.tile(rate[k], (s, 1))
        if loose is not None:
            world[: s // 2] += loose[k]
        q = so3.multiply(so3.exp(world * 0.01), q)
        back = so3.conjugate(q)
        gyr.append(so3.rotate(back, world))
        acc.append(so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY])))
        mag.append(so3.rotate(back, FIELD))
    yes = np.ones((n, s), dtype=bool)
    return ImuSamples(
        np.arange(n) * 10_000, np.stack(gyr), np.stack(acc), np.stack(mag), yes, yes, ~yes
    )


def there_and_back(axis: object, deg: float) -> np.ndarray:
    """Rates of a rest, a turn of so much and back, a rest, 2 s each [rad/s]."""
    pulse = 0.5 * np.pi * np.sin(np.pi * (np.arange(100) + 0.5) / 100)
    profile = np.concatenate([np.zeros(200), pulse, -pulse, np.zeros(200)])
    unit = np.asarray(axis, dtype=float)
    return np.deg2rad(deg) * profile[:, None] * unit / np.linalg.norm(unit)


def of_rates(rate: np.ndarray, loose: np.ndarray | None = None) -> HeadingAlignment:
    samples = turned(rate, loose)
    return align(*parts(samples), [f"S{i}" for i in range(5)])


def test_perfect_sensors_are_aligned_within_a_twentieth_of_a_degree(ideal):
    samples, true = ideal
    found = aligned(samples)
    assert scatter_deg(samples, true, np.array(found.psi_cor)) < 0.05
    assert found.verdict.ok
    assert not any(found.outlying)
    assert 30.0 < np.rad2deg(found.turn) < 80.0


def test_with_perfect_sensors_one_sample_of_the_thesis_says_the_same(ideal):
    samples, _ = ideal
    before, turning, _ = parts(samples)
    psi_cor, psi_wg = at_peak(before, turning)
    found = aligned(samples)
    assert apart_deg(found.psi_cor, psi_cor) < 0.05
    np.testing.assert_allclose(found.psi_wg, psi_wg, atol=np.deg2rad(0.05))


@given(st.integers(0, 1000))
def test_least_squares_of_one_shared_sample_are_the_thesis_headings(seed):
    rng = np.random.default_rng(seed)
    headings = rng.uniform(-np.pi, np.pi, 6)
    shared = np.array([1.0, 0.3, 0.2])
    rate = so3.rotate(so3.about_z(-headings), shared)[None]
    psi = shared_headings(rate, np.ones((1, 6)))
    psi_wg = -np.arctan2(rate[0, :, 0], -rate[0, :, 1])
    assert apart_deg(psi, psi_wg) < 1e-9
    assert apart_deg(psi, headings) < 1e-9


def test_without_a_compass_x_is_level_and_square_to_the_axis(ideal):
    samples, _ = ideal
    found = aligned(samples, compass=False)
    assert found.psi_cor == found.psi_wg
    level = attitude(samples[:200].acc.mean(axis=0))
    rate = so3.rotate(found.aligned(level), samples.gyr[240])  # lifting
    across = np.cross([0.0, 0.0, 1.0], rate)
    np.testing.assert_allclose(np.abs(across[:, 1] / np.linalg.norm(across, axis=-1)), 0, atol=0.02)


def test_the_common_heading_remains_the_compasses(typical):
    samples, _ = typical
    found = aligned(samples)
    after = np.array(found.psi_cor)
    assert abs(robust_mean(after)) < np.deg2rad(2.0)
    assert np.isfinite(compass_headings(samples[:200])).all()


def test_typical_sensors_are_aligned_within_half_a_degree_and_know_how_well(typical):
    samples, true = typical
    found = aligned(samples)
    before, turning, _ = parts(samples)
    ours = scatter_deg(samples, true, np.array(found.psi_cor))
    assert ours < 0.45
    assert ours < scatter_deg(samples, true, at_peak(before, turning)[0])
    assert ours < 2.0 * np.rad2deg(np.median(found.sd))
    assert found.verdict.ok, found.verdict.failing


def test_calibrated_sensors_are_aligned_within_a_fifth_of_a_degree():
    samples, true = performed(parse("typical,scale=0,misalignment=0"))
    found = aligned(samples, tolerances=CALIBRATED)
    assert scatter_deg(samples, true, np.array(found.psi_cor)) < 0.2


@pytest.mark.parametrize("fault", ["silent", "stuck", "loose", "half"])
def test_one_bad_sensor_is_marked_and_moves_no_other_heading(typical, fault):
    samples, _ = typical
    bad, n = 12, len(samples)
    time_s = samples.time_us * 1e-6
    swing = np.deg2rad(60.0) * np.sin(2.0 * np.pi * 1.5 * time_s) * (time_s > 2.0)
    broken = {
        "silent": lambda: changed(
            samples, bad, valid=np.zeros(n, dtype=bool), gyr=np.zeros((n, 3)), acc=np.zeros((n, 3))
        ),
        "stuck": lambda: changed(samples, bad, gyr=samples.gyr[0, bad], acc=samples.acc[0, bad]),
        "loose": lambda: changed(
            samples, bad, gyr=samples.gyr[:, bad] + swing[:, None] * [0.3, 0.5, 0.8]
        ),
        "half": lambda: changed(samples, bad, gyr=0.5 * samples.gyr[:, bad]),
    }[fault]()
    found, sound = aligned(broken), aligned(samples)
    assert found.outlying[bad]
    assert sum(found.outlying) == 1
    assert apart_deg(found.psi_cor, sound.psi_cor, bad) < 0.1
    if fault != "silent":
        assert NAMES[bad] in {reading.about for reading in found.verdict.failing}
    else:
        assert found.psi_cor[bad] == 0.0
        assert found.sd[bad] == np.inf


def test_one_wrong_compass_changes_neither_order_nor_much_of_the_common_heading(typical):
    samples, _ = typical
    wrong = changed(samples, 4, mag=np.array([-40.0, 20.0, 10.0]))
    found, sound = aligned(wrong), aligned(samples)
    assert apart_deg(found.psi_wg, sound.psi_wg) < 1e-9
    off = np.delete(np.array(found.psi_cor) - np.array(sound.psi_cor), 4)
    assert np.rad2deg(np.abs(off).max()) < 1.5


def test_a_turn_about_the_vertical_is_refused():
    with pytest.raises(CalibrationError, match="from level"):
        of_rates(there_and_back([0.1, 0.0, 1.0], 60.0))


def test_a_turn_of_ten_degrees_is_refused():
    with pytest.raises(CalibrationError, match="turned by 10 deg"):
        of_rates(there_and_back([1.0, 0.2, 0.0], 10.0))


def test_a_turn_of_twenty_degrees_is_used_but_found_too_small():
    found = of_rates(there_and_back([1.0, 0.2, 0.0], 20.0))
    assert [reading.what for reading in found.verdict.failing] == ["turn"]


def test_an_arm_that_is_not_still_before_is_refused():
    rate = there_and_back([1.0, 0.2, 0.0], 60.0)
    rate[:200] += np.deg2rad(20.0) * np.sin(0.3 * np.arange(200))[:, None] * [0.6, 0.0, 0.8]
    with pytest.raises(CalibrationError, match="did not rest"):
        of_rates(rate)


def test_a_steady_spin_is_no_rest():
    rate = there_and_back([1.0, 0.2, 0.0], 60.0)
    rate[:200] = np.deg2rad([0.0, 0.0, 30.0])
    with pytest.raises(CalibrationError, match="did not rest"):
        of_rates(rate)


def test_sensors_that_move_against_one_another_show_in_the_verdict():
    rate = there_and_back([1.0, 0.2, 0.0], 60.0)
    found = of_rates(rate, there_and_back([0.3, 1.0, 0.0], 12.0))
    assert "together" in {reading.what for reading in found.verdict.failing}


def test_sensors_of_which_most_have_no_compass_take_the_heading_of_the_rest(typical):
    samples, true = typical
    mag = samples.mag.copy()
    mag[:, 3:] = np.nan
    found = aligned(replace(samples, mag=mag))
    level = attitude(samples[:200].acc.mean(axis=0), mag[:200].mean(axis=0))
    q = found.aligned(level)
    assert np.rad2deg(heading_scatter(true[199:200], q[None])) < 0.45


def test_no_compass_at_all_is_said(typical):
    samples, _ = typical
    without = replace(samples, mag=np.full_like(samples.mag, np.nan))
    with pytest.raises(CalibrationError, match="No compass"):
        aligned(without)
    assert aligned(without, compass=False).verdict.ok


def test_without_the_rest_after_it_works_too(typical):
    samples, true = typical
    before, turning, _ = parts(samples)
    found = align(before, turning, None, NAMES)
    assert scatter_deg(samples, true, np.array(found.psi_cor)) < 0.5


@settings(max_examples=30)
@given(st.floats(-10.0, 10.0), st.integers(0, 100))
def test_the_robust_mean_turns_with_its_angles(offset, seed):
    angles = np.random.default_rng(seed).normal(0.0, 0.1, 9)
    off = robust_mean(angles + offset) - robust_mean(angles) - offset
    assert abs(np.angle(np.exp(1j * off))) < 1e-9
