"""MAKERS.md is true: its C code writes our bytes, its Python decoder keeps the laws."""

from __future__ import annotations

import random
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import handstudio.protocol
from handstudio.errors import TakeError
from handstudio.protocol.contract import check_decoder
from handstudio.protocol.decoder import Decoder, V1Decoder
from handstudio.protocol.framing import frame
from handstudio.protocol.packets import Corruption, ImuPacket, Packet, Restart

PAGES = Path(handstudio.protocol.__file__).parent
FRAMER = """
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
size_t frame(uint8_t *payload, size_t length, uint8_t *out);
int main(void)
{
    uint8_t payload[1100], out[1100], size[2];
    while (fread(size, 1, 2, stdin) == 2) {
        size_t length = size[0] | (size_t)size[1] << 8;
        if (fread(payload, 1, length, stdin) != length) return 1;
        fwrite(out, 1, frame(payload, length, out), stdout);
    }
    return 0;
}
"""


def block(name: str) -> str:
    text = (PAGES / "MAKERS.md").read_text(encoding="utf-8")
    (found,) = re.findall(rf"^```\w+ name={re.escape(name)}\n(.*?)^```$", text, re.M | re.S)
    return str(found)


@pytest.fixture
def compiler() -> list[str]:
    found = next(filter(None, map(shutil.which, ("gcc", "cc", "clang"))), None)
    if found is None:
        pytest.skip("no C compiler here: the C example of MAKERS.md is not tried")
    return [found, "-std=c99", "-O1", "-Wall", "-Wextra", "-Werror"]


def test_the_c_example_writes_the_frame_of_the_specification(
    compiler: list[str], tmp_path: Path
) -> None:
    (tmp_path / "imu_frame.c").write_text(block("imu_frame.c"), encoding="utf-8")
    run([*compiler, "imu_frame.c", "-o", "imu_frame"], tmp_path)
    wire = run([str(tmp_path / "imu_frame")], tmp_path)
    example = re.search(r"^```hex name=imu\n.*?^wire (.*?)```$", readme(), re.M | re.S)
    assert example is not None
    assert wire == bytes.fromhex("".join(example[1].split()))
    (packet,) = V1Decoder().feed(wire)
    assert isinstance(packet, ImuPacket)


def test_the_c_example_frames_every_payload_as_we_do(compiler: list[str], tmp_path: Path) -> None:
    (tmp_path / "imu_frame.c").write_text(block("imu_frame.c"), encoding="utf-8")
    (tmp_path / "framer.c").write_text(FRAMER, encoding="utf-8")
    run([*compiler, "-Dmain=unused_main", "-c", "imu_frame.c", "-o", "imu_frame.o"], tmp_path)
    run([*compiler, "framer.c", "imu_frame.o", "-o", "framer"], tmp_path)
    rng = random.Random(3)
    lengths = [*range(1, 12), *range(245, 260), *range(500, 515), 826, 1000]
    payloads = [rng.randbytes(n) for n in lengths]
    payloads += [bytes(rng.choices(range(1, 256), k=n)) for n in lengths]
    payloads += [bytes(n) for n in lengths]
    sent = b"".join(len(p).to_bytes(2, "little") + p for p in payloads)
    assert run([str(tmp_path / "framer")], tmp_path, sent) == b"".join(map(frame, payloads))


@pytest.fixture
def lines(tmp_path: Path) -> Iterator[ModuleType]:
    """The module that MAKERS.md shows."""
    module = ModuleType("handstudio_makers_lines")
    sys.modules[module.__name__] = module  # msgspec looks its types up there
    exec(compile(block("lines.py"), "MAKERS.md", "exec"), module.__dict__)
    yield module
    del sys.modules[module.__name__]


def line(time_ms: int, *counts: int) -> bytes:
    return b"%d %s %d\n" % (time_ms, b" ".join(b"%d" % c for c in counts), time_ms + sum(counts))


def test_the_foreign_decoder_keeps_the_laws_and_reads_its_glove(lines: ModuleType) -> None:
    kind: type[Decoder] = lines.LineDecoder
    rng = random.Random(4)
    said = [line(k * 10, *(rng.randrange(-32768, 32768) for _ in range(6))) for k in range(60)]
    packets = check_decoder(kind, b"".join(said))
    assert packets[0] == lines.ABOUT
    assert [p.clock_us for p in packets[1:] if isinstance(p, ImuPacket)] == [
        k * 10_000 for k in range(60)
    ]


def test_the_foreign_decoder_tells_damage_and_restarts(lines: ModuleType) -> None:
    page = re.search(r"^    (1250 .*)$", (PAGES / "MAKERS.md").read_text("utf-8"), re.M)
    assert page is not None
    decoder = lines.LineDecoder()
    kinds = [type(p) for p in decoder.feed(page[1].encode() + b"\n")]
    assert kinds == [type(lines.ABOUT), ImuPacket]
    bad = (
        b"\n",
        b"hello\n",
        b"1260 1 2 3 4 5 6 7\n",
        line(1270, 40000, 0, 0, 0, 0, 0),
        b"9" * 5000,
    )
    for said in (*bad, b"\n"):
        packets: list[Packet] = decoder.feed(said)
        assert all(isinstance(p, Corruption) for p in packets)
        assert len(packets) == said.count(b"\n")
    assert [type(p) for p in decoder.feed(line(10, 0, 0, 1, 0, 0, 0))] == [Restart, ImuPacket]
    with pytest.raises(TakeError):
        lines.LineDecoder.restore(V1Decoder().save())


def readme() -> str:
    return (PAGES / "README.md").read_text(encoding="utf-8")


def run(command: list[str], folder: Path, given: bytes = b"") -> bytes:
    done = subprocess.run(command, cwd=folder, input=given, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout
