"""Command ``groundstation`` with its verbs. Heavy imports happen inside them."""

import io
import sys
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from groundstation.base.errors import UsageError
from groundstation.base.garbage import importing, rarely_searched
from groundstation.base.version import __version__
from groundstation.base.without_pandas import spare_pandas
from groundstation.cli import fleets, flights, plans, profiles, rules, runways, simulated, single_logs, watching
from groundstation.cli.application import (
    DONE,
    INTERRUPTED,
    AircraftFile,
    ConfigFile,
    FailOn,
    FailOnMode,
    Force,
    IcdFiles,
    InstallationFile,
    IntervalsFile,
    Isolate,
    Jobs,
    Json,
    Layout,
    Layouts,
    Only,
    Pdf,
    PowerUp,
    Profile,
    Progress,
    Quiet,
    ReferenceFiles,
    SiteFile,
    Store,
    ThresholdsFile,
    Timeout,
    Together,
    Verbose,
    WeatherFile,
    answers_with_exit_code,
    app,
    examples,
    refuse_pdf_of_results,
    say,
    tell,
    tell_written,
    time_limit_s,
)
from groundstation.cli.asked_verb import application_for
from groundstation.cli.completion import analyses

# the modules hold more verbs
__all__ = [
    "app",
    "fleets",
    "flights",
    "main",
    "plans",
    "profiles",
    "rules",
    "runways",
    "simulated",
    "single_logs",
    "watching",
]


DRAWING = frozenset(("run", "watch", "report", "view", "compare", "cooperative"))  # verbs that write recordings


