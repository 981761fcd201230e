"""CSV: one header row with units in the names, ``time_s`` first."""

from __future__ import annotations

from typing import BinaryIO

from handstudio.export.part import Part
from handstudio.export.tables import table_of


def write(part: Part, file: BinaryIO) -> None:
    """Write the table, and how many sensors were in doubt."""
    import pyarrow as pa  # noqa: PLC0415 - takes a while to load
    import pyarrow.csv  # noqa: PLC0415

    table = table_of(part)
    options = pa.csv.WriteOptions(include_header=True, quoting_style="none")
    names = ["time_s", *table.names, "doubtful_sensors"]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pa.csv.CSVWriter(file, schema, write_options=options) as writer:
        for block in part.blocks():
            doubtful = (block.doubt != 0).sum(axis=1).astype(float)
            columns = (part.seconds(block), *table.rounded(block).T, doubtful)
            writer.write_table(pa.table([pa.array(c) for c in columns], schema=schema))
