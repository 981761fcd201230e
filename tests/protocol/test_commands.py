"""The device's side: what a host asks, and what was no question."""

from __future__ import annotations

import random

import pytest

from handstudio.protocol import commands
from handstudio.protocol.codec import encode
from handstudio.protocol.contract import pieces
from handstudio.protocol.decoder import CommandDecoder
from handstudio.protocol.packets import Command, Corruption, Reason, Reply, Request

ASKED = [
    Request(Command.DESCRIBE, 0),
    Request(Command.START, 1),
    commands.set_rate(2, 500),
    commands.blink(3, 21, 0),
    Request(Command.STOP, 4),
    Request(0xDF, 255, bytes(255)),
    Request(0xFF, 0, b"nobody knows this one"),
]


@pytest.mark.parametrize("seed", range(20))
def test_commands_in_any_pieces_are_the_same_commands(seed: int) -> None:
    decoder, stream = CommandDecoder(), b"\0" + b"".join(map(encode, ASKED))
    cut = [one for piece in pieces(stream, random.Random(seed)) for one in decoder.feed(piece)]
    assert cut == ASKED


def test_a_damaged_command_is_told_and_the_next_is_heard() -> None:
    wire = bytearray(encode(ASKED[2]))
    wire[2] ^= 0x40
    read = CommandDecoder().feed(b"\0" + bytes(wire) + encode(ASKED[0]))
    assert read == [Corruption(Reason.CHECKSUM, len(wire)), ASKED[0]]


def test_a_packet_of_a_device_is_no_command() -> None:
    wire = encode(Reply(0x80, 0, 0, ""))
    assert CommandDecoder().feed(wire) == [Corruption(Reason.UNKNOWN_TYPE, len(wire))]


def test_arguments_are_read_as_they_were_written() -> None:
    assert commands.rate_asked(commands.set_rate(9, 65535)) == 65535
    assert commands.blink_asked(commands.blink(9, 20, 300)) == (20, 300)


@pytest.mark.parametrize("argument", [b"", b"\1", b"\1\2\3\4"])
def test_an_argument_of_another_length_is_none(argument: bytes) -> None:
    assert commands.rate_asked(Request(Command.SET_RATE, 0, argument)) is None
    assert commands.blink_asked(Request(Command.BLINK, 0, argument)) is None


def test_what_does_not_fit_an_argument_is_not_asked() -> None:
    for rate in (-1, 65536):
        with pytest.raises(ValueError, match="do not fit"):
            commands.set_rate(0, rate)
    with pytest.raises(ValueError, match="do not fit"):
        commands.blink(0, 256, 0)
