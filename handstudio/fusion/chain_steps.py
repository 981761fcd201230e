"""What the filters over chains take from samples: all of a run before its loop over instants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion.chain_links import NOBODY, Links, padded
from handstudio.fusion.chain_model import rotational
from handstudio.fusion.chain_state import ChainState
from handstudio.fusion.steps import Steps, first, steps_of
from handstudio.samples import ImuSamples


@dataclass(frozen=True, slots=True, eq=False)
class ChainSteps:
    """One step an instant; nothing of a sensor that is not heeded, and no NaN.

    Attributes:
        duration_s: Of the step.
        turn: Its rotation [rad], sensor frame, bias taken off.
        goes_on: The attitude is carried on from the instant before; else it is found ...
        held: ... or left where it was.
        begins: It is found from this sample ...
        heads: ... or its heading is.
        observed: Attitude by accelerometer and compass (2.9 to 2.11).
        own: Acceleration at a sensor's own joint [m/s²], in its frame: ``a_Sj - a_r,Sj`` (4.25).
        before: And at the chain's next joint (4.29, 4.30).
        carried: What the link between the two adds (4.28).
        known: These three are: they need the sample before as well.
        speed: How fast a sensor turns [rad/s].
        mag: Reading of the compass [µT] ...
        compass: ... where it is fresh.
    """

    duration_s: Float[Array, " n"]
    turn: Float[Array, "n c l 3"]
    goes_on: Bool[Array, "n c l"]
    held: Bool[Array, "n c l"]
    begins: Bool[Array, "n c l"]
    heads: Bool[Array, "n c l"]
    observed: Float[Array, "n c l 3"]
    own: Float[Array, "n c l 3"]
    before: Float[Array, "n c l 3"]
    carried: Float[Array, "n c l 3"]
    known: Bool[Array, "n c l"]
    speed: Float[Array, "n c l"]
    mag: Float[Array, "n c l 3"]
    compass: Bool[Array, "n c l"]


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """What the sensors leave to the next run."""

    rate: Float[Array, "s 3"]
    begun: Bool[Array, " s"]
    headed: Bool[Array, " s"]
    rated: Bool[Array, " s"]


def chain_steps(
    state: ChainState,
    samples: ImuSamples,
    stretch: Float[Array, " n"],
    heeded: Bool[Array, "n s"],
    links: Links,
) -> tuple[ChainSteps, Ends]:
    """Steps that lead to each sample.

    Angular acceleration is the difference from the sample before, so that nothing waits for the
    next one; what it is half a sample late by counts among the errors of an acceleration.
    """
    steps = steps_of(samples, stretch, heeded, state.period_s, state.gyr_bias)
    rates = np.concatenate(
        [state.rate[None], np.where(heeded[..., None], samples.gyr - state.gyr_bias, 0.0)]
    )
    rated = np.concatenate([state.rated[None], heeded])
    begins = first(state.begun, heeded)
    ends = Ends(
        rates[-1],
        state.begun | heeded.any(axis=0),
        state.headed | steps.compass.any(axis=0),
        rated[-1],
    )
    known = heeded & rated[:-1] & ~begins
    return _along(_Sensed(steps, rates, begins, known), samples, state, links), ends


@dataclass(frozen=True, slots=True, eq=False)
class _Sensed:
    """What is found sensor by sensor."""

    steps: Steps
    rates: Array  # one row more than there are steps
    begins: Array
    known: Array


def _along(sensed: _Sensed, samples: ImuSamples, state: ChainState, links: Links) -> ChainSteps:
    """The same, laid along the chains."""
    index = padded(links.chains)

    def laid(of_sensors: Array) -> Array:
        along = of_sensors[:, index]
        along[:, index == NOBODY] = 0
        return along

    steps, heeded = sensed.steps, sensed.steps.heeded
    change = np.diff(sensed.rates, axis=0) / steps.duration_s[:, None, None]
    known, compass, goes_on = laid(sensed.known), laid(steps.compass), laid(heeded & ~sensed.begins)
    gyr, change = laid(sensed.rates[1:]), laid(change)
    acc = _where(known, laid(samples.acc))
    to_sensor, to_next = links.t_joint_sensor, links.t_joint_next
    return ChainSteps(
        duration_s=steps.duration_s,
        turn=_where(goes_on, laid(np.moveaxis(steps.turn, 1, -1))),
        goes_on=goes_on,
        held=laid(~heeded),
        begins=laid(sensed.begins),
        heads=laid(first(state.headed, steps.compass)),
        observed=laid(np.moveaxis(steps.observed, 1, -1)),
        own=_where(known, acc - rotational(gyr, change, to_sensor)),
        before=_where(known, acc - rotational(gyr, change, to_sensor - to_next)),  # lever by (4.31)
        carried=_where(known, rotational(gyr, change, to_next)),
        known=known,
        speed=np.sqrt(np.sum(gyr * gyr, axis=-1)),
        mag=_where(compass, laid(samples.mag)),
        compass=compass,
    )


def _where(use: Array, signal: Array) -> Array:
    return np.where(use[..., None], signal, 0.0)
