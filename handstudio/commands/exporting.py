"""Takes, or folders of them, to files of one or several formats."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
import tyro

from handstudio.commands import calibration as calibration_commands
from handstudio.commands.aligning import aligned
from handstudio.commands.arguments import Json
from handstudio.errors import HandstudioError, TakeError
from handstudio.export.export import export as export_file
from handstudio.export.formats import FORMATS, Format
from handstudio.export.metadata import missing
from handstudio.export.part import Processed, Window
from handstudio.process import process
from handstudio.recording.naming import TAKE, UNFINISHED, VIEW
from handstudio.recording.take import Take, open_take
from handstudio.setup import Setup, filter_named, smoothing
from handstudio.shell import err, out, print_error, print_json, progress

FormatName: TypeAlias = Literal[
    "csv", "parquet", "mot", "sto", "trc", "c3d", "bvh", "glb", "glb-skin", "mcap", "svg"
]
TableContent: TypeAlias = Literal["angles", "orientations", "segments", "positions"]


@dataclass(frozen=True, slots=True)
class _Job:
    """What is made of every take."""

    formats: tuple[Format, ...]
    content: TableContent | None
    angles: tuple[str, ...]
    window: Window
    setup: Callable[[Take], Setup]
    written: set[Path] = field(default_factory=set)


@dataclass(slots=True)
class _Done:
    """What came of one take."""

    take: Path
    files: dict[str, Path] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    errors: list[HandstudioError] = field(default_factory=list)


def export(
    takes: Annotated[tuple[Path, ...], tyro.conf.Positional] = (),
    *,
    format: Annotated[tuple[FormatName, ...], tyro.conf.UseAppendAction] = (),
    content: TableContent | None = None,
    angles: tuple[str, ...] = (),
    to: Path | None = None,
    start_s: float = 0.0,
    end_s: float | None = None,
    filter: str | None = None,
    smooth: bool = False,
    calibration: str | None = None,
    sensors: str | None = None,
    align: bool = False,
    json: Json = False,
) -> int:
    """Write takes as files that other programs open, each with a sidecar JSON (docs/exports.md).

    Args:
        takes: The takes, or folders of takes with all that is below them.
        format: A format; again for another one. CSV unless given.
        content: What tables (csv, parquet) hold: joint angles, or orientations of sensors where
            there is no hand, unless given.
        angles: Only these joint angles, by their names.
        to: The file to write, or a folder to write into; beside each take unless given.
        start_s: Begin of the window, seconds from the take's first instant.
        end_s: End of the window; the end of the take unless given.
        filter: Another filter than the take was recorded with.
        smooth: Take in what came after every instant as well.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        align: Align the headings by the take's own quick start.
        json: Print JSON for a program instead of words.
    """

    def setup_of(take: Take) -> Setup:
        setup = calibration_commands.chosen(take.header.setup, calibration, sensors)
        setup = aligned(take, setup) if align else setup
        if filter is not None:
            setup = msgspec.structs.replace(setup, filter=filter_named(filter))
        return smoothing(setup) if smooth else setup

    formats = tuple(FORMATS[name] for name in dict.fromkeys(format or ("csv",)))
    job = _Job(formats, content, angles, Window(start_s, end_s), setup_of)
    paths = list(_paths(takes))
    single = len(paths) == 1 and not takes[0].is_dir()
    done: list[_Done] = []
    for number, (path, below) in enumerate(paths, start=1):
        words = path.name if single else f"{number}/{len(paths)} {below}"
        place = _place(below, to, one_file=single and len(formats) == 1)
        done.append(_done(path, job, place, words, quiet=json))
        if not json:
            _tell(done[-1], named=not single)
    if json:
        print_json([_told(each) for each in done])
    elif not single:
        _sum_up(done)
    return 1 if any(each.errors for each in done) else 0


def _paths(named: Sequence[Path]) -> Iterator[tuple[Path, Path]]:
    """Every take and every interrupted recording that is named or lies in a folder that is.

    Second how it lies in that folder.
    """
    if not named:
        raise TakeError("No take was named.", "Name them: handstudio export TAKE.mcap ...")
    for one in named:
        if not one.is_dir():
            yield one, Path(one.name)
            continue
        found = sorted(path for path in one.rglob("*") if _is_take(path.relative_to(one)))
        if not found:
            raise TakeError(
                "{folder}: there is no take in it.", "Choose a folder with takes.", folder=one
            )
        yield from ((path, path.relative_to(one)) for path in found)


def _is_take(below: Path) -> bool:
    name = below.name
    hidden = any(part.startswith(".") for part in below.parts)
    return name.endswith((TAKE, TAKE + UNFINISHED)) and not (hidden or name.endswith(VIEW))


def _place(below: Path, to: Path | None, one_file: bool) -> Callable[[Path], Path]:
    """From the place beside a take to the one that is wanted."""
    if to is None:
        return lambda beside: beside
    if one_file and not to.is_dir():
        return lambda _beside: to
    return lambda beside: to / below.parent / beside.name


def _done(path: Path, job: _Job, place: Callable[[Path], Path], words: str, quiet: bool) -> _Done:
    """All formats of one take; what goes wrong is kept, and the rest goes on."""
    done = _Done(path)
    try:
        take = open_take(path)
        setup = job.setup(take)
        with progress(words, quiet) as share:
            source = Processed(take, setup, process(take, setup, progress=share))
            for chosen in job.formats:
                try:
                    done.files[chosen.name] = _written(source, chosen, job, place, share)
                except Exception as error:  # of one format: the others may do
                    done.errors.append(_known(error, path))
        if done.files:
            done.missing = missing(setup, source.motion)
    except Exception as error:  # of one take: the others have nothing to do with it
        done.errors.append(_known(error, path))
    return done


def _written(
    source: Processed,
    chosen: Format,
    job: _Job,
    place: Callable[[Path], Path],
    share: Callable[[float], None],
) -> Path:
    content = chosen.content(job.content, source.setup.layout)
    target = place(chosen.target(source.take.path, content))
    if target in job.written:
        raise TakeError(
            "{path}: another take was just written there.",
            "Export them into different folders, or name a folder that holds both.",
            path=target,
        )
    export_file(
        source,
        target,
        chosen,
        content=content,
        window=job.window,
        angles=job.angles,
        progress=share,
    )
    job.written.add(target)
    return target


def _known(error: Exception, path: Path) -> HandstudioError:
    if isinstance(error, HandstudioError):
        return error
    return TakeError(
        "{path}: {reason}",
        "Try this take alone; if it fails again, send the diagnostics: handstudio diagnostics.",
        path=path,
        reason=repr(error),
    )


def _tell(done: _Done, named: bool) -> None:
    for file in done.files.values():
        out.print(str(file))
    for words in done.missing:
        err.print(f"{done.take.name}: {words}")
    for error in done.errors:
        if named and str(done.take) not in error.what:
            err.print(f"{done.take}:")
        print_error(error)


def _told(done: _Done) -> dict[str, Any]:
    return {
        "take": str(done.take),
        "files": {name: str(file) for name, file in done.files.items()},
        "missing": done.missing,
        "problems": [{"what": error.what, "remedy": error.remedy} for error in done.errors],
    }


def _sum_up(done: Sequence[_Done]) -> None:
    bad = [each for each in done if each.errors]
    files = sum(len(each.files) for each in done)
    err.print(f"{files} files of {len(done)} takes written.")
    if bad:
        err.print(f"Not everything of {len(bad)}: {', '.join(each.take.name for each in bad)}")
