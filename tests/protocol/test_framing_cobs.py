"""Our reading of COBS, against the package that writes it."""

from __future__ import annotations

from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from handstudio.protocol.framing import _decoded

PLAIN = st.binary(max_size=600)
RUNS = st.lists(st.integers(0, 255).flatmap(lambda n: st.just(b"\x01" * n + b"\0")), max_size=4)


@given(PLAIN | RUNS.map(b"".join))
def test_what_was_written_is_read(data):
    assert _decoded(cobs.encode(data)) == data


@given(st.binary(min_size=1, max_size=600).map(lambda data: data.replace(b"\0", b"\x01")))
def test_what_nobody_wrote_is_read_or_refused_as_by_the_package(encoded):
    def told(decode):
        try:
            return decode(encoded)
        except cobs.DecodeError:
            return None

    assert told(_decoded) == told(cobs.decode)
