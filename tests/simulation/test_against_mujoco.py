"""Our mechanics against an independent rigid-body engine, on people whose axes stay fixed.

MuJoCo gets the same tree, the same joint angles, rates and accelerations, and solves the inverse
problem; its accelerometers, gyroscopes and magnetometers must read what ours do.
"""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from handstudio.hand.skeleton import JOINTS, SEGMENTS
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY
from handstudio.simulation.mounting import Mounting, donned, nominal_mounting
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import Subject, subject, with_fixed_axes
from handstudio.simulation.trajectory import CHANNELS, through_points
from handstudio.simulation.world import World

WORLD = World(heading_rad=-0.9)
SENSES = ("accelerometer", "gyro", "magnetometer")


def numbers(values) -> str:
    return " ".join(repr(float(v)) for v in values)


def model_of(someone: Subject, mounting: Mounting) -> mujoco.MjModel:
    """The tree as the engine reads it: three slides for the elbow, three hinges a joint."""
    root = ET.Element("mujoco")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(
        root,
        "option",
        gravity=numbers([0, 0, -STANDARD_GRAVITY]),
        magnetic=numbers(WORLD.field_ut),
    )
    bodies = {None: body(ET.SubElement(root, "worldbody"), "elbow", np.zeros(3), so3.IDENTITY)}
    for i, axis in enumerate(np.eye(3)):
        ET.SubElement(bodies[None], "joint", type="slide", name=f"slide {i}", axis=numbers(axis))
    for k, joint in enumerate(JOINTS):
        q = someone.skeleton.q_parent_rest[k]
        q = so3.multiply(WORLD.q_world_start, q) if joint.parent is None else q
        place = someone.skeleton.t_parent_joint[k]
        bodies[joint.child] = body(bodies[joint.parent], joint.child, place, q)
        for turn in range(3):  # a body's joints act one after the other, as our turns do
            ET.SubElement(
                bodies[joint.child],
                "joint",
                type="hinge",
                name=f"{joint.name} {turn}",
                axis=numbers(someone.mechanism.axes[k, turn]),
                pos=numbers(someone.mechanism.points[k, turn]),
            )
    sensors = ET.SubElement(root, "sensor")
    for i, place in enumerate(glove(someone.side).sensors):
        at = {
            "pos": numbers(mounting.t_segment_sensor[i]),
            "quat": numbers(mounting.q_segment_sensor[i]),
        }
        ET.SubElement(bodies[place.segment], "site", name=place.sensor, **at)
        for sense in SENSES:
            ET.SubElement(sensors, sense, site=place.sensor)
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def body(parent: ET.Element, name: str, place: np.ndarray, q: np.ndarray) -> ET.Element:
    element = ET.SubElement(parent, "body", name=name, pos=numbers(place), quat=numbers(q))
    ET.SubElement(element, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
    return element


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("number", [0, 2, 9])
def test_every_sensor_reads_what_the_engine_says(number, side):
    someone = with_fixed_axes(subject(number, side))
    mounting = donned(nominal_mounting(glove(side), someone.skeleton), 3, side)
    model = model_of(someone, mounting)
    data = mujoco.MjData(model)
    assert model.nv == 3 + 3 * len(SEGMENTS)

    rng = np.random.default_rng(number)
    trajectory = through_points(np.arange(8) * 0.5, rng.uniform(-0.9, 0.9, (8, CHANNELS)))
    time_us = np.arange(100_000, 3_400_000, 61_000)
    ours, truth = signals(someone, glove(side), trajectory, time_us, mounting=mounting, world=WORLD)
    motion = trajectory.derivatives(time_us * 1e-6)
    # the engine counts depth first: channels and bodies are found by name
    names = [f"{joint.name} {turn}" for joint in JOINTS for turn in range(3)]
    channels = [model.joint(name).qposadr[0] for name in (*names, "slide 0", "slide 1", "slide 2")]
    bodies = [model.body(name).id for name in SEGMENTS]
    sites = [model.site(name).id for name in glove(side).names]
    for i in range(len(time_us)):
        for told, values in zip((data.qpos, data.qvel, data.qacc), motion, strict=True):
            told[channels] = values[i]
        mujoco.mj_inverse(model, data)
        read = data.sensordata.reshape(len(sites), 3, 3)
        np.testing.assert_allclose(ours.acc[i], read[:, 0], rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(ours.gyr[i], read[:, 1], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(ours.mag[i], read[:, 2], rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(truth.t_world_joint[i], data.xpos[bodies], atol=1e-12)
        np.testing.assert_allclose(truth.t_world_sensor[i], data.site_xpos[sites], atol=1e-12)
    assert np.abs(ours.acc).max() > 30.0  # nothing was proved at rest
