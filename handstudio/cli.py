"""The shell: ``handstudio COMMAND``; every command explains itself with ``--help``."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import tyro

from handstudio.calibration.correction import CorrectionFilter
from handstudio.commands import calibration as calibration_commands
from handstudio.commands import exporting, keeping, sharing, tracking
from handstudio.commands import virtual as virtual_commands
from handstudio.commands.aligning import aligned
from handstudio.commands.arguments import Json, Sessions, TakeFile
from handstudio.commands.checking import check
from handstudio.commands.grasping import grasps
from handstudio.commands.joints import joints
from handstudio.commands.measuring import measure
from handstudio.commands.noise import noise
from handstudio.commands.writing import trace
from handstudio.device import find
from handstudio.device.capture import Capture
from handstudio.device.orders import Connect, Newest, Phase, StartTake, StopTake
from handstudio.errors import DeviceError, HandstudioError, SetupError, TakeError
from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Processed, Window
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M, HandType
from handstudio.health.record import TakeHealth
from handstudio.process import process as process_take
from handstudio.recording import library
from handstudio.recording.header import Header
from handstudio.recording.recovery import recover as recover_file
from handstudio.recording.subjects import HAND_MM
from handstudio.recording.take import Take, open_take
from handstudio.recording.take_health import health_of_take
from handstudio.settings import load_settings, settings_path
from handstudio.setup import HandModel, divided, filter_named, smoothing
from handstudio.shell import err, out, print_error, print_json, print_table, progress

CONNECT_S = 25.0

TOKEN_VARIABLE = "HANDSTUDIO_TOKEN"
"""Environment variable with the token that visitors of the page need."""


def studio(
    *,
    virtual: bool = False,
    connect: str | None = None,
    host: str = "127.0.0.1",
    port: int = 8765,
    token: str | None = None,
    sessions: Sessions = None,
    browser: bool = True,
    language: Literal["en", "ja"] | None = None,
) -> int:
    """Open the studio in the browser, for this machine only unless told otherwise.

    Args:
        virtual: Begin with the virtual glove.
        connect: Begin with this device (serial:/dev/ttyACM0, tcp:HOST:PORT, replay:TAKE.mcap).
        host: Serve there: 0.0.0.0 for the whole network, or an address of this machine. Visitors
            then need the link that is shown (docs/lan.md).
        port: Port of the page; the next free one is taken where this is in use.
        token: What the link must hold, 16 characters or more; one is made for any host but
            loopback. Others on this machine see arguments: HANDSTUDIO_TOKEN is the better way.
        sessions: Folder of the takes.
        browser: Open the page in the browser.
        language: English or Japanese; unless given the one chosen on the page before, else the
            browser's, else the system's.
    """
    from app import words  # noqa: PLC0415 - the page's libraries only where it is wanted
    from app.__main__ import Options, run  # noqa: PLC0415
    from app.door import guard  # noqa: PLC0415

    address = connect or ("virtual:" if virtual else None)
    words.use_language(language)
    from_environment = os.environ.pop(TOKEN_VARIABLE, None)  # what we start need not have it
    chosen = token if token is not None else from_environment or None
    return run(
        Options(
            library.sessions_folder(sessions),
            address=address,
            port=port,
            browser=browser,
            host=host,
            token=None if chosen is None else guard.checked_token(chosen),
            language=language,
        )
    )


def devices(*, json: Json = False) -> int:
    """List the devices that could be connected, and ask each port who is there."""
    found = [*(find.probe(port.address) for port in find.ports()), find.VIRTUAL]
    if json:
        print_json([asdict(one) for one in found])
        return 0
    rows = [[one.address, one.label, one.problem or "ready"] for one in found]
    print_table("Devices", ["address", "what it is", "state"], rows)
    out.print("\nConnect with: handstudio studio --connect ADDRESS")
    return 0


def record(
    address: Annotated[str, tyro.conf.Positional],
    *,
    seconds: float | None = None,
    subject: str = "S01",
    visit: str = "",
    name: str = "take",
    hand_length_mm: float = ADULT_HAND_LENGTH_M * 1e3,
    tracker: str | None = None,
    terminal: str = "",
    sensor: str = "",
    lever_mm: tuple[float, float, float] | None = None,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """Record a take without the page. Ctrl-C ends it; nothing is lost.

    Args:
        address: The device (handstudio devices lists them; virtual: is always there).
        seconds: How long; until Ctrl-C unless given.
        subject: Code of the person.
        visit: Name of the visit; the day unless given.
        name: Name of the take.
        hand_length_mm: Wrist crease to the tip of the middle finger.
        tracker: A tracker whose poses go into the take: lsl:NAME, a stream of the Lab Streaming
            Layer (docs/late-trackers.md).
        terminal: Which of its terminals; the first unless given.
        sensor: The sensor of the glove that it sits on; found from the motion unless given.
        lever_mm: Where it sits, along x, y and z of that sensor; found from fast movements unless
            given.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    if seconds is not None and not seconds > 0.0:
        raise TakeError(
            "A take of {seconds:g} s holds nothing.", "Choose more than 0 seconds.", seconds=seconds
        )
    hand = _hand(hand_length_mm)
    path = library.new_take_path(
        library.sessions_folder(sessions), subject, name, datetime.now().astimezone(), visit
    )
    capture = Capture()
    reader = tracking.reader_of(capture, tracker, terminal, sensor, lever_mm)
    capture.start()
    try:
        with _ended_by_signals():
            capture.send(Connect(address, hand))
            _await_stream(capture)
            if reader is not None:
                tracking.await_poses(reader)
            capture.send(StartTake(path, subject))
            _record_for(capture, seconds, json)
    finally:
        capture.send(StopTake())
        capture.stop()
        if reader is not None:
            reader.end()
            reader.join()
    _raise_what_failed(capture)
    return _tell_take(open_take(path), json)


def info(take: TakeFile, *, health: bool = False, json: Json = False) -> int:
    """Say what a take holds, and how its stream and sensors did.

    Args:
        take: The take.
        health: Compute how stream and sensors did where it was not kept (recovered or older takes).
        json: Print JSON for a program instead of words.
    """
    opened = open_take(take)
    return _tell_take(opened, json, health_of_take(opened) if health else None)


def process(
    takes: Annotated[tuple[Path, ...], tyro.conf.Positional],
    *,
    filter: str | None = None,
    smooth: bool = False,
    correction: bool = False,
    hand_type: HandType | None = None,
    from_start: bool = False,
    calibration: str | None = None,
    sensors: str | None = None,
    align: bool = False,
    csv: bool = False,
    json: Json = False,
) -> int:
    """Fuse takes to motion; the result is kept beside each take and found there next time.

    Args:
        takes: The takes.
        filter: Another filter than the take was recorded with (tree, vqf, raw, filter1 to
            filter4).
        smooth: Take in what came after every instant as well: the tree filter's smoother.
        correction: Filter what each sensor puts out before fusion, as the thesis does (a low-pass).
        hand_type: How the palm is divided: 1, one block; 2, two from the wrist; 3, one hinged to
            the other. As in the take, or its calibration, unless given.
        from_start: Ignore what the studio knew before the first byte of the take.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
        align: Align the headings by the take's own quick start.
        csv: Also write the joint angles (orientations, where there is no hand) beside each take.
        json: Print JSON for a program instead of words.
    """
    if not takes:
        raise TakeError("No take was named.", "Name them: handstudio process TAKE.mcap ...")
    results = []
    for path in takes:
        take = open_take(path)
        setup = calibration_commands.chosen(take.header.setup, calibration, sensors)
        if hand_type is not None:
            setup = divided(setup, hand_type)
        if align:
            setup = aligned(take, setup)
        if filter is not None:
            setup = msgspec.structs.replace(setup, filter=filter_named(filter))
        if correction:
            setup = msgspec.structs.replace(setup, correction=CorrectionFilter())
        if smooth:
            setup = smoothing(setup)
        with progress(path.name, quiet=json) as share:
            motion = process_take(take, setup, from_start=from_start, progress=share)
        if not json:
            tracking.tell_place(take, setup, motion)
        result: dict[str, Any] = {"take": str(path), "instants": len(motion)}
        if csv:
            table = FORMATS["csv"]
            content = table.content(None, setup.layout)
            source = Processed(take, setup, motion)
            result["csv"] = str(export(source, table.target(path, content), table))
        results.append(result)
    if json:
        print_json(results)
    else:
        for result in results:
            out.print("  ".join(str(value) for value in result.values()))
    return 0


