"""Verbs on flights that exist.

``clip`` cuts a part out, ``export`` writes tracks, ``compare`` compares two.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from groundstation.base.errors import UsageError
from groundstation.base.failures import failures, gathered_failures
from groundstation.cli.application import (
    ConfigFile,
    Force,
    Json,
    PowerUp,
    Profile,
    Progress,
    Quiet,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    tell,
    tell_failures,
)
from groundstation.cli.text import printable

if TYPE_CHECKING:
    from groundstation.results.comparison import Comparison, Value

Align = Literal["start", "first-movement", "lift-off", "outage", "utc"]
SIGNIFICANCE = {None: "", True: "beyond", False: "within"}


@app.command(epilog=examples("clip"))
@answers_with_exit_code
def clip(
    flight: Annotated[Path, typer.Argument(help="Flight folder, session, MCAP or log.", metavar="X", readable=False)],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="MCAP to write; its recording goes next to it.", metavar="FILE")
    ],
    start: Annotated[
        str | None, typer.Option("--from", help="Flight seconds, +mm:ss or ISO UTC.", metavar="TIME")
    ] = None,
    end: Annotated[
        str | None, typer.Option("--to", help="End, in the same forms; not included.", metavar="TIME")
    ] = None,
    topics: Annotated[
        list[str] | None, typer.Option("--topics", help="Topic or pattern to keep; may be repeated.", metavar="GLOB")
    ] = None,
    anonymous: Annotated[
        bool,
        typer.Option(
            "--anonymous",
            help="Turn all longitudes by a secret angle, move dates by weeks, replace names, omit texts, raw topics, "
            "magnetometer and satellites. Latitude, height, time of day and the shape of the track stay: someone who "
            "knows where such flights are flown may still find the place.",
        ),
    ] = False,
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed",
            help="For --anonymous: the same for all logs of a session, secret like a password. Default: random.",
            min=0,
        ),
    ] = None,
    no_recording: Annotated[bool, typer.Option("--no-recording", help="Write no recording.")] = False,
    power_up: PowerUp = None,
    config: ConfigFile = None,
    profile: Profile = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Cut a part of a flight into a small MCAP, an input of every verb, and its recording."""
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.clip import Wanted
    from groundstation.pipeline.verbs.clip import clip as cut

    if seed is not None and not anonymous:
        raise UsageError("--seed", "no --anonymous", "both")
    with listener("none" if quiet else progress) as listen:
        outcome = cut(
            flight,
            output,
            Wanted(start, end, tuple(topics or ()), anonymous, seed, power_up or 0),
            configuration=load_configuration(config, profile=profile),
            with_recording=not no_recording,
            force=force,
            listen=listen,
        )
    printing.outcomes((outcome,), as_json_text=json, quiet=quiet)
    return outcome.code


