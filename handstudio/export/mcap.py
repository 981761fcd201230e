"""MCAP for viewers (Foxglove, Rerun): the skeleton as frames, bones to see, angles to plot.

Messages are protobuf, in foxglove's own schemas where there is one: ``foxglove.FrameTransforms`` on
``/tf`` and ``foxglove.SceneUpdate`` on ``/hand``; angles are on ``/angles``. Their time is UTC.
Without a hand the frames are the sensors', side by side: where they are nobody knows. Where a room
is known but not the hand's place in it, the forearm's frame is left out: viewers keep the last one.
"""

from __future__ import annotations

from typing import Any, BinaryIO

import msgspec
import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer

from handstudio.arrays import Array
from handstudio.colours import of_part
from handstudio.export.bones import CHILDREN, in_parents, tips
from handstudio.export.part import Part
from handstudio.export.room import Placer
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.hand_fit import fit_of
from handstudio.kinematics import angles_of
from handstudio.pipeline import Motion

PROFILE = "handstudio.export"
WORLD = "world"
RECORD = "handstudio"
"""Name of the metadata record: what the file tells of itself."""

_ASIDE_M = 0.1
_THICK_M, _BALL_M = 0.006, 0.012


def places(part: Part) -> dict[str, Any]:
    """What the file tells of where things are."""
    if part.setup.layout.is_hand:
        return {}
    return {"places": "sensors side by side, 0.1 m apart: where they are is not known"}


def write(part: Part, file: BinaryIO) -> None:
    """Write every instant."""
    writer = Writer(file, compression=CompressionType.ZSTD)
    writer.start(PROFILE, str(part.about["software"]))
    writer.add_metadata(RECORD, {key: _told(value) for key, value in part.about.items()})
    _Recording(part, writer).run()
    writer.finish()


def _told(value: object) -> str:
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()


