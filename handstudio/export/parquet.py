"""Parquet: the columns of the CSV with all their digits, the metadata inside the file."""

from __future__ import annotations

from typing import BinaryIO

import msgspec

from handstudio.export.part import Part
from handstudio.export.tables import table_of

KEY = b"handstudio"
"""Of the schema's metadata: all there is to tell, JSON."""


def write(part: Part, file: BinaryIO) -> None:
    """Write the table, and how many sensors were in doubt."""
    import pyarrow as pa  # noqa: PLC0415 - takes a while to load
    import pyarrow.parquet  # noqa: PLC0415

    table = table_of(part)
    fields = [(name, pa.float64()) for name in ("time_s", *table.names)]
    about = {KEY: msgspec.json.encode(part.about)}
    schema = pa.schema([*fields, ("doubtful_sensors", pa.uint8())], metadata=about)
    with pa.parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for block in part.blocks():
            doubtful = (block.doubt != 0).sum(axis=1).astype("u1")
            columns = (part.seconds(block), *table.values(block).T, doubtful)
            writer.write_table(pa.table([pa.array(c) for c in columns], schema=schema))
