"""MCAP for viewers, read by the mcap library and decoded by the schemas the file brings along."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from handstudio.errors import TakeError
from handstudio.export.part import Processed
from handstudio.hand.skeleton import PARENTS, SEGMENTS
from handstudio.kinematics import angles_of, exported_angles
from handstudio.maths import so3
from handstudio.recording.library import entries
from handstudio.recording.naming import VIEW
from handstudio.recording.take import open_take

from .conftest import GAP


def read(path: Path) -> tuple[dict[str, str], dict[str, list[tuple[int, Any]]], dict[str, str]]:
    """Metadata, messages by topic with their times, and the schema of each topic."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        (about,) = reader.iter_metadata()
        topics: dict[str, list[tuple[int, Any]]] = {}
        schemas = {}
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append((message.log_time, decoded))
            schemas[channel.topic] = (schema.name, schema.encoding, channel.message_encoding)
    return about.metadata, topics, schemas


def placed(message: Any) -> dict[str, np.ndarray]:
    """Places of all frames in the world [mm], from the transforms alone."""
    known = {"world": (so3.IDENTITY, np.zeros(3))}
    for frame in message.transforms:
        q, t = known[frame.parent_frame_id]
        r, p = frame.rotation, frame.translation
        place = t + so3.rotate(q, np.array([p.x, p.y, p.z]))
        known[frame.child_frame_id] = so3.multiply(q, np.array([r.w, r.x, r.y, r.z])), place
    return {name: 1e3 * place for name, (_, place) in known.items()}


def test_frames_bones_and_angles_are_in_standard_schemas(into, whole, points):
    about, topics, schemas = read(into("mcap", whole, start_s=1.0, end_s=2.0))
    protobuf = ("protobuf", "protobuf")
    assert schemas == {
        "/tf": ("foxglove.FrameTransforms", *protobuf),
        "/hand": ("foxglove.SceneUpdate", *protobuf),
        "/angles": ("handstudio.Angles", *protobuf),
    }
    assert about["raw_sha256"] == whole.take.sha256()
    assert about["subject"] == "virtual-0"
    assert len(topics["/tf"]) == len(topics["/angles"]) == 101
    for k in (0, 50, 100):
        at_ns, message = topics["/tf"][k]
        found = placed(message)
        np.testing.assert_allclose(
            [found[name] for name in SEGMENTS], points[100 + k, : len(SEGMENTS)], atol=1e-6
        )
        assert at_ns == whole.take.header.start_utc_ns + 1_000_000_000 + k * 10_000_000
        stamp = message.transforms[0].timestamp
        assert stamp.seconds * 10**9 + stamp.nanos == at_ns


def test_bones_hang_in_the_frames_and_reach_to_the_next(into, whole):
    _, topics, _ = read(into("mcap", whole))
    ((at_ns, scene),) = topics["/hand"]
    assert at_ns == topics["/tf"][0][0]
    bones = {entity.id: entity for entity in scene.entities}
    assert list(bones) == list(SEGMENTS)
    assert all(
        e.frame_id == e.id and e.frame_locked and not e.lifetime.seconds for e in bones.values()
    )
    offsets = {f.child_frame_id: f.translation for f in topics["/tf"][0][1].transforms}
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            ends = bones[SEGMENTS[parent]].lines[0].points[1::2]
            assert offsets[SEGMENTS[child]] in [
                type(offsets[SEGMENTS[child]])(x=p.x, y=p.y, z=p.z) for p in ends
            ]


def left_out(message: Any) -> set[str]:
    """Parts that the schema of a message has and it lacks: foxglove's JSON schemas want all."""
    gone = set()
    for field in message.DESCRIPTOR.fields:
        if field.message_type is None:
            continue
        if field.is_repeated:
            gone |= {name for each in getattr(message, field.name) for name in left_out(each)}
        elif message.HasField(field.name):
            gone |= left_out(getattr(message, field.name))
        else:
            gone.add(field.full_name)
    return gone


def test_nothing_that_the_schemas_have_is_left_out(into, whole):
    _, topics, _ = read(into("mcap", whole, end_s=0.1))
    for topic in ("/tf", "/hand"):
        assert set().union(*(left_out(message) for _, message in topics[topic])) == set()


def test_angles_are_degrees_by_name(into, whole):
    _, topics, _ = read(into("mcap", whole))
    angles = exported_angles(whole.setup, whole.motion)
    expected = np.rad2deg(angles_of(whole.setup, whole.motion, angles))
    found = [[getattr(m, f"{a.name}_deg") for a in angles] for _, m in topics["/angles"]]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_in_a_gap_nothing_is_said(into, whole, gappy):
    _, all_topics, _ = read(into("mcap", whole))
    _, topics, _ = read(into("mcap", gappy))
    times = [at for at, _ in all_topics["/tf"]]
    assert [at for at, _ in topics["/tf"]] == times[: GAP.start] + times[GAP.stop :]


def test_without_a_hand_sensors_are_shown_side_by_side(into, door):
    take, motion = door
    about, topics, _ = read(into("mcap", Processed(take, take.header.setup, motion)))
    assert list(topics) == ["/tf"]
    for k, (_, message) in enumerate(topics["/tf"]):
        assert [f.child_frame_id for f in message.transforms] == ["leaf, inner", "frame"]
        r = message.transforms[1].rotation
        np.testing.assert_allclose([r.w, r.x, r.y, r.z], motion.q_world_sensor[k, 1])
    assert "side by side" in about["places"]


def test_the_library_does_not_take_it_for_a_take(whole, into, tmp_path):
    visit = tmp_path / "S01" / "today"
    visit.mkdir(parents=True)
    path = into("mcap", whole, end_s=0.1).rename(visit / f"fist{VIEW}")
    assert entries(tmp_path) == []
    with pytest.raises(TakeError, match="not a take"):
        open_take(path)
