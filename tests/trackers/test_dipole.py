"""The coil: its field against somebody else's computation, and poses out of nine signals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.dipole import MU0_4PI, signals
from handstudio.trackers.dipole_pose import closed_form, refined


def _poses(seed: int, count: int, nearest: float = 0.05) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    t = rng.standard_normal((count, 3))
    t *= rng.uniform(nearest, 0.3, (count, 1)) / np.linalg.norm(t, axis=1, keepdims=True)
    return t, so3.normalize(rng.standard_normal((count, 4)))


def test_the_field_is_that_of_magpylib() -> None:
    import magpylib  # noqa: PLC0415 - slow to load

    t, q = _poses(1, 20)
    ours = signals(t, q, gain=MU0_4PI)
    turned = np.swapaxes(so3.to_matrix(q), 1, 2)
    for coil, moment in enumerate(np.eye(3)):
        field = magpylib.misc.Dipole(moment=moment).getB(t)
        heard = (turned @ field[..., None])[..., 0]
        np.testing.assert_allclose(ours[:, :, coil], heard, rtol=1e-9, atol=1e-18)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_the_closed_form_is_exact_without_noise(seed: int) -> None:
    t, q = _poses(seed, 4)
    found_t, found_q = closed_form(signals(t, q, gain=2.5), towards=t, gain=2.5)
    np.testing.assert_allclose(found_t, t, atol=1e-9)
    assert so3.angle_between(found_q, q).max() < 1e-6


def test_both_halves_of_the_room_sound_alike_and_which_is_told_by_whoever_asks() -> None:
    t, q = _poses(3, 10)
    np.testing.assert_allclose(signals(t, q), signals(-t, q), rtol=1e-12)
    there, _ = closed_form(signals(t, q), towards=-t)
    np.testing.assert_allclose(there, -t, atol=1e-9)


def test_least_squares_is_no_worse_than_the_closed_form_and_knows_how_sure_it_is() -> None:
    t, q = _poses(5, 400, nearest=0.15)
    noise = 1e-3 * 2.0 / 0.2**3
    heard = signals(t, q) + noise * np.random.default_rng(6).standard_normal((400, 3, 3))
    first_t, first_q = closed_form(heard, towards=t)
    best = refined(heard, first_t, first_q, noise)
    assert np.all(best.residual < 2.5 * noise)
    off = best.t_room_terminal - t
    assert np.sum(off**2) <= 1.02 * np.sum((first_t - t) ** 2)
    turn = so3.log(so3.multiply(so3.conjugate(q), best.q_room_terminal))
    both = np.concatenate([off, turn], axis=1)
    squares = np.einsum("ni,nij,nj->n", both, np.linalg.inv(best.covariance), both)
    # of six unknowns: a mean of 6, known to 4 % from 400
    assert 5.3 < squares.mean() < 6.9


def test_a_receiver_that_hears_nothing_is_refused() -> None:
    with pytest.raises(TrackError, match="hears nothing"):
        closed_form(np.zeros((1, 3, 3)), towards=np.array([[1.0, 0.0, 0.0]]))
