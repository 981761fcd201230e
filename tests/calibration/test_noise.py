"""Noise that was put in comes back within what is said of it; where there is none, none is seen."""

from dataclasses import replace

import allantools
import numpy as np
import pytest

from handstudio.calibration.allan import fitted, mean_of, plan_of
from handstudio.calibration.noise import LEAST_S, Noise, StaticRecording, noise_of
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.subject import ideal_subject
from handstudio.simulation.trajectory import CHANNELS, held
from handstudio.simulation.worn import begin, sense, wear

DEG, G = np.pi / 180.0, 9.80665
GYR = (6.5e-3 * DEG, 2.5e-4 * DEG)
ACC = (1.15e-4 * G, 4.5e-6 * G)


def recording(seconds, sensors=1, rate_hz=20.0, *, gyr=GYR, acc=ACC, seed=0) -> StaticRecording:
    """White noise of density Q and a walk of density K on biases: the model itself."""
    rng, n = np.random.default_rng(seed), int(seconds * rate_hz)

    def noisy(q, k):
        white, steps = rng.standard_normal((2, n, sensors, 3))
        return q * np.sqrt(rate_hz) * white + np.cumsum(k / np.sqrt(rate_hz) * steps, axis=0)

    up = np.array([0.0, 0.0, G])
    return StaticRecording(np.arange(n) / rate_hz, noisy(*gyr) + 0.02, noisy(*acc) + up, rate_hz)


def names(sensors: int) -> list[str]:
    return [f"SN{number}" for number in range(1, sensors + 1)]


def axes(found: Noise, kind: str):
    return [axis for sensor in found.sensors for axis in getattr(sensor, kind)]


def coverage(densities, true: float) -> float:
    return float(np.mean([each.low <= true <= each.high for each in densities]))


@pytest.fixture(scope="module")
def many() -> Noise:
    """180 gyroscope and 180 accelerometer axes, half an hour."""
    return noise_of([recording(1800.0, 60, 10.0)], names(60))


def test_what_was_put_in_lies_within_the_interval_19_times_in_20(many):
    for kind, (q, k) in (("gyr", GYR), ("acc", ACC)):
        for density, true in (("white", q), ("walk", k)):
            found = [getattr(axis, density) for axis in axes(many, kind)]
            assert 0.90 <= coverage(found, true) <= 0.99  # 180 of them: three standard deviations
            assert np.mean([each.value for each in found]) == pytest.approx(true, rel=0.06)
            outside = [true < each.low for each in found], [true > each.high for each in found]
            assert np.mean(outside, axis=1).max() < 0.06  # on either side


def test_the_two_lines_are_all_there_is_and_intervals_are_narrow(many):
    misfits = [axis.misfit for kind in ("gyr", "acc") for axis in axes(many, kind)]
    assert np.mean(misfits) == pytest.approx(1.0, abs=0.1)
    axis = many.sensors[0].gyr[0]
    assert axis.white.high / axis.white.low < 1.03
    assert axis.walk.high / axis.walk.low < 3.5
    assert many.durations_s == (1800.0,)
    assert axis.tau_s[-1] == pytest.approx(409.6)


def test_an_absent_walk_is_not_distinct_and_its_bound_holds():
    found = noise_of(
        [recording(1200.0, 30, 10.0, gyr=(GYR[0], 0.0), acc=(ACC[0], 0.1 * ACC[1]))], names(30)
    )
    for kind, true in (("gyr", 0.0), ("acc", 0.1 * ACC[1])):
        walks = [axis.walk for axis in axes(found, kind)]
        assert coverage(walks, true) >= 0.9
        assert all(walk.low == 0.0 for walk in walks if not walk.distinct)
    # of chance 2.5 %, and 3.6 % are found of thousands; of 90 axes, up to three deviations more
    assert np.mean([axis.walk.distinct for axis in axes(found, "gyr")]) < 0.10
    assert coverage([axis.white for axis in axes(found, "gyr")], GYR[0]) >= 0.88


def test_a_walk_that_never_rises_above_the_white_noise_is_not_distinct():
    """Beyond chance, after hours, but no slope of +1/2: the curve is still falling at its end."""
    plan = plan_of((144_000,), 2.0)
    tau = (plan.m / plan.rate_hz)[plan.first :]
    white, walk, _ = fitted(tau, 1.0 / tau + 1e-9 * tau / 3.0, plan)
    assert (white.distinct, walk.distinct, walk.low) == (True, False, 0.0)
    _, walk, _ = fitted(tau, 1.0 / tau + 1e-6 * tau / 3.0, plan)
    assert walk.distinct
    assert walk.value == pytest.approx(1e-3)