def report(
    take: TakeFile,
    *,
    earlier: Path | None = None,
    other_side: Path | None = None,
    language: Literal["en", "ja"] = "en",
    pdf: bool = False,
    to: Path | None = None,
    start_s: float = 0.0,
    end_s: float | None = None,
    smooth: bool = False,
    calibration: str | None = None,
    sensors: str | None = None,
) -> int:
    """Write a report: one HTML page with measures, plots, a replay and the calibration, offline.

    Args:
        take: The take.
        earlier: A take of an earlier visit of the same hand, to compare with.
        other_side: A take of the other hand of the same person: ranges and scores as shares of its.
        language: English or Japanese.
        pdf: Also print it to PDF, by a Chromium, Chrome or Edge of this machine.
        to: The file to write; beside the take unless given.
        start_s: Begin of the part, seconds from the take's first instant.
        end_s: End of the part; the end of the take unless given.
        smooth: Take in what came after every instant as well: the tree filter's smoother.
        calibration: File of another subject calibration than the take carries, or none.
        sensors: File of another calibration of the sensors than the take carries, or none.
    """
    from app.report import make, pdf as printing  # noqa: PLC0415, I001 - speaks the page's languages

    opened = open_take(take)
    setup = calibration_commands.chosen(opened.header.setup, calibration, sensors)
    if smooth:
        setup = smoothing(setup)
    with progress(take.name) as share:
        made = make.report_of(
            opened,
            setup,
            Window(start_s, end_s),
            earlier=None if earlier is None else open_take(earlier),
            other_side=None if other_side is None else open_take(other_side),
            language=language,
            progress=share,
        )
    page = make.save_report(made.html, to or make.report_path(take, language))
    out.print(str(page))
    if pdf:
        out.print(str(printing.save_pdf(page, page.with_suffix(".pdf"))))
    return 0


def import_(
    folder: Annotated[Path, tyro.conf.Positional],
    *,
    subject: str = "S01",
    name: str | None = None,
    hand_length_mm: float = ADULT_HAND_LENGTH_M * 1e3,
    sessions: Sessions = None,
) -> int:
    """Turn a folder of foreign recordings (docs/import.md) into a take.

    Args:
        folder: Holds samples.csv or samples.parquet; may hold labels, reference, layout.toml.
        subject: Code of the person.
        name: Name of the take; the folder's unless given.
        hand_length_mm: Wrist crease to the tip of the middle finger.
        sessions: Folder of the takes.
    """
    from handstudio.recording.raw_import import import_folder  # noqa: PLC0415 - takes a while

    hand = _hand(hand_length_mm)
    path = import_folder(folder, library.sessions_folder(sessions), subject, name, hand)
    out.print(str(path))
    return 0


def recover(file: Annotated[Path, tyro.conf.Positional], *, json: Json = False) -> int:
    """Get back all that was saved of an interrupted or damaged recording, as a new take.

    Args:
        file: The recording; it stays as it is.
        json: Print JSON for a program instead of words.
    """
    got = recover_file(file)
    if json:
        print_json({**asdict(got), "path": str(got.path)})
    else:
        out.print(f"{got.path}  {got.duration_s:.2f} s, {got.bytes} bytes")
    return 0


