"""What is observed along a chain, equation by equation, on a finger that moves exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from handstudio.fusion import euler
from handstudio.fusion.chain_links import Links, links_of, padded
from handstudio.fusion.chain_model import (
    UP,
    accumulated,
    attitudes,
    from_before,
    from_beyond,
    horizontal,
    rotational,
)
from handstudio.hand_fit import fit_of, hand_mechanism
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.samples import ImuSamples
from handstudio.setup import Setup
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.mounting import nominal_mounting
from handstudio.simulation.rig import Truth, signals
from handstudio.simulation.subject import ideal_subject

NAMES = ("SN1", "SN2", "SN3", "SN11", "SN15", "SN16", "SN17", "SN18", "SN19", "SN20", "SN4", "SN8")
SHORT_US = 100
HEADINGS = np.random.default_rng(4).normal(0.0, 0.1, len(NAMES))


@dataclass(frozen=True)
class Moving:
    """Three chains at a few instants: readings, true angles, the elbow; nothing measured."""

    links: Links
    angles: np.ndarray
    gyr: np.ndarray
    change: np.ndarray
    acc: np.ndarray
    mag: np.ndarray
    elbow: np.ndarray

    def own(self) -> np.ndarray:
        return self.acc - rotational(self.gyr, self.change, self.links.t_joint_sensor)

    def before(self) -> np.ndarray:
        lever = self.links.t_joint_sensor - self.links.t_joint_next
        return self.acc - rotational(self.gyr, self.change, lever)

    def carried(self) -> np.ndarray:
        return rotational(self.gyr, self.change, self.links.t_joint_next)


def performed(time_us: np.ndarray) -> tuple[ImuSamples, Truth]:
    someone, layout = ideal_subject("right"), glove("right", NAMES)
    motion = perform("ball_throw&elbow_moving:all 10", Actor(someone, 5, material()))
    return signals(someone, layout, motion, time_us)


@pytest.fixture(scope="module", params=[1.75, 4.5, 5.25, 8.5])
def moving(request) -> Moving:
    """Rates change by a difference over 0.2 ms about the instant."""
    at = round(request.param * 1e6) + SHORT_US * np.arange(-1, 2)
    samples, truth = performed(at)
    setup = Setup(glove("right", NAMES), 100.0)
    fit = fit_of(setup)
    places = nominal_mounting(setup.layout, fit.skeleton).t_segment_sensor
    links = links_of(hand_mechanism(setup.layout, fit, places, HEADINGS))
    index = padded(links.chains)
    change = (samples.gyr[2] - samples.gyr[0]) / (2e-6 * SHORT_US)
    elbow = truth.t_world_joint[:, 0]
    force = np.diff(elbow, 2, axis=0)[0] / (1e-6 * SHORT_US) ** 2
    return Moving(
        links,
        np.moveaxis(euler.from_quaternion(truth.q_world_sensor[1, index]), 0, -1),
        samples.gyr[1, index],
        change[index],
        samples.acc[1, index],
        samples.mag[1, index],
        np.tile(force, (len(index), 1)),
    )


def real(moving: Moving) -> np.ndarray:
    return padded(moving.links.chains) >= 0


# --- the equations, at the true orientations ----------------------------------------------------


def test_the_hand_moves_enough_for_this_to_mean_anything(moving):
    assert np.linalg.norm(moving.carried(), axis=-1).max() > 1.0
    assert np.linalg.norm(moving.elbow[0]) > 0.02


def test_attitudes_are_those_of_quaternions(moving):
    expected = so3.to_matrix(euler.to_quaternion(np.moveaxis(moving.angles, -1, 0)))
    np.testing.assert_allclose(attitudes(moving.angles).r, expected, atol=1e-14)


def test_what_is_accumulated_from_the_root_is_felt_at_every_joint_4_26(moving):
    expected = accumulated(attitudes(moving.angles), moving.carried(), moving.elbow)
    left = (moving.own() - expected.value)[real(moving)]
    assert np.abs(left).max() < 1e-3


def test_both_sensors_of_a_joint_feel_one_acceleration_4_29(moving):
    at = attitudes(moving.angles)
    left = moving.own() - from_before(at, moving.before(), moving.elbow).value
    assert np.abs(left[real(moving)]).max() < 1e-3
    nearer = np.concatenate([np.tile(UP, (len(at.r), 1, 1)), moving.before()[:, :-1]], axis=1)
    left = nearer - from_beyond(at, moving.own(), moving.elbow).value
    assert np.abs(left[real(moving)]).max() < 1e-3


def test_the_level_field_lies_along_x_whatever_the_correction_of_the_heading_4_34(moving):
    """The field of the simulated room has no part along y; a compass is off by -psi_cor."""
    turned = moving.angles + moving.links.heading_rad[..., None] * [0.0, 0.0, 1.0]
    seen = horizontal(attitudes(turned), moving.mag, moving.links.heading_rad).value
    across = seen[real(moving)] / np.linalg.norm(moving.mag, axis=-1)[real(moving)][:, None]
    np.testing.assert_allclose(across[:, 1:], 0.0, atol=1e-12)
    assert across[:, 0].min() > 0.5


def test_a_lever_makes_the_acceleration_of_a_turning_body_3_1():
    """Against the second difference of where its end is."""
    rng = np.random.default_rng(8)
    gyr, change, lever = rng.normal(size=(3, 3)) * [[3.0], [20.0], [0.1]]
    h = 1e-4
    places = [so3.rotate(so3.exp(t * gyr + 0.5 * t * t * change), lever) for t in (-h, 0.0, h)]
    expected = np.diff(np.array(places), 2, axis=0)[0] / h**2
    np.testing.assert_allclose(rotational(gyr, change, lever), expected, atol=1e-5)


# --- slopes -------------------------------------------------------------------------------------


KINDS = {
    "H1": lambda m, at, elbow: accumulated(at, m.carried(), elbow),
    "H2 first half": lambda m, at, elbow: from_before(at, m.before(), elbow),
    "H2 second half": lambda m, at, elbow: from_beyond(at, m.own(), elbow),
    "H3": lambda m, at, elbow: horizontal(at, m.mag, m.links.heading_rad),
}


@pytest.mark.parametrize("kind", KINDS)
def test_slopes_are_the_differences_of_what_is_expected(moving, kind):
    model, h = KINDS[kind], 1e-6
    found = model(moving, attitudes(moving.angles), moving.elbow)
    c, links = moving.angles.shape[:2]
    for a in range(3 * links):
        step = np.zeros((c, 3 * links))
        step[:, a] = h
        more, less = (
            model(moving, attitudes(moving.angles + sign * step.reshape(c, links, 3)), moving.elbow)
            for sign in (1.0, -1.0)
        )
        slope = (more.value - less.value) / (2 * h)
        np.testing.assert_allclose(found.by_angles[..., a], slope, atol=1e-6)
    for a in range(3):
        step = h * np.eye(3)[a]
        more = model(moving, attitudes(moving.angles), moving.elbow + step)
        less = model(moving, attitudes(moving.angles), moving.elbow - step)
        slope = (more.value - less.value) / (2 * h)
        np.testing.assert_allclose(found.by_elbow[..., a], slope, atol=1e-6)
