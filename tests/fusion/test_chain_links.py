"""Chains of the glove as the thesis has them, and what they are where sensors are missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handstudio.fusion.chain_links import chains_of, links_of, single
from handstudio.fusion.mechanism import bare
from handstudio.hand_fit import fit_of, hand_mechanism
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.setup import Setup
from handstudio.simulation.mounting import donned, nominal_mounting


def mechanism(names=None, seed=None):
    """Of a nominal glove, or of one put on crookedly."""
    setup = Setup(glove("right", names), 100.0)
    fit = fit_of(setup)
    mounting = nominal_mounting(setup.layout, fit.skeleton)
    if seed is not None:
        mounting = donned(mounting, seed, "right", 5.0)
        fit = replace(fit, q_sensor_segment=so3.conjugate(mounting.q_segment_sensor))
    none = np.zeros(len(setup.layout.sensors))
    return setup.layout, hand_mechanism(setup.layout, fit, mounting.t_segment_sensor, none)


def chains(names=None):
    layout, joined = mechanism(names)
    return {"-".join(layout.names[s][2:] for s in chain) for chain in chains_of(joined)}


def test_the_glove_has_the_five_chains_of_table_3_6():
    assert chains() == {
        "3-11-18-19-20",
        "1-11-15-16-17",
        "1-11-12-13-14",
        "2-11-4-8-9-10",
        "2-11-4-5-6-7",
    }


def test_in_any_order_of_the_sensors():
    names = [f"SN{n}" for n in range(20, 0, -1)]
    assert chains(names) == chains()


def test_where_the_named_sensor_is_not_worn_the_chain_begins_with_the_first_of_the_forearm():
    assert chains(["SN2", "SN11", "SN15", "SN18"]) == {"2-11-15", "2-11-18"}


def test_every_sensor_is_in_a_chain():
    assert chains(["SN1", "SN2", "SN3", "SN11", "SN15"]) == {"1-11-15", "2", "3"}
    assert chains(["SN1", "SN3", "SN11", "SN18"]) == {"3-11-18", "1"}
    assert chains(["SN1", "SN11", "SN17"]) == {"1-11", "17"}


def test_sensors_that_nothing_joins_are_chains_of_one_without_levers():
    assert chains_of(bare(3)) == ((0,), (1,), (2,))
    assert not single(3).t_joint_sensor.any()
    assert not single(3).t_joint_next.any()


def test_the_wrist_is_one_place_whichever_forearm_sensor_a_chain_begins_with():
    """Levers of all three, turned into the segment, tell of the same forearm."""
    layout, joined = mechanism(seed=3)
    links = links_of(joined)
    seen = [
        so3.rotate(so3.conjugate(joined.q_sensor_joint[chain[0]]), links.t_joint_next[c, 0])
        for c, chain in enumerate(links.chains)
    ]
    assert len({layout.names[chain[0]] for chain in links.chains}) == 3
    np.testing.assert_allclose(seen, np.tile(seen[0], (5, 1)), atol=1e-12)
    assert np.linalg.norm(seen[0]) > 0.2


def test_chains_end_where_the_next_joint_has_no_sensor_beyond():
    _, joined = mechanism(["SN1", "SN11", "SN4", "SN8", "SN15"])
    links = links_of(joined)
    for c, chain in enumerate(links.chains):
        assert np.linalg.norm(links.t_joint_next[c, : len(chain) - 1], axis=-1).min() > 0.01
        assert not links.t_joint_next[c, len(chain) - 1 :].any()