def diagnostics(*, output: Path | None = None, sessions: Sessions = None) -> int:
    """Write a file for whoever helps when something does not work; it says nothing of subjects.

    Args:
        output: The zip to write; in the folder one is in unless given.
        sessions: Folder of the takes.
    """
    from app import diagnostics as what  # noqa: PLC0415 - part of the studio

    target = output or Path(what.zip_name(datetime.now().astimezone()))
    folder = library.sessions_folder(sessions)
    takes = library.entries(folder)
    remembered = load_settings(settings_path()).settings
    content = what.make(
        Newest(),
        settings=msgspec.to_builtins(remembered),
        sessions=folder,
        takes=takes,
        names=(remembered.subject, remembered.take_name, remembered.visit),
    )
    try:
        with target.open("xb") as file:
            file.write(content)
    except FileExistsError as error:
        raise HandstudioError(
            "{path} is there already.", "Choose another name: --output FILE.", path=target
        ) from error
    except OSError as error:
        raise HandstudioError(
            "{path}: cannot be written ({reason}).",
            "Choose another place: --output FILE.",
            path=target,
            reason=error.strerror or error,
        ) from error
    out.print(str(target))
    return 0


COMMANDS: dict[str, Callable[..., int]] = {
    "studio": studio,
    "devices": devices,
    "record": record,
    "info": info,
    "process": process,
    "export": exporting.export,
    "measure": measure,
    "report": report,
    "trace": trace,
    "grasps": grasps,
    "import": import_,
    "recover": recover,
    "simulate": virtual_commands.simulate,
    "motions": virtual_commands.motions,
    "calibrate": calibration_commands.calibrate,
    "calibrations": calibration_commands.calibrations,
    "check": check,
    "mirror": calibration_commands.mirror,
    "calibrate-sensors": calibration_commands.calibrate_sensors,
    "noise": noise,
    "joints": joints,
    "takes": keeping.takes,
    "rename": keeping.rename,
    "trim": sharing.trim,
    "share": sharing.share,
    "add": sharing.add,
    "add-track": tracking.add_track,
    "bin": keeping.bin,
    "restore": keeping.restore,
    "subjects": keeping.subjects,
    "delete-subject": keeping.delete_subject,
    "diagnostics": diagnostics,
}


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the ``handstudio`` command."""
    try:
        code = tyro.extras.subcommand_cli_from_dict(
            COMMANDS,
            prog="handstudio",
            description="Capture, show and measure the motion of a hand. "
            "New here? handstudio studio --virtual",
            args=arguments,
        )
    except HandstudioError as error:
        print_error(error)
        code = 1
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)


def _hand(length_mm: float) -> HandModel:
    shortest, longest = HAND_MM
    if not shortest <= length_mm <= longest:
        raise SetupError(
            "A hand is not {length:g} mm long.",
            "Give it in millimetres, from the wrist crease to the tip of the middle finger: "
            "{shortest:g} to {longest:g}.",
            length=length_mm,
            shortest=shortest,
            longest=longest,
        )
    return HandModel(hand_length_m=length_mm * 1e-3)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """A shutdown or a closed terminal ends a take as Ctrl-C does."""
    names = [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    numbers = [number for name in names if _is_free(number := getattr(signal, name))]
    for number in numbers:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def _is_free(number: int) -> bool:
    return signal.getsignal(number) is signal.SIG_DFL  # nohup ignores a closed terminal


def _await_stream(capture: Capture) -> None:
    end = time.monotonic() + CONNECT_S
    while capture.newest.phase is not Phase.STREAMING:
        problem = capture.newest.problem
        if capture.newest.phase is Phase.FAILED and problem is not None:
            raise problem
        if time.monotonic() > end:
            raise DeviceError(
                "No data came within {seconds:.0f} s.",
                "Check the device: handstudio devices.",
                seconds=CONNECT_S,
            )
        time.sleep(0.02)


def _record_for(capture: Capture, seconds: float | None, quiet: bool) -> None:
    words = "recording, Ctrl-C ends it" if seconds is None else "recording"
    began = time.monotonic()
    with progress(words, quiet) as share:
        try:
            there = True
            while seconds is None or time.monotonic() - began < seconds:
                share((time.monotonic() - began) / seconds if seconds else 0.0)
                _raise_what_failed(capture)
                there = _tell_whether_there(capture.newest, there)
                time.sleep(0.05)
        except KeyboardInterrupt:
            err.print("Ending the take.")


def _tell_whether_there(newest: Newest, before: bool) -> bool:
    there = newest.phase is Phase.STREAMING
    if there != before:
        lost = f"{newest.address} is lost: looking for it. The take goes on when it is back."
        err.print(f"{newest.address} is back." if there else lost)
    return there


def _raise_what_failed(capture: Capture) -> None:
    for report in capture.reports():
        if isinstance(report, HandstudioError):
            raise report
    if capture.newest.phase is Phase.FAILED and capture.newest.problem is not None:
        raise capture.newest.problem


def _tell_take(take: Take, json: bool, health: TakeHealth | None = None) -> int:
    header, summary = take.header, take.summary
    if health is None and summary is not None:
        health = summary.health
    if json:
        told = {"path": str(take.path), "header": header, "summary": summary, "health": health}
        print_json(told)
        return 0
    rows = [[key, value] for key, value in _facts(header).items()]
    if summary is not None:
        lost = f"{summary.missing} of {summary.packets + summary.missing} instants"
        rows += [["duration", f"{summary.duration_s:.2f} s"], ["lost", lost]]
    rows += [["tracker", words] for words in tracking.tracks_in_words(take)]
    if health is not None:
        rows += [[key, value] for key, value in _health_facts(health, header).items()]
    print_table(str(take.path), ["", ""], rows)
    return 0


def _health_facts(health: TakeHealth, header: Header) -> dict[str, str]:
    facts = {}
    if health.measured_rate_hz is not None:
        facts["measured rate"] = f"{health.measured_rate_hz:.2f} Hz"
    if health.jitter_p95_ms is not None:
        facts["jitter"] = f"95 % of the chunks within {health.jitter_p95_ms:.1f} ms"
    for name, latency in (("latency", health.latency), ("to the page and back", health.page)):
        if latency is not None:
            facts[name] = (
                f"50 % {latency.p50_ms:.1f} ms, 99 % {latency.p99_ms:.1f} ms, "
                f"longest {latency.max_ms:.1f} ms"
            )
    facts["damaged, dropped by device, restarts"] = (
        f"{health.damaged}, {health.dropped_by_device}, {health.restarts}"
    )
    names = header.setup.layout.names
    for trouble in health.troubles:
        where = ", ".join(names[sensor] for sensor in trouble.sensors)
        facts[trouble.kind] = (
            f"{where + ': ' if where else ''}{trouble.times} times, {trouble.seconds:.1f} s, "
            f"worst {trouble.worst:.3g} {trouble.unit}"
        )
    if health.episodes_not_kept:
        facts["not listed"] = f"{health.episodes_not_kept} more of these"
    return facts


def _facts(header: Header) -> dict[str, str]:
    setup = header.setup
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9, UTC)
    device = setup.device
    return {
        "subject": header.subject,
        "hand": setup.layout.side if setup.layout.is_hand else setup.layout.missing_for_hand,
        "hand length": f"{setup.hand.hand_length_m * 1e3:.0f} mm",
        "start": f"{start:%Y-%m-%d %H:%M:%S} UTC",
        "device": f"{device.name} ({device.serial_number})" if device else header.source,
        "sensors": ", ".join(setup.layout.names),
        "rate": f"{setup.rate_hz:g} Hz",
        "calibration": setup.calibration,
        "zero of angles": setup.zero,
        "software": f"handstudio {header.software}",
    }
