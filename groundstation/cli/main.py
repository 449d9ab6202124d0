"""The command ``groundstation``: its verbs, options and exit codes. Heavy imports happen inside the verbs."""

import io
import sys
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, ParamSpec

import typer
import typer.core

from groundstation import __version__
from groundstation.base.errors import GroundstationError, UsageError

DONE, FAILED, USAGE, DATA_LOST, LIMIT_REACHED = 0, 1, 2, 3, 4
INTERRUPTED = 130
EXIT_CODES = (
    "Exit codes: 0 done; 1 could not read or compute; 2 usage; 3 done, with data lost (truncated, corrupt spans, "
    "channels dropped); 4 done, and --fail-on reached. For several logs the worst wins (1, 4, 3, 0)."
)

VERBS = (
    *("info", "check", "convert", "run", "report", "view", "clip", "compare", "serve"),
    *("simulate", "study", "list"),
)


class InOrder(typer.core.TyperGroup):
    """The verbs in the order of a flight's way, wherever they are defined."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, those without a place at the end."""
        places = {name: place for place, name in enumerate(VERBS)}
        return sorted(super().list_commands(ctx), key=lambda name: places.get(name, len(VERBS)))


app = typer.Typer(
    name="groundstation",
    cls=InOrder,
    help="Ground station for post-flight navigation analysis: recorded logs become MCAP, a heading correction, a "
    "Rerun recording and a report.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Parameters = ParamSpec("Parameters")

ProgressMode = Literal["auto", "none", "json"]
FailOn = Literal["none", "warn", "fail"]

Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors on the terminal.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more; show where an internal error came from.")]
Json = Annotated[bool, typer.Option("--json", help="Print the results as JSON.")]
Force = Annotated[bool, typer.Option("-f", "--force", help="Overwrite what is there.")]
NoPdf = Annotated[bool, typer.Option("--no-pdf", help="Leave report.pdf out.")]
Progress = Annotated[ProgressMode, typer.Option("--progress", help="Progress on stderr: a bar, nothing, JSON lines.")]
Profile = Annotated[
    Path | None,
    typer.Option(
        "--profile", help="Profile (TOML) that describes the columns of a CSV.", metavar="FILE", readable=False
    ),
]
ConfigFile = Annotated[Path | None, typer.Option("--config", help="Settings (TOML).", metavar="FILE", readable=False)]
AircraftFile = Annotated[
    Path | None,
    typer.Option("--aircraft", help="Aircraft file (TOML): antenna arm, entry step.", metavar="FILE", readable=False),
]
SiteFile = Annotated[
    Path | None,
    typer.Option(
        "--site", help="Site file (TOML): stands, runways and their bearings.", metavar="FILE", readable=False
    ),
]
IntervalsFile = Annotated[
    Path | None,
    typer.Option("--intervals", help="Intervals to exclude or force (TOML).", metavar="FILE", readable=False),
]
ThresholdsFile = Annotated[
    Path | None,
    typer.Option("--thresholds", help="Limits of the integrity ledger (TOML).", metavar="FILE", readable=False),
]


def printable(text: str) -> str:
    """Text of a log without control characters: a log must not drive the terminal.

    Examples
    --------
    >>> printable("L-39\\x1b[2J")
    'L-39?[2J'
    """
    return "".join(character if character.isprintable() else "?" for character in text)


def say(text: str) -> None:
    """Print a line on stderr."""
    typer.echo(printable(text), err=True)


def tell_written(paths: Iterable[object], *, as_json_text: bool, quiet: bool) -> None:
    """Print the files that were written."""
    from groundstation.cli.printing import as_json

    written = [str(path) for path in paths]
    if as_json_text:
        typer.echo(as_json({"written": written}))
    elif not quiet:
        typer.echo("\n".join(map(printable, written)))


def answers_with_exit_code(verb: Callable[Parameters, int | None]) -> Callable[Parameters, None]:
    """Turn a verb's answer into the exit code, and its errors into one clear line."""

    @wraps(verb)
    def run(*args: Parameters.args, **options: Parameters.kwargs) -> None:
        try:
            code = verb(*args, **options) or DONE
        except UsageError as error:
            say(f"error: {error}")
            code = USAGE
        except GroundstationError as error:
            say(f"error: {error}")
            code = FAILED
        except KeyboardInterrupt:
            say("interrupted")
            code = INTERRUPTED
        except BrokenPipeError:  # the reader of our output went away: `groundstation list | head -1`
            sys.stderr.close()
            code = DONE
        except OSError as error:
            say(f"error: {error.filename or 'file system'}: {error.strerror or error}")
            code = FAILED
        except Exception as error:  # a defect of ours: one line for the user, the rest on request
            if options.get("verbose"):
                raise
            say(f"error: internal error ({type(error).__name__}: {error}); please report it; -v shows where")
            code = FAILED
        raise typer.Exit(code)

    return run


def _version(is_asked: bool) -> None:
    if is_asked:
        typer.echo(f"groundstation {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the verb."""


@app.command()
@answers_with_exit_code
def info(
    log: Annotated[Path, typer.Argument(help="A recorded log or an MCAP.", metavar="LOG", readable=False)],
    profile: Profile = None,
    json: Json = False,
    verbose: Verbose = False,
) -> int | None:
    """Tell what a log is: format, clock, span, topics with rows, rates and fields."""
    from groundstation.cli import printing
    from groundstation.pipeline.describe import describe

    description = describe(log, profile)
    typer.echo(printing.as_json(description.to_dict()) if json else printing.description(description))
    return DATA_LOST if description.has_lost_data else DONE


@app.command()
@answers_with_exit_code
def check(
    logs: Annotated[list[Path], typer.Argument(help="Recorded logs or MCAPs.", metavar="LOG", readable=False)],
    thresholds: ThresholdsFile = None,
    config: ConfigFile = None,
    profile: Profile = None,
    fail_on: Annotated[FailOn, typer.Option("--fail-on", help="Exit 4 when a finding is this grave.")] = "none",
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Print the integrity ledger: rates, coverage, gaps, losses and odd values of every topic. Writes nothing."""
    from groundstation.cli import check_table, printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.check import check_many
    from groundstation.pipeline.configuration import load_configuration

    configuration = load_configuration(config, profile=profile, thresholds=thresholds)
    with listener("none" if quiet else progress) as listen:
        checked = check_many(logs, configuration, fail_on=fail_on, listen=listen)
    check_table.show(checked, as_json_text=json, quiet=quiet, everything=verbose)
    return printing.worst_code(tuple(one.outcome for one in checked))


@app.command()
@answers_with_exit_code
def convert(
    logs: Annotated[list[Path], typer.Argument(help="Recorded logs.", metavar="LOG", readable=False)],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="MCAP to write; a folder for several logs.", metavar="FILE")
    ],
    thresholds: ThresholdsFile = None,
    config: ConfigFile = None,
    profile: Profile = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Convert recorded logs to MCAP (protobuf channels, zstd, indexed); the clock is repaired, both times are kept."""
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.configuration import load_configuration
    from groundstation.pipeline.conversions import convert_many

    configuration = load_configuration(config, profile=profile, thresholds=thresholds)
    with listener("none" if quiet else progress) as listen:
        outcomes = convert_many(logs, output, configuration=configuration, force=force, listen=listen)
    printing.outcomes(outcomes, as_json_text=json, quiet=quiet)
    return printing.worst_code(outcomes)


@app.command()
@answers_with_exit_code
def run(
    paths: Annotated[list[str], typer.Argument(help="Logs or folders of logs, or URLs of them.", metavar="PATH")],
    output: Annotated[str, typer.Option("-o", "--output", help="Folder for the results, or its URL.", metavar="OUT")],
    config: ConfigFile = None,
    aircraft: AircraftFile = None,
    site: SiteFile = None,
    intervals: IntervalsFile = None,
    thresholds: ThresholdsFile = None,
    profile: Profile = None,
    jobs: Annotated[int, typer.Option("-j", "--jobs", help="Processes; 0: one per core.", min=0)] = 0,
    scheduler: Annotated[
        str, typer.Option("--scheduler", help="Dask scheduler whose workers do the work.", metavar="tcp://HOST:PORT")
    ] = "",
    fail_on: Annotated[FailOn, typer.Option("--fail-on", help="Exit 4 when a finding is this grave.")] = "none",
    no_pdf: NoPdf = False,
    redo: Annotated[bool, typer.Option("--redo", help="Do again what an earlier run finished.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be done; write nothing.")] = False,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Run everything the data allows: MCAP, heading correction, recording and report of each flight.

    An OUT of an earlier run is continued: what it finished with the same logs and settings is not done again.
    """
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.batch import plan_many, run_many
    from groundstation.pipeline.configuration import load_configuration

    configuration = load_configuration(config, aircraft, site, intervals, profile, thresholds)
    if dry_run:
        planned = plan_many(paths, output, configuration, with_pdf=not no_pdf, redo=redo)
        printing.outcomes(planned, as_json_text=json, quiet=quiet)
        return DONE
    with listener("none" if quiet else progress) as listen:
        outcomes = run_many(
            paths,
            output,
            configuration,
            jobs=jobs,
            scheduler=scheduler,
            force=force,
            fail_on=fail_on,
            with_pdf=not no_pdf,
            redo=redo,
            listen=listen,
        )
    printing.outcomes(outcomes, as_json_text=json, quiet=quiet, with_times=verbose)
    return printing.worst_code(outcomes)


@app.command()
@answers_with_exit_code
def report(
    out: Annotated[Path, typer.Argument(help="A folder that `run` made, or one flight folder in it.", metavar="OUT")],
    no_pdf: NoPdf = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Make the reports and the index again from the saved results, without the logs."""
    from groundstation.cli import printing
    from groundstation.pipeline.publishing import report_again

    paths, problems = report_again(out, with_pdf=not no_pdf)
    tell_written(paths, as_json_text=json, quiet=quiet)
    for problem in problems:
        say(f"{'error' if problem.code else 'warning'}: {problem.text}")
    return printing.worst_code(problems)


@app.command()
@answers_with_exit_code
def view(
    flight: Annotated[
        str,
        typer.Argument(
            help="Folder that `run` or `compare` made, flight folder, recording, MCAP or log; or the address that "
            "`serve` tells.",
            metavar="FLIGHT",
        ),
    ],
    web: Annotated[bool, typer.Option("--web", help="Open it in the browser.")] = False,
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option("--port", help="Port; left out: 9090 for --web, or any free one.", min=1, max=65535),
    ] = None,
    profile: Profile = None,
    verbose: Verbose = False,
) -> int | None:
    """Look at a flight in the Rerun viewer, native or in the browser."""
    from groundstation.pipeline.look import look_at

    look_at(flight, web=web, host=host, port=port, profile=profile, say=say)
    return DONE


@app.command()
@answers_with_exit_code
def simulate(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario, or a TOML file.", metavar="SCENARIO")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the log.", metavar="DIR")],
    seed: Annotated[int | None, typer.Option("--seed", help="Seed in place of the scenario's own.")] = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Simulate a flight as a flat CSV, with the truth beside it. `groundstation list` names the scenarios."""
    from groundstation.pipeline.synthesis import simulate_to

    tell_written(simulate_to(scenario, output, seed=seed, force=force), as_json_text=json, quiet=quiet)
    return DONE


@app.command()
@answers_with_exit_code
def study(
    name: Annotated[Literal["heading", "forecast"], typer.Argument(help="heading or forecast.", metavar="NAME")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the tables.", metavar="DIR")],
    runs: Annotated[int, typer.Option("--runs", help="Simulated runs of each family or case.", min=10)] = 200,
    seed: Annotated[int, typer.Option("--seed", help="Seed; families and cases take those that follow from it.")] = 71,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    progress: Progress = "auto",
) -> int | None:
    """Monte Carlo behind the published figures, with ours beside them."""
    from groundstation.cli.progress import listener
    from groundstation.pipeline.synthesis import study_to

    with listener("none" if quiet else progress) as listen:
        text = study_to(name, output, runs=runs, seed=seed, force=force, listen=listen)
    if not quiet:
        typer.echo(text)
    return DONE


@app.command(name="list")
@answers_with_exit_code
def list_(
    log: Annotated[
        Path | None, typer.Argument(help="A log: would each analysis run on it?", metavar="LOG", readable=False)
    ] = None,
    profile: Profile = None,
    json: Json = False,
    verbose: Verbose = False,
) -> int | None:
    """List the analyses and what each needs; with a LOG, whether each would run and why not."""
    from groundstation.cli import printing
    from groundstation.pipeline.catalogue import catalogue

    entries = catalogue(log, profile)
    typer.echo(printing.as_json(entries) if json else printing.catalogue(entries, log is not None))
    return DONE


LATER_VERBS = {
    "cooperative": "Navigation between aircraft.",
    "plan": "Plan a session or a landing.",
}


def _add_later_verb(name: str) -> None:
    @app.command(
        name=name,
        hidden=True,
        add_help_option=False,
        context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    )
    def not_in_this_version(context: typer.Context) -> None:
        say(f"error: {name}: not in this version")
        raise typer.Exit(USAGE)


for _name in LATER_VERBS:
    _add_later_verb(_name)

from groundstation.cli import fleets as fleets  # noqa: E402  more verbs, which need what stands above
from groundstation.cli import flights as flights  # noqa: E402


def main(arguments: Any = None) -> None:
    """Run the command line; the exit code is raised as SystemExit."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a code page that lacks a sign loses no answer
    app(arguments)