def test_degrees_of_freedom_are_those_of_allantools():
    """Two ways to one number: our covariance of the variances, and Greenhall's approximation."""
    n = 36_000
    plan = plan_of((n,), 10.0)
    tau = plan.m / plan.rate_hz
    for alpha, expected, covariance in (
        (0, 1.0 / tau, plan.white),
        (-2, tau / 3.0, plan.walk),
    ):
        freedom = 2.0 * expected[3:] ** 2 / np.diag(covariance)[3:]
        theirs = [
            allantools.edf_greenhall(alpha, 2, int(m), n + 1, overlapping=True) for m in plan.m[3:]
        ]
        np.testing.assert_allclose(freedom, theirs, rtol=0.12)
        np.testing.assert_allclose(freedom[4:], theirs[4:], rtol=0.02)


def test_several_recordings_are_narrower_than_one():
    parts = [recording(900.0, 4, seed=seed) for seed in range(4)]
    one, all_of_them = noise_of(parts[:1], names(4)), noise_of(parts, names(4))

    def width(found):
        return np.mean([axis.walk.high - axis.walk.low for axis in axes(found, "gyr")])

    assert width(all_of_them) < 0.7 * width(one)
    assert coverage([axis.walk for axis in axes(all_of_them, "gyr")], GYR[1]) >= 0.8


def test_the_noise_of_a_simulated_glove_comes_back():
    """20 sensors, 20 min at 100 Hz, white noise and walk as drawn for each."""
    worn = wear(ideal_subject("right"), glove(), parse("noise"), 5)
    still, rate_hz, n = held(np.zeros(CHANNELS), 1.0), 100, 20 * 60 * 100
    state, gyr, acc = begin(worn), [], []
    for part in np.array_split(np.arange(n) * 10_000, 30):
        sensed, state = sense(worn, state, still, part, rate_hz)
        gyr.append(sensed.samples.gyr.astype(np.float32))
        acc.append(sensed.samples.acc.astype(np.float32))
    read = StaticRecording(np.arange(n) / 100.0, np.concatenate(gyr), np.concatenate(acc), 100.0)
    found = noise_of([read], glove().names)
    for kind, first in (("gyr", 3), ("acc", 0)):
        for density, drawn in (("white", worn.drawn.noise), ("walk", worn.drawn.walk)):
            inside = [
                one.low <= drawn[index, first] <= one.high
                for index, sensor in enumerate(found.sensors)
                for one in (getattr(axis, density) for axis in getattr(sensor, kind))
            ]
            assert np.mean(inside) >= 0.85  # 60 axes
            sensor = found.sensors[0]
            mean = mean_of([getattr(axis, density) for axis in getattr(sensor, kind)])
            assert mean.low <= drawn[0, first] <= mean.high


def test_lost_readings_are_closed_up_and_silent_sensors_left_out():
    whole = recording(600.0, 3)
    gyr, rng = whole.gyr.copy(), np.random.default_rng(3)
    gyr[rng.uniform(size=len(gyr)) < 0.005, 0] = np.nan
    gyr[4000:, 1] = np.nan
    found = noise_of([replace(whole, gyr=gyr)], names(3))
    assert [sensor.sensor for sensor in found.sensors] == ["SN1", "SN3"]
    assert found.left_out == ("SN2",)
    for axis, other in zip(
        found.sensors[0].gyr, noise_of([whole], names(3)).sensors[0].gyr, strict=True
    ):
        assert axis.white.value == pytest.approx(other.white.value, rel=0.01)
    with pytest.raises(CalibrationError, match="None of 3 sensors"):
        noise_of([replace(whole, gyr=np.zeros_like(gyr))], names(3))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda r: (r.gyr[2000:2010, 1], 0.08), "SN2 did not rest 100 s .* turned by 4.6 deg/s"),
        (lambda r: (r.acc[4000:, 0], 0.5), r"SN1 did not rest .* pushed by 0.50 m/s² \(limit 0.20"),
    ],
)
def test_motion_is_refused_with_how_much_and_where(spoil, words):
    still = recording(300.0, 2)
    part, by = spoil(still)
    part += by
    with pytest.raises(CalibrationError, match=words) as refused:
        noise_of([still], names(2))
    assert "Lay the glove" in refused.value.remedy


def test_a_knock_is_refused():
    still = recording(300.0, 2)
    still.acc[3000:3010, 1] += 0.1 * (-1.0) ** np.arange(10)[:, None]
    with pytest.raises(CalibrationError, match=r"SN2 did not rest 150 s .* usual noise"):
        noise_of([still], names(2))


def test_what_does_not_fit_is_refused():
    whole = recording(LEAST_S + 30.0)
    with pytest.raises(CalibrationError, match="no recording"):
        noise_of([], names(1))
    with pytest.raises(CalibrationError, match="is 60 s long, at least 120 s"):
        noise_of([recording(60.0)], names(1))
    with pytest.raises(CalibrationError, match="1 sensors at 10 Hz is among those of 1"):
        noise_of([whole, recording(150.0, rate_hz=10.0)], names(1))
    late = whole.time_s + 5.0 * (whole.time_s > 60.0)
    with pytest.raises(CalibrationError, match="3000 instants where 20 Hz make 3100; 1 %"):
        noise_of([replace(whole, time_s=late)], names(1))
