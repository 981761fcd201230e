"""Arguments that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

Sessions = Annotated[
    Path | None, tyro.conf.arg(help="Folder of the takes (default: ./sessions in a checkout)")
]
Json = Annotated[bool, tyro.conf.arg(help="Print JSON for a program instead of words")]
TakeFile = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="TAKE.mcap")]
