"""A motion to a file of some format, with what is known of it beside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec

from handstudio.export import metadata
from handstudio.export.formats import Format
from handstudio.export.part import PLACED, Content, Part, Processed, Window, cut
from handstudio.export.whole import written_whole


def export(
    source: Processed,
    target: Path,
    chosen: Format,
    *,
    content: Content | None = None,
    window: Window | None = None,
    angles: tuple[str, ...] = (),
    progress: Callable[[float], None] = lambda _share: None,
) -> Path:
    """Write a file and its sidecar (``NAME.csv.json``), both whole or not at all.

    Args:
        source: The take and its motion.
        target: The file; what was there is replaced.
        chosen: Its format.
        content: What of the motion; the format's first unless given.
        window: The part of the take; all of it unless given.
        angles: Names of those that are wanted, where the file holds angles; all unless given.
        progress: Told the share that is written.

    Raises:
        TakeError: the window is empty, the take has no hand where one is needed or not these
            angles, or the file cannot be written.
    """
    setup, start_us = source.setup, int(source.motion.time_us[0]) if len(source.motion) else 0
    kind = chosen.content(content, setup.layout)
    motion = cut(source.motion, window or Window())
    start_utc_ns = source.take.header.start_utc_ns
    root = source.root if kind in PLACED else None
    part = Part(setup, motion, start_us, start_utc_ns, kind, {}, angles, progress, root)
    about = source.about | metadata.of_part(setup, motion, start_us, kind) | chosen.facts(part)
    if root is not None:
        about |= metadata.of_root(root, motion)
    part = replace(part, about=about)
    sidecar = msgspec.json.format(msgspec.json.encode(about))
    with written_whole(target, sidecar) as file:
        chosen.write(part, file)
    return target
