"""Filters 2, 3 and 4 of the thesis: extended Kalman filters over chains of sensors (4.3.1, 4.4.1).

A filter a chain, from the forearm to a fingertip, as published: its states are the Euler angles of
all its sensors and the acceleration of the elbow, which is white (4.38). The update is that of
`raw` (2.13). Observed are accelerations at the joints, what turning adds taken off: accumulated
from the root (H1), and between neighbours (H2); and the level part of the magnetic field (H3):

- Filter 2: H1 and H3
- Filter 3: H1, H2 and H3
- Filter 4: as 3, with priority to H2 of a sensor that turns at 400 deg/s or faster, else to its H1

What chains share, a hand or a forearm, each has for itself; the results are averaged afterwards
(circular means) and not fed back, again as published. Within a chain headings agree (4.21, 4.22);
they are handed out as each sensor's own compass has them, to be turned afterwards like those of any
filter of single sensors.

The thesis names neither noise nor how priority is expressed: both are ours. Ours is, too, what it
does not speak of: a sensor that is silent is held, and those beyond it take the joint where their
chain is broken for an elbow.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion import chain_state, euler
from handstudio.fusion.chain_kalman import Belief, apart, corrected, found, predicted
from handstudio.fusion.chain_links import links_of, single
from handstudio.fusion.chain_model import attitudes, horizontal
from handstudio.fusion.chain_observe import Weights, averaged_level, inertial, magnetic
from handstudio.fusion.chain_state import ChainState, averaged, blank, block, copies_of, regrouped
from handstudio.fusion.chain_steps import ChainSteps, chain_steps
from handstudio.fusion.mechanism import Mechanism
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

_PLACED = float(np.deg2rad(1.0)) ** 2
"""Variance of an angle found at rest [rad²]: 10 mg left in an accelerometer are 0.6 deg. Ours."""

_FOUND = float(np.deg2rad(6.0)) ** 2
"""Of one found in motion: a hand's own acceleration of 0.1 g. Ours."""

_UNKNOWN = float(np.pi**2 / 3.0)
"""Of a heading before the first reading [rad²]: all round."""

_STATIC_S = 0.5
"""For so long after an attitude was found, the level part of the field is averaged (4.33). A sensor
is placed in a rest that mostly goes on; should it not, its attitude is still good."""

_TENTH = float(np.sqrt(2.0 * 0.1))
"""Density of what has a standard deviation of 1 and holds for a tenth of a second [sqrt(s)]."""