def _version(is_asked: bool) -> None:
    if is_asked:
        tell(f"groundstation {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the verb."""


@app.command(epilog=examples("run"))
@answers_with_exit_code
def run(
    paths: Annotated[list[str], typer.Argument(help="Logs or folders of logs, or URLs of them.", metavar="PATH")],
    output: Annotated[str, typer.Option("-o", "--output", help="Folder for the results, or its URL.", metavar="OUT")],
    config: ConfigFile = None,
    aircraft: AircraftFile = None,
    site: SiteFile = None,
    intervals: IntervalsFile = None,
    weather: WeatherFile = None,
    installation: InstallationFile = None,
    thresholds: ThresholdsFile = None,
    profile: Profile = None,
    icd: IcdFiles = None,
    reference: ReferenceFiles = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            help="Analysis to leave out (groundstation list); may be repeated.",
            metavar="NAME",
            autocompletion=analyses,
        ),
    ] = None,
    jobs: Jobs = 0,
    scheduler: Annotated[
        str, typer.Option("--scheduler", help="Dask scheduler whose workers do the work.", metavar="tcp://HOST:PORT")
    ] = "",
    timeout: Timeout = None,
    isolate: Isolate = False,
    fail_on: FailOn = "none",
    apply: Annotated[
        str,
        typer.Option(
            "--apply",
            help="Add a magnetic deviation to the log: the flight's own, or one from a flight folder, summary.json or "
            "deviation.csv.",
            metavar="own|PATH",
        ),
    ] = "",
    together: Together = False,
    stations: Annotated[
        Path | None,
        typer.Option(
            "--stations",
            help="Ground stations of the sessions found (TOML). Default: stations.toml beside the logs.",
            metavar="FILE",
            readable=False,
        ),
    ] = None,
    layouts: Layouts = None,
    pdf: Pdf = False,
    only: Only = None,
    store: Store = "",
    redo: Annotated[bool, typer.Option("--redo", help="Repeat what an earlier run finished.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be done; write nothing.")] = False,
    is_opened: Annotated[
        bool, typer.Option("--open", help="Then open the recording: of the flight, or of all of them.")
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Run everything the data allows: MCAP, heading correction, recording and report.

    Each flight gets its own folder.

    Flights of several aircraft that ranged to one another over a data link are then analysed as a session.

    An OUT of an earlier run is continued: what it finished with the same logs and settings is not repeated.
    """
    from groundstation.cli import printing
    from groundstation.cli.lines import LONGEST, Lines
    from groundstation.cli.progress import listener
    from groundstation.pipeline.many_flights.runs.batch import run_many, run_together
    from groundstation.pipeline.many_flights.runs.dry_run import plan_many
    from groundstation.pipeline.many_flights.runs.references import judged_by
    from groundstation.pipeline.one_flight.configuration import (
        applying,
        installed_as,
        load_configuration,
    )
    from groundstation.pipeline.one_flight.layout import saved_layouts
    from groundstation.pipeline.one_flight.progress import silent

    refuse_pdf_of_results(only, pdf=pdf)
    settings = load_configuration(config, aircraft, site, intervals, profile, thresholds, icd, weather, without)
    is_one_log = together or (len(paths) == 1 and not Path(paths[0]).is_dir())
    settings = installed_as(applying(settings, apply), installation)
    if layouts and only == "results":
        raise UsageError("--layout", "--only results", "recordings to lay out")
    settings = judged_by(settings, reference or (), is_one_log=is_one_log)
    configuration = replace(settings, layouts=saved_layouts(layouts or ()))
    if together and (dry_run or scheduler or stations is not None or timeout is not None or store or isolate):
        beside = "--dry-run, --scheduler, --stations, --timeout, --store or --isolate"
        raise UsageError("--together", beside, "--together without them")
    if isolate and (dry_run or scheduler):
        raise UsageError("--isolate", "--dry-run or --scheduler", "--isolate without them")
    if dry_run:
        plan = partial(plan_many, with_pdf=pdf, only_results=only == "results")
        planned = plan(paths, output, configuration, redo=redo, stations=stations)
        printing.outcomes(planned, as_json_text=json, quiet=quiet, is_plan=True)
        return DONE
    if is_opened:
        from groundstation.pipeline.verbs.view import require_recordings_to_open

        require_recordings_to_open(output, only_results=only == "results")
    timeout_s = time_limit_s(timeout)
    run_each = partial(
        run_many,
        jobs=jobs,
        scheduler=scheduler,
        redo=redo,
        stations=stations,
        timeout_s=timeout_s,
        is_isolated=isolate,
        store=store,
    )
    run_logs = run_together if together else run_each  # logs are joined again at every run, in this process
    lines = Lines(longest=LONGEST, is_shown=not quiet, everything=verbose)
    try:
        with listener("none" if quiet else progress, silent if json else lines.listen) as listen:
            outcomes = run_logs(
                paths,
                output,
                configuration,
                force=force,
                fail_on=fail_on,
                with_pdf=pdf,
                only_results=only == "results",
                listen=listen,
            )
    except KeyboardInterrupt:
        say(f"interrupted: {output} keeps what is finished; the same command continues with the rest")
        return INTERRUPTED
    printing.outcomes(outcomes, as_json_text=json, quiet=quiet, with_times=verbose, lines=lines)
    if is_opened:
        from groundstation.pipeline.verbs.view import open_results

        open_results(output, outcomes, say=say)
    return printing.worst_code(outcomes)


@app.command(epilog=examples("report"))
@answers_with_exit_code
def report(
    out: Annotated[Path, typer.Argument(help="A folder that `run` made, or one flight folder in it.", metavar="OUT")],
    standard: Annotated[
        str,
        typer.Option(
            "--standard",
            help="Judge the INS of the flights by a standard instead, and write the acceptance: app-g, irig261, or a "
            "file of limits (TOML); fsf-alar or a file of kind landing: the share of unstable approaches.",
            metavar="NAME|FILE",
        ),
    ] = "",
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the acceptance. Default: OUT.", metavar="DIR"),
    ] = None,
    fail_on: Annotated[
        FailOnMode,
        typer.Option(
            "--fail-on",
            help="With --standard: exit 4 if it is failed (fail), or also if flights are too few to pass (warn).",
        ),
    ] = "none",
    unit_limits: Annotated[
        Path | None,
        typer.Option(
            "--unit-limits",
            help="Rates at which INS units are to be calibrated (TOML); kept in OUT for later runs.",
            metavar="FILE",
        ),
    ] = None,
    pdf: Pdf = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Make the reports and the index again from the saved results, without the logs.

    With --standard, write the acceptance of the INS instead, or the share of unstable approaches.
    """
    from groundstation.cli import printing
    from groundstation.cli.text import printable

    if standard and unit_limits is not None:
        raise UsageError("report", "--unit-limits with --standard", "one of them")
    if standard:
        return fleets.acceptance(out, standard, output, fail_on, quiet=quiet, json=json)
    if output is not None or fail_on != "none":
        raise UsageError("report", "-o or --fail-on without --standard", "--standard NAME too")
    from groundstation.pipeline.many_flights.fleet.publishing import report_again

    done = report_again(out, with_pdf=pdf, limits=unit_limits)
    tell_written(done.written, as_json_text=json, quiet=quiet)
    if done.removed and not quiet:
        say(printable(printing.removed(done.removed)))
    for problem in done.problems:
        say(f"{'error' if problem.code else 'warning'}: {problem.text}")
    return printing.worst_code(done.problems)


@app.command(epilog=examples("view"))
@answers_with_exit_code
def view(
    flight: Annotated[
        str,
        typer.Argument(
            help="Folder that `run` or `compare` made, flight folder, recording, MCAP or log; or the address that "
            "`serve` prints.",
            metavar="FLIGHT",
        ),
    ],
    web: Annotated[bool, typer.Option("--web", help="Open it in the browser.")] = False,
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option("--port", help="Port. Default: 9090 for --web, else any free one.", min=1, max=65535),
    ] = None,
    layout: Layout = None,
    power_up: PowerUp = None,
    profile: Profile = None,
    verbose: Verbose = False,
) -> int | None:
    """Look at a flight in the Rerun viewer, native or in the browser.

    `groundstation info` on a recording tells its size and the version of the viewer that opens it.
    """
    from groundstation.pipeline.verbs.view import look_at

    look_at(flight, web=web, host=host, port=port, power_up=power_up or 1, profile=profile, layout=layout, say=say)
    return DONE


