"""The command that measures a take."""

from __future__ import annotations

from pathlib import Path

import msgspec

from handstudio.analysis.change import Change
from handstudio.analysis.measure import Kind, Measure
from handstudio.analysis.posture_time import DEFAULT_BANDS
from handstudio.analysis.sides import SideRatio, percent
from handstudio.analysis.tables import Group, GroupName, Row, grouped, judged, signed, written
from handstudio.commands import calibration as calibration_commands
from handstudio.commands.arguments import Json, TakeFile
from handstudio.errors import TakeError
from handstudio.export.part import Window
from handstudio.measure import Measured, band_of
from handstudio.measure import measure as measure_take
from handstudio.recording.take import open_take
from handstudio.setup import smoothing
from handstudio.shell import out, print_json, print_table, progress

_TITLES: dict[GroupName, str] = {
    "range": "Active range of motion [deg]",
    "scores": "Scores of fingers",
    "opposition": "Opposition of the thumb",
    "repetitions": "Repetitions",
    "speed": "Speed and smoothness",
    "tremor": "Tremor, 3 to 12 Hz, of joints that were held",
    "independence": "Finger independence (1: the others stay still)",
    "posture": "Time in posture [%]",
}

_COLUMNS: dict[Kind, str] = {
    "least": "from",
    "most": "to",
    "range": "range",
    "tam": "TAM [deg]",
    "strickland": "Strickland [%]",
    "kapandji": "Kapandji, 0 to 10",
    "pronation": "pronation there [deg]",
    "cycles": "times",
    "cycle_amplitude": "amplitude [deg]",
    "cycle_amplitude_cv": "varies by [%]",
    "cycle_period": "period [s]",
    "cycle_period_cv": "varies by [%]",
    "peak_speed": "peak [deg/s]",
    "mean_speed": "mean [deg/s]",
    "sparc": "SPARC",
    "ldlj": "LDLJ",
    "tremor_amplitude": "RMS [deg]",
    "tremor_frequency": "peak [Hz]",
    "individuation": "individuation",
    "stationarity": "stationarity",
    "time_in_posture": "time [%]",
}

_WHY = {
    "no_hand": "the take is of no hand",
    "no_sensor": "no sensor",
    "in_doubt": "in doubt throughout",
    "no_start": "no rest to count from",
    "no_calibration": "needs a calibration of the hand",
    "too_short": "too short",
    "gaps": "too many gaps",
    "no_movement": "no such movement",
    "no_peak": "no peak",
    "moving": "never held still",
}


def measure(
    take: TakeFile,
    *,
    earlier: Path | None = None,
    other_side: Path | None = None,
    start_s: float = 0.0,
    end_s: float | None = None,
    posture: tuple[str, ...] = (),
    smooth: bool = False,
    calibration: str | None = None,
    sensors: str | None = None,
    json_file: Path | None = None,
    json: Json = False,
) -> int:
    """Measure ranges of motion, scores, repetitions, speed, smoothness, tremor, time in posture.

    Args:
        take: The take.
        earlier: A take of an earlier visit of the same hand, to compare with.
        other_side: A take of the other hand of the same person: ranges and scores as shares of its.
        start_s: Begin of the part, seconds from the take's first instant.
        end_s: End of the part; the end of the take unless given.
        posture: Postures whose time is counted instead of the usual, as NAME=ANGLE:FROM:TO [deg];
            an end may be empty.
        smooth: Take in what came after every instant as well: the tree filter's smoother.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        json_file: Also write everything to this file, as JSON.
        json: Print JSON for a program instead of words.
    """
    opened = open_take(take)
    setup = calibration_commands.chosen(opened.header.setup, calibration, sensors)
    if smooth:
        setup = smoothing(setup)
    bands = tuple(band_of(text) for text in posture) or DEFAULT_BANDS
    with progress(take.name, quiet=json) as share:
        found = measure_take(
            opened,
            setup,
            Window(start_s, end_s),
            earlier=None if earlier is None else open_take(earlier),
            other_side=None if other_side is None else open_take(other_side),
            bands=bands,
            progress=share,
        )
    if json_file is not None:
        _write(json_file, found)
    if json:
        print_json(msgspec.to_builtins(found))
    else:
        show(found)
    return 0


def show(found: Measured) -> None:
    """The measures as tables."""
    visit = found.visit
    out.print(
        f"{visit.take}: {visit.subject}, {visit.side} hand, {visit.start_s:.2f} to "
        f"{visit.end_s:.2f} s, {visit.known_percent:.0f} % of all angles known"
    )
    out.print(f"calibration: {visit.calibration}; zero: {visit.zero}; filter: {visit.filter}")
    if found.earlier is not None:
        out.print(f"compared with {found.earlier.take} of {found.earlier.visit}")
    if found.other_side is not None:
        out.print(f"the other hand: {found.other_side.take} of {found.other_side.visit}")
    out.print("± one standard uncertainty; docs/measures.md says what each measure is\n")
    known = {(change.kind, change.about): change for change in found.changes}
    sides = {(ratio.kind, ratio.about): ratio for ratio in found.sides}
    for group in grouped(found.measures):
        _show(group, known, sides)


def _show(
    group: Group,
    known: dict[tuple[Kind, str], Change],
    sides: dict[tuple[Kind, str], SideRatio],
) -> None:
    compared = any(judged(row, known) for row in group.rows)
    normal = any(m.norm is not None for row in group.rows for m in row.cells.values())
    columns = ["", *(_COLUMNS[kind] for kind in group.kinds)]
    columns += ["normal"] if normal else []
    columns += ["change"] if compared else []
    ratios = [_ratios(row, sides) for row in group.rows]
    columns += ["of the other hand"] if any(ratios) else []
    rows = []
    for row, ratio in zip(group.rows, ratios, strict=True):
        cells = [row.about, *(_cell(row, kind) for kind in group.kinds)]
        cells += [_normal(row)] if normal else []
        cells += [_changed(row, known)] if compared else []
        cells += [ratio] if any(ratios) else []
        rows.append(cells)
    print_table(_TITLES[group.name], columns, rows)
    out.print("")


def _cell(row: Row, kind: Kind) -> str:
    measure = row.cells.get(kind)
    if measure is None:
        return ""
    if measure.value is None:
        return f"– ({_WHY[measure.why]})"
    grade = f" {measure.grade}" if measure.grade else ""
    return written(measure) + grade


def _normal(row: Row) -> str:
    norms = [measure.norm for measure in row.cells.values() if measure.norm is not None]
    kept = [f"{norm:.0f}" for norm in norms]
    ends: list[Measure | None] = [row.cells.get("least"), row.cells.get("most")]
    if all(end is not None and end.norm is not None for end in ends):
        return f"{kept[0]} to {kept[1]}"
    return ", ".join(kept)


def _changed(row: Row, known: dict[tuple[Kind, str], Change]) -> str:
    found = judged(row, known)
    beyond = [change for change in found if change.verdict in ("more", "less")]
    if beyond:
        return ", ".join(f"{_COLUMNS[change.kind]} {signed(change)}" for change in beyond)
    return "no detectable change" if found else ""


def _ratios(row: Row, sides: dict[tuple[Kind, str], SideRatio]) -> str:
    found = [sides[kind, row.about] for kind in row.cells if (kind, row.about) in sides]
    return ", ".join(f"{percent(ratio)} {ratio.grade}".strip() for ratio in found)


def _write(path: Path, found: Measured) -> None:
    try:
        path.write_bytes(msgspec.json.format(msgspec.json.encode(found)) + b"\n")
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Choose another folder, or another name.",
            path=path,
            reason=error.strerror or error,
        ) from error