@app.command(epilog=examples("export"))
@answers_with_exit_code
def export(
    flight: Annotated[Path, typer.Argument(help="Flight folder, session, MCAP or log.", metavar="X", readable=False)],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help=".kml, .gpx, .csv, .parquet, .nmea or .sbet (.out); of a session .tum or .g2o; a folder for several "
            "figures.",
            metavar="FILE",
        ),
    ],
    tracks: Annotated[
        list[str] | None,
        typer.Option(
            "--track",
            help="Topic of the log (gnss, ins ...); of a flight folder also corrected or smoothed; may be repeated. "
            "Default: all, or the first that the format can hold. Of a session: an algorithm.",
            metavar="NAME",
        ),
    ] = None,
    figure: Annotated[
        list[str] | None,
        typer.Option(
            "--figure",
            help="Write the data of a figure of a flight folder as CSV, not tracks: its name in tables/; may be "
            "repeated.",
            metavar="NAME",
        ),
    ] = None,
    figures: Annotated[bool, typer.Option("--figures", help="The same for all figures.")] = False,
    config: ConfigFile = None,
    profile: Profile = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Write tracks for other programs, or the data of figures as CSV.

    Tracks go to Google Earth, GPX, a table, NMEA or SBET; those of a session to TUM files or a g2o graph.
    """
    from groundstation.cli import printing
    from groundstation.pipeline.many_flights.inputs import is_session
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.export import export as written
    from groundstation.pipeline.verbs.export_figures import export_figures
    from groundstation.pipeline.verbs.export_session import export_session

    if figure or figures:
        if tracks or (figure and figures):
            raise UsageError("--figure", "--track or --figures too", "--figure alone")
        outcome = export_figures(flight, output, tuple(figure or ()), force=force)
    elif is_session(flight):
        outcome = export_session(flight, output, names=tuple(tracks or ()), force=force)
    else:
        settings = load_configuration(config, profile=profile)
        outcome = written(flight, output, names=tuple(tracks or ()), configuration=settings, force=force)
    printing.outcomes((outcome,), as_json_text=json, quiet=quiet)
    return outcome.code


@app.command(epilog=examples("compare"))
@answers_with_exit_code
def compare(
    a: Annotated[Path, typer.Argument(help="Flight folder.", metavar="A", readable=False)],
    b: Annotated[Path, typer.Argument(help="Flight folder.", metavar="B", readable=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for page, table and recording.", metavar="DIR")
    ] = None,
    align: Annotated[
        Align | None,
        typer.Option(
            "--align",
            help="Event to align both clocks on. Default: utc for two runs of one log, else first-movement if "
            "both show it, else start.",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Compare two flights, or two runs of one flight.

    Shows what differs, and puts both into one recording on one time axis.
    """
    from groundstation.base.serial import to_json
    from groundstation.cli import printing
    from groundstation.pipeline.verbs.compare import compare as held_against
    from groundstation.pipeline.verbs.compare import compare_to

    with gathered_failures():
        found = held_against(a, b, align)[0] if output is None else compare_to(a, b, output, align, force=force)
        lacking = failures()
    if json:
        tell(printing.as_json(to_json(found.to_dict())))
    elif not quiet:
        tell(comparison_text(found, everything=verbose))
    return tell_failures(lacking, with_traces=verbose)


def comparison_text(found: "Comparison", *, everything: bool = False) -> str:
    """Return the text of ``compare``: which flight is A and B, the alignment, differences.

    The alignment of the clocks; answers, settings and findings that differ.
    """
    from groundstation.base.text_columns import columns
    from groundstation.chapters.comparison import conclusion, plain_name, subject

    alignment = found.alignment
    when = "" if alignment.event == "utc" else f" (A at {alignment.a_s:.1f} s, B at {alignment.b_s:.1f} s)"
    shared = f"; {found.origin}: differences come from {found.cause}, the noise is shared" if found.is_same_log else ""
    sides = [
        [f"{letter}:", printable(f"{side.flight_id}  {side.source_name}")]
        for letter, side in zip("AB", (found.a, found.b), strict=True)
    ]
    aligned = f"aligned on {alignment.event}{when}: clock of B {alignment.offset_s:+.3f} s{shared}"
    rows = [["answer", "A", "B", "B - A", "sigma", "1.96 sigma"]]
    for delta in found.deltas if everything else found.shown:
        numbers = (_text(value) for value in (delta.a, delta.b, delta.delta, delta.sigma))
        rows.append([printable(plain_name(delta)), *numbers, SIGNIFICANCE[delta.is_significant]])
    parts = [f"{columns(sides)}\n{aligned}", printable(conclusion(found).text), columns(rows, right=(1, 2, 3, 4))]
    if found.settings:
        pairs = [[printable(pair.name), _text(pair.a), _text(pair.b)] for pair in found.settings]
        parts.append(columns([["setting", "A", "B"], *pairs]))
    for letter, findings, reasons in (
        ("A", found.findings_a, found.not_assessable_a),
        ("B", found.findings_b, found.not_assessable_b),
    ):
        alone = [[finding.severity, printable(finding.text)] for finding in findings]
        alone += [["not assessed", printable(f"{subject(entry.analysis)}: {entry.reason}")] for entry in reasons]
        if alone:
            parts.append(f"{letter} alone\n" + columns(alone))
    return "\n\n".join(parts)


def _text(value: "Value") -> str:
    if value is None:
        return ""
    return f"{value:.7g}" if isinstance(value, float) else printable(str(value))