@app.command(name="list", epilog=examples("list"))
@answers_with_exit_code
def list_(
    log: Annotated[
        Path | None,
        typer.Argument(
            help="A log, flight folder or session: would each analysis run on it?", metavar="LOG", readable=False
        ),
    ] = None,
    settings: Annotated[
        bool, typer.Option("--settings", help="List every setting instead: unit, default, range, meaning.")
    ] = False,
    profile: Profile = None,
    icd: IcdFiles = None,
    json: Json = False,
    verbose: Verbose = False,
) -> int | None:
    """List the analyses and what each needs; with a LOG, whether each would run and why not."""
    from groundstation.cli import printing

    if settings:
        from groundstation.base.serial import to_json
        from groundstation.pipeline.verbs.settings_list import every_setting

        if log is not None:
            raise UsageError("list --settings", "a LOG too", "one of them")
        every = every_setting()
        tell(printing.as_json(to_json(every)) if json else printing.settings(every))
        return DONE
    from groundstation.pipeline.verbs.catalogue import catalogue

    entries = catalogue(log, profile, tuple(icd or ()))
    tell(printing.as_json(entries) if json else printing.catalogue(entries, log is not None))
    return DONE


@app.command(epilog=examples("cooperative"))
@answers_with_exit_code
def cooperative(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Logs, MCAPs or flight folders, one per aircraft; or a session, to run it again.",
            metavar="LOG",
            readable=False,
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.", metavar="OUT")],
    stations: Annotated[
        Path | None,
        typer.Option("--stations", help="Ground stations (TOML).", metavar="FILE", readable=False),
    ] = None,
    config: ConfigFile = None,
    profile: Profile = None,
    fail_on: FailOn = "none",
    pdf: Pdf = False,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Analyse the logs of several aircraft together.

    The ranges over their data link give positions.

    An OUT of an earlier run is continued: a session with the same logs, stations and settings is not run again.
    """
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.cooperative import run_session

    configuration = load_configuration(config, profile=profile)
    with listener("none" if quiet else progress) as listen:
        outcomes = run_session(
            logs,
            output,
            configuration,
            stations=stations,
            force=force,
            fail_on=fail_on,
            with_pdf=pdf,
            listen=listen,
        )
    printing.outcomes(outcomes, as_json_text=json, quiet=quiet, with_times=verbose)
    return printing.worst_code(outcomes)


def main(arguments: Any = None) -> None:
    """Run the command line; the exit code is raised as SystemExit."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a code page that lacks a sign loses no answer
    is_own_process = arguments is None and {"--scheduler", "--help", "-h"}.isdisjoint(sys.argv)
    if is_own_process and sys.argv[1:2] and sys.argv[1] in DRAWING:
        with importing():
            spare_pandas()  # what Dask imports is Dask's affair
            if sys.argv[1] == "run":
                import groundstation.pipeline.many_flights.runs.batch  # noqa: F401  # the most of what a run imports
    with rarely_searched() if is_own_process else nullcontext():
        application_for(sys.argv[1:] if arguments is None else arguments)(arguments)
