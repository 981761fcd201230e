"""Frames: COBS(payload ++ CRC-32 ISO-HDLC) ++ 0x00, made and found again in any pieces of bytes."""

from __future__ import annotations

import struct
from typing import NamedTuple, TypeAlias

import msgspec
from cobs import cobs
from fastcrc import crc32

from handstudio.protocol.packets import Corruption, Reason

DELIMITER = b"\0"
MAX_FRAME = 1024
"""No frame is longer on the wire, its 0x00 included, in any version of the protocol."""

_LONGEST = MAX_FRAME - len(DELIMITER)
_CRC = struct.Struct("<I")


class Frame(NamedTuple):
    """A payload whose checksum was right, and what it took on the wire [bytes]."""

    payload: bytes
    size: int


class Framing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where in a stream of frames a reader is."""

    pending: bytes = b""  # after the last 0x00; never longer than the largest frame
    synchronised: bool = False  # a 0x00 was seen
    overlong: bool = False  # the beginning of what is pending was given up already


Found: TypeAlias = Frame | Corruption


def frame(payload: bytes) -> bytes:
    """Wire bytes of a payload, checksum and delimiter included.

    Raises:
        ValueError: the payload is too long for any frame.
    """
    encoded = bytes(cobs.encode(payload + _CRC.pack(crc32.iso_hdlc(payload))))
    if len(encoded) > _LONGEST:
        raise ValueError(f"a payload of {len(payload)} bytes does not fit a frame of {MAX_FRAME}")
    return encoded + DELIMITER


def unframe(state: Framing, chunk: bytes) -> tuple[Framing, list[Found]]:
    """Take the next bytes of a stream; what comes out does not depend on how it was cut up.

    Every byte is part of a frame, of a corruption, of an empty frame (which means nothing), or
    still pending. Exempt is what stands before the first 0x00 of a stream: it may be the tail of
    a frame whose head nobody heard, so it is used when it is whole and passed over when not.
    """
    *fragments, pending = (state.pending + chunk).split(DELIMITER)
    found: list[Found] = []
    overlong, synchronised = state.overlong, state.synchronised
    for fragment in fragments:
        rest, cuts = _cut(fragment)
        found += cuts
        if overlong or cuts:
            found.append(Corruption(Reason.OVERLONG, len(rest) + 1))
        elif rest:
            one = _opened(rest)
            if synchronised or isinstance(one, Frame):
                found.append(one)
        overlong, synchronised = False, True
    pending, cuts = _cut(pending)
    return Framing(pending, synchronised, overlong or bool(cuts)), found + cuts


def _cut(fragment: bytes) -> tuple[bytes, list[Found]]:
    """Give up the beginning of a fragment that is longer than any frame, a frame's length each."""
    cuts: list[Found] = []
    while len(fragment) > _LONGEST:
        cuts.append(Corruption(Reason.OVERLONG, _LONGEST))
        fragment = fragment[_LONGEST:]
    return fragment, cuts


def _opened(encoded: bytes) -> Found:
    size = len(encoded) + len(DELIMITER)
    try:
        data = _decoded(encoded)
    except cobs.DecodeError:
        return Corruption(Reason.FRAMING, size)
    if len(data) <= _CRC.size:
        return Corruption(Reason.LENGTH, size)
    payload = data[: -_CRC.size]
    if _CRC.pack(crc32.iso_hdlc(payload)) != data[-_CRC.size :]:
        return Corruption(Reason.CHECKSUM, size)
    return Frame(payload, size)


_FULL = 255  # a length code that no zero follows


def _decoded(encoded: bytes) -> bytes:
    """`cobs.decode` of what holds no zero: length codes stand where the zeros belong.

    The package decodes in plain Python where it was not compiled, at ten times the cost.
    """
    data, at, size = bytearray(encoded), 0, len(encoded)
    while at < size:
        code = data[at]
        if code == _FULL:
            return bytes(cobs.decode(encoded))
        data[at] = 0
        at += code
    if at > size:
        raise cobs.DecodeError("a length code that leads beyond the end")
    return bytes(data[1:])