class ChainFilter(msgspec.Struct, frozen=True):
    """What the three filters have in common. Not tuned on any result.

    All noises are densities, as in `filter1`, whose process this is: an observation has the
    variance ``noise² / dt``. Each of the two halves of H2 has twice that: they are one statement.

    Attributes:
        gyr_noise: White noise of the gyroscope [rad/sqrt(s)], the middle of the thesis's table 4.1.
        gyr_factor: What a moving sensor errs beyond that, as in `filter1`.
        acc_noise: Of an acceleration at a joint [m/s² sqrt(s)]: levers off by 5 mm, rates half a
            sample old and boards that rock on skin leave 0.03 g, for a tenth of a second.
        elbow_noise: How much the elbow is accelerated [m/s² sqrt(s)]: 0.1 g for a tenth of a
            second, which is what `filter1` takes for a hand's own acceleration.
        mag_noise: Of the level field, as a share of it [sqrt(s)]: a compass is off by 3 deg, by
            iron in the room and in the board, and stays so for half a second.
    """

    gyr_noise: float = float(np.deg2rad(6.5e-3))
    gyr_factor: float = 100.0
    acc_noise: float = 0.03 * STANDARD_GRAVITY * _TENTH
    elbow_noise: float = 0.1 * STANDARD_GRAVITY * _TENTH
    mag_noise: float = float(np.deg2rad(3.0))

    NAME: ClassVar[str] = ""
    NEIGHBOURS: ClassVar[bool] = True
    """Whether H2 is observed."""

    def begin(
        self, sensors: int, rate_hz: float, magnetometer_rate_hz: float | None = None
    ) -> ChainState:
        """State before the first sample."""
        fresh_hz = min(rate_hz, magnetometer_rate_hz or rate_hz)
        return blank(sensors, 1.0 / rate_hz, 1.0 / fresh_hz)

    def restart(self, state: ChainState) -> ChainState:
        """Forget attitudes, keep biases; what was shown last is held until a reading comes."""
        nobody = np.zeros_like(state.begun)
        none = np.zeros_like(state.levels)
        return replace(state, begun=nobody, headed=nobody, rated=nobody, levels=none)

    def place(
        self,
        state: ChainState,
        sensor: int,
        q_world_sensor: Float[Array, " 4"],
        gyr_bias: Float[Array, " 3"],
    ) -> ChainState:
        """Set a sensor's attitude and bias, as found at rest, in every chain that it is in."""
        angles, covariance = state.angles.copy(), state.covariance.copy()
        levels, biases = state.levels.copy(), state.gyr_bias.copy()
        begun, headed = state.begun.copy(), state.headed.copy()
        for c, k in copies_of(state.chains)[sensor]:
            angles[c, k], levels[c, k] = euler.from_quaternion(q_world_sensor), 0.0
            covariance[c, block(k), :] = covariance[c, :, block(k)] = 0.0
            covariance[c, block(k), block(k)] = _PLACED * np.eye(3)
        biases[sensor], begun[sensor], headed[sensor] = gyr_bias, True, True
        return replace(
            state,
            angles=angles,
            covariance=covariance,
            levels=levels,
            gyr_bias=biases,
            begun=begun,
            headed=headed,
        )

    def run(
        self,
        state: ChainState,
        samples: ImuSamples,
        stretch: Float[Array, " n"],
        heeded: Bool[Array, "n s"],
        mechanism: Mechanism | None = None,
    ) -> tuple[Float[Array, "n s 4"], ChainState]:
        """Fuse consecutive samples."""
        links = single(len(state.begun)) if mechanism is None else links_of(mechanism)
        state = regrouped(state, links.chains)
        steps, ends = chain_steps(state, samples, stretch, heeded, links)
        weights = self._weights(steps, state)
        belief = Belief(state.angles, state.elbow, state.covariance)
        level_ut, levels = state.level_ut, state.levels
        static = _STATIC_S / state.magnetometer_period_s
        to_common = links.heading_rad[..., None] * [0.0, 0.0, 1.0]  # psi_T (4.22)
        out = np.empty(steps.turn.shape)
        for k in range(len(samples)):
            belief = self._advanced(belief, steps, k, state.period_s)
            at = attitudes(belief.angles + to_common)
            field = horizontal(at, steps.mag[k], links.heading_rad)
            level_ut, levels = averaged_level(
                level_ut, levels, field, steps.compass[k] & (levels < static)
            )
            seen = inertial(at, steps, k, weights, with_neighbours=self.NEIGHBOURS)
            seen.append(magnetic(field, level_ut, weights.field[k]))
            belief = corrected(belief, seen)
            out[k] = belief.angles
        after = replace(
            state,
            angles=belief.angles,
            covariance=belief.covariance,
            elbow=belief.elbow,
            level_ut=level_ut,
            levels=levels,
            rate=ends.rate,
            begun=ends.begun,
            headed=ends.headed,
            rated=ends.rated,
        )
        means = averaged(out, links.chains)
        return euler.to_quaternion(np.ascontiguousarray(np.moveaxis(means, -1, 0))), after

    def pack(self, state: ChainState) -> bytes:
        """Serialise a state, to the last bit."""
        return chain_state.pack(state, self.NAME)

    def unpack(self, packed: bytes) -> ChainState:
        """Inverse of `pack`."""
        return chain_state.unpack(packed, self.NAME)

    def _advanced(self, belief: Belief, steps: ChainSteps, k: int, period_s: float) -> Belief:
        """Carried on to an instant by the gyroscopes, or found there."""
        density = (self.gyr_noise * self.gyr_factor) ** 2
        spread = np.where(steps.goes_on[k], density * steps.duration_s[k], 0.0)
        belief = predicted(belief, steps.turn[k], spread, self.elbow_noise**2 / period_s)
        if steps.held[k].any():
            belief = apart(belief, steps.held[k])
        begins, heads = steps.begins[k], steps.heads[k]
        if not (begins.any() or heads.any()):
            return belief
        now = np.stack([begins, begins, begins | heads], axis=-1)
        gap = euler.difference(_first(steps.observed[k]), _first(belief.angles))
        seen = np.where(
            begins[..., None], steps.observed[k], belief.angles + np.moveaxis(gap, 0, -1)
        )
        variance = np.full(now.shape, _FOUND)
        variance[..., 2] = np.where(steps.compass[k], _FOUND, _UNKNOWN)
        return found(belief, now, seen, variance)

    def _weights(self, steps: ChainSteps, state: ChainState) -> Weights:
        """What each observation weighs: the inverse of its variance, 0 where there is none."""
        acc, elbow = self.acc_noise**2 / state.period_s, self.elbow_noise**2 / state.period_s
        field = self.mag_noise**2 / state.magnetometer_period_s
        unknown = np.cumsum(~steps.known, axis=-1) > 0  # here, or nearer to the root
        broken = np.concatenate([np.zeros_like(unknown[..., :1]), unknown[..., :-1]], axis=-1)
        joint = steps.known.copy()
        joint[..., 1:] &= steps.known[..., :-1]
        from_root, of_neighbours = self._doubts(steps.speed)
        return Weights(
            steps.known / (from_root * (acc + broken * elbow)),
            joint / (of_neighbours * 2.0 * acc),
            steps.compass / field,
        )

    def _doubts(self, speed: Float[Array, "n c l"]) -> tuple[Array, Array]:
        """Factors of the variances of H1 and H2, by how fast a sensor turns [rad/s]."""
        one = np.ones_like(speed)
        return one, one


class Filter2(ChainFilter, frozen=True, tag="filter2"):
    """H1 and H3: accelerations summed from the root, and the magnetic field."""

    NAME: ClassVar[str] = "filter2"
    NEIGHBOURS: ClassVar[bool] = False


class Filter3(ChainFilter, frozen=True, tag="filter3"):
    """H1, H2 and H3: neighbours at each joint as well."""

    NAME: ClassVar[str] = "filter3"


class Filter4(ChainFilter, frozen=True, tag="filter4"):
    """As Filter 3, with priority between H1 and H2.

    Attributes:
        fast: A sensor that turns so fast or faster [rad/s] has priority for H2, others for H1 (the
            thesis's 400 deg/s).
        priority: The other's noise is taken for so many times what it is. At 10 it weighs a
            hundredth: nearly left out, but still there where the first says nothing.
    """

    fast: float = float(np.deg2rad(400.0))
    priority: float = 10.0

    NAME: ClassVar[str] = "filter4"

    def _doubts(self, speed: Float[Array, "n c l"]) -> tuple[Array, Array]:
        is_fast, less = speed >= self.fast, self.priority**2
        return np.where(is_fast, less, 1.0), np.where(is_fast, 1.0, less)


def _first(angles: Array) -> Array:
    """Angles before chains and sensors, as `euler` has them."""
    return np.moveaxis(angles, -1, 0)