class _Recording:
    """The channels of one file."""

    def __init__(self, part: Part, writer: Writer) -> None:
        from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms  # noqa: PLC0415
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate  # noqa: PLC0415

        self._part, self._writer = part, writer
        self._fit = fit_of(part.setup) if part.setup.layout.is_hand else None
        self._placer = Placer(part, self._fit) if self._fit else None
        self._frames, self._scene = FrameTransforms, SceneUpdate
        self._tf = self._channel("/tf", FrameTransforms)
        self._hand = self._channel("/hand", SceneUpdate) if self._fit else 0
        self._names = [f"{angle.name}_deg" for angle in part.angles]
        self._angles_message = _message("Angles", self._names) if self._names else None
        self._angles = self._channel("/angles", self._angles_message) if self._names else 0

    def run(self) -> None:
        """All messages, in the order of time."""
        first = True
        for block in self._part.blocks():
            at_ns = self._part.start_utc_ns + (block.time_us - self._part.start_us) * 1000
            q, t, known, children, parents = self._placed(block)
            degrees = self._degrees(block)
            for k, now in enumerate(at_ns.tolist()):
                if first and self._fit is not None:
                    self._send(self._hand, now, self._drawn(self._fit.skeleton, now))
                first = False
                told = range(0 if known[k] else 1, len(children))
                frames = [(q[k][i], t[k][i], children[i], parents[i]) for i in told]
                self._send(self._tf, now, self._transforms(now, frames))
                if self._angles_message is not None:
                    values = dict(zip(self._names, degrees[k], strict=True))
                    self._send(self._angles, now, self._angles_message(**values))

    def _placed(
        self, motion: Motion
    ) -> tuple[list[Any], list[Any], list[bool], list[str], list[str]]:
        """Attitudes in the parents, places, of the first whether it is known; names of frames.

        And of their parents.
        """
        count = len(motion)
        if self._fit is None or self._placer is None:
            names = list(self._part.setup.layout.names)
            places = [[[_ASIDE_M * k, 0.0, 0.0] for k in range(len(names))]] * count
            q = motion.q_world_sensor.tolist()
            return q, places, [True] * count, names, [WORLD] * len(names)
        hand = self._placer.at(motion)
        parents = [WORLD if parent < 0 else SEGMENTS[parent] for parent in PARENTS]
        t = np.tile(self._fit.skeleton.t_parent_joint, (count, 1, 1))
        t[:, 0] = hand.t_frame_root
        q = in_parents(hand.q_frame_segment).tolist()
        return q, t.tolist(), hand.known.tolist(), list(SEGMENTS), parents

    def _degrees(self, motion: Motion) -> Array:
        if not self._names:
            return np.empty((len(motion), 0))
        degrees: Array = np.rad2deg(angles_of(self._part.setup, motion, self._part.angles))
        return degrees

    def _transforms(self, now: int, frames: list[tuple[Any, Any, str, str]]) -> Any:
        message = self._frames()
        stamp = _stamp(now)
        for (w, x, y, z), (a, b, c), child, parent in frames:
            frame = message.transforms.add(parent_frame_id=parent, child_frame_id=child)
            frame.timestamp.CopyFrom(stamp)
            rotation, place = frame.rotation, frame.translation
            rotation.w, rotation.x, rotation.y, rotation.z = w, x, y, z
            place.x, place.y, place.z = a, b, c
        return message

    def _drawn(self, skeleton: Skeleton, now: int) -> Any:
        """Bones that hang in the frames of the segments and so move with them: once is enough."""
        message = self._scene()
        for index, name in enumerate(SEGMENTS):
            entity = message.entities.add(frame_id=name, id=name, frame_locked=True)
            entity.timestamp.CopyFrom(_stamp(now))
            entity.lifetime.SetInParent()  # zero: for ever; foxglove's schemas want it said
            red, green, blue = (channel / 255.0 for channel in of_part(name))
            tip = tips(skeleton).get(index)
            carried = [skeleton.t_parent_joint[child] for child in CHILDREN[index]]
            bones = entity.lines.add(type=2, thickness=_THICK_M)  # a list of pairs of points
            for end in carried if tip is None else [*carried, tip]:
                bones.points.add()
                bones.points.add(x=end[0], y=end[1], z=end[2])
            ball = entity.spheres.add()
            ball.pose.orientation.w = bones.pose.orientation.w = 1.0
            for pose in (ball.pose, bones.pose):
                pose.position.SetInParent()
            ball.size.x = ball.size.y = ball.size.z = _BALL_M
            for colour in (bones.color, ball.color):
                colour.r, colour.g, colour.b, colour.a = red, green, blue, 1.0
        return message

    def _send(self, channel: int, now: int, message: Any) -> None:
        data = message.SerializeToString()
        self._writer.add_message(channel, log_time=now, data=data, publish_time=now)

    def _channel(self, topic: str, message: Any) -> int:
        described = descriptor_pb2.FileDescriptorSet()
        _describe(message.DESCRIPTOR.file, described, set())
        name, data = message.DESCRIPTOR.full_name, described.SerializeToString()
        schema = self._writer.register_schema(name, "protobuf", data)
        return self._writer.register_channel(topic, "protobuf", schema)


def _message(name: str, fields: list[str]) -> Any:
    """A kind of message with a number for each name."""
    file = descriptor_pb2.FileDescriptorProto(
        name=f"handstudio/{name}.proto", package="handstudio", syntax="proto3"
    )
    told = file.message_type.add(name=name)
    number = descriptor_pb2.FieldDescriptorProto
    for index, field in enumerate(fields, start=1):
        told.field.add(
            name=field, number=index, type=number.TYPE_DOUBLE, label=number.LABEL_OPTIONAL
        )
    pool = descriptor_pool.DescriptorPool()  # its own: another take has other angles
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"handstudio.{name}"))


def _describe(file: FileDescriptor, into: descriptor_pb2.FileDescriptorSet, seen: set[str]) -> None:
    """A file of kinds of messages and, before it, those it needs."""
    if file.name in seen:
        return
    seen.add(file.name)
    for needed in file.dependencies:
        _describe(needed, into, seen)
    file.CopyToProto(into.file.add())


def _stamp(ns: int) -> Timestamp:
    return Timestamp(seconds=ns // 1_000_000_000, nanos=ns % 1_000_000_000)
