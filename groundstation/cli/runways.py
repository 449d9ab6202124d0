"""Verb ``runways``: the table of runways, by place or airport, and its update."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from groundstation.base.words import counted
from groundstation.cli.application import (
    DONE,
    Json,
    Quiet,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    say,
    tell,
)

if TYPE_CHECKING:
    from groundstation.base.runways.table import RunwayDirection
    from groundstation.pipeline.verbs.runways import FoundRunways, NearRunway, TableInUse

MORE_HEADS = ("sigma along m", "sigma across m", "sigma course deg", "ends less length m", "row gives")

runways = typer.Typer(
    help="Show runways of the table that landings are measured against, and update it.",
    epilog=examples("runways"),
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(runways, name="runways")


@runways.command(epilog=examples("runways"), context_settings={"ignore_unknown_options": True})
@answers_with_exit_code
def near(
    latitude: Annotated[float, typer.Argument(help="Degrees, north positive.", metavar="LAT")],
    longitude: Annotated[float, typer.Argument(help="Degrees, east positive.", metavar="LON")],
    within: Annotated[float, typer.Option("--within", help="Distance to the runway, km.", metavar="KM")] = 10.0,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """List the runways near a place, the nearest first, in both directions of landing."""
    from groundstation.pipeline.verbs.runways import runways_near

    return _told(runways_near(latitude, longitude, within), quiet=quiet, verbose=verbose, json=json)


@runways.command(epilog=examples("runways"))
@answers_with_exit_code
def show(
    ident: Annotated[str | None, typer.Argument(help="Airport, or airport and runway.", metavar="IDENT")] = None,
    name: Annotated[str, typer.Argument(help="Runway: 01L.", metavar="RUNWAY")] = "",
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Show the runways of an airport; without a name, the table itself.

    Of the table: version, licence, rows that are left out.
    """
    from groundstation.base.serial import to_json
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.runways import runways_of, table_in_use

    if ident:
        return _told(runways_of(f"{ident} {name}"), quiet=quiet, verbose=verbose, json=json)
    table = table_in_use()
    if json:
        tell(as_json(to_json(table)))
    elif not quiet:
        tell(table_text(table))
    return _done(table)


@runways.command(epilog=examples("runways"))
@answers_with_exit_code
def update(
    file: Annotated[
        Path, typer.Argument(help="runways.csv from https://ourairports.com/data.", metavar="FILE", readable=False)
    ],
    dated: Annotated[
        str, typer.Option("--dated", help="Date of the file. Default: when it was last modified.", metavar="DATE")
    ] = "",
    quiet: Quiet = False,
    json: Json = False,
) -> int | None:
    """Make your own table of a downloaded file; it is then used in place of the shipped one."""
    from groundstation.base.serial import to_json
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.runways import update_runways

    table = update_runways(file, dated)
    if json:
        tell(as_json(to_json(table)))
    elif not quiet:
        tell(table_text(table))
    return DONE


def _told(found: "FoundRunways", *, quiet: bool, verbose: bool, json: bool) -> int:
    from groundstation.cli.text import as_json

    if json:
        tell(as_json(found.to_dict()))
    elif not quiet:
        tell(runways_text(found, everything=verbose))
    return _done(found.table)


def _done(table: "TableInUse") -> int:
    if table.problem:
        say(f"warning: the shipped table is used: {table.problem}")
    return DONE


def table_text(table: "TableInUse") -> str:
    """Return version, licence, file and rows of a table."""
    left_out = [f"  {count} {reason}" for reason, count in table.left_out.items()]
    return "\n".join(
        (
            f"{table.version}, {table.licence}",
            f"file: {table.file}",
            f"runways: {table.runways} of {counted(table.rows, 'row')}; left out:",
            *left_out,
        )
    )


def runways_text(found: "FoundRunways", *, everything: bool = False) -> str:
    """Return the runways found as a table; with ``everything`` the sigmas too."""
    from groundstation.base.text_columns import columns

    if not found.found:
        return f"no runway ({found.table.version})"
    heads = [
        *("runway", "km off", "threshold deg", "course deg", "length m", "width m"),
        *("landing m", "displaced m", "elevation m"),
        *("slope %", "surface", "state"),
        *(MORE_HEADS if everything else ()),
    ]
    rows = [heads, *(_row(one, everything=everything) for one in found.found)]
    foot = f"{found.table.version}, {found.table.licence}; not for navigation"
    return f"{columns(rows, right=range(1, 10))}\n{foot}"


def _row(one: "NearRunway", *, everything: bool) -> list[str]:
    runway = one.runway
    more = [
        *(f"{runway.along_sigma_m:.0f}", f"{runway.across_sigma_m:.0f}", f"{runway.course_sigma_deg:.2f}"),
        *(_number(runway.mismatch_m, 0), runway.coordinates_of),
    ]
    return [
        runway.full_name,
        "" if one.distance_m is None else f"{one.distance_m / 1000.0:.1f}",
        f"{runway.latitude_deg:.5f} {runway.longitude_deg:.5f}",
        f"{runway.true_course_deg:.1f}",
        *(f"{runway.length_m:.0f}", _number(runway.width_m, 0), f"{runway.landing_length_m:.0f}"),
        *(f"{runway.displaced_m:.0f}", _number(runway.elevation_m, 0)),
        _number(None if runway.slope is None else 100.0 * runway.slope, 2),
        runway.surface,
        _state(runway),
        *(more if everything else ()),
    ]


def _state(runway: "RunwayDirection") -> str:
    return "closed" if runway.is_closed else "water" if runway.is_water else ""


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
