"""Verbs for single logs that make no flight: ``info``, ``check`` and ``convert``.

Heavy imports happen inside them.
"""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from groundstation.base.errors import UsageError
from groundstation.base.words import counted
from groundstation.cli.application import (
    DATA_LOST,
    DONE,
    FAILED,
    AircraftFile,
    ConfigFile,
    FailOn,
    Force,
    IcdFiles,
    Isolate,
    Json,
    Profile,
    Progress,
    Quiet,
    ReferenceFiles,
    SiteFile,
    ThresholdsFile,
    Timeout,
    Together,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    say,
    tell,
    time_bound,
)
from groundstation.cli.completion import analyses


@app.command(epilog=examples("info"))
@answers_with_exit_code
def info(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="A recorded log, or an MCAP. Of several, and of a folder, each log is told in a line.",
            metavar="LOG",
            readable=False,
        ),
    ],
    profile: Profile = None,
    icd: IcdFiles = None,
    suggest_icd: Annotated[
        bool, typer.Option("--suggest-icd", help="Print a draft ICD for what is on its buses.")
    ] = False,
    together: Together = False,
    timeout: Timeout = None,
    json: Json = False,
    verbose: Verbose = False,
) -> int | None:
    """Show what a log is: format, clock, span, topics with rows, rates, fields.

    Its buses are shown too, word by word with -v. With --together, the logs of one flight are shown as one.
    """
    from groundstation.cli import printing
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.one_flight.convert import why_nothing_is_placed
    from groundstation.pipeline.verbs import describe

    bounds = time_bound(timeout)
    if bounds is not None:
        from groundstation.pipeline.verbs import check_apart as apart
    if together and (bounds is not None or suggest_icd):
        raise UsageError("--together", "--timeout or --suggest-icd", "--together without them")
    if suggest_icd:
        if len(logs) > 1:
            raise UsageError("--suggest-icd", counted(len(logs), "log"), "one log")
        tell(apart.suggest_icd_apart(logs[0], bounds) if bounds is not None else describe.suggest_icd(logs[0]))
        return DONE
    icds = tuple(icd or ())

    def described(path: Path, *, is_alone: bool) -> describe.Description:
        if bounds is not None:
            return apart.describe_apart(path, profile, icds, bounds, is_alone=is_alone)
        return describe.describe(path, profile, icds, is_alone=is_alone)

    if not together and (len(logs) > 1 or logs[0].is_dir()):
        from groundstation.cli.listing import describe_listed
        from groundstation.pipeline.verbs.named_logs import logs_named

        named = logs_named(logs, profile)
        if named.has_folder or len(named.logs) > 1:
            return describe_listed(named, partial(described, is_alone=False), as_json_text=json)
    if together:
        description = describe.describe_together(logs, load_configuration(profile=profile, icds=icd))
    else:
        description = described(logs[0], is_alone=True)
    shown = printing.as_json(description.to_dict()) if json else printing.description(description, everything=verbose)
    tell(shown)
    if not description.has_records:
        say(f"error: {logs[0].name}: {why_nothing_is_placed(description.findings)}")
        return FAILED
    return DATA_LOST if description.has_lost_data else DONE


@app.command(epilog=examples("check"))
@answers_with_exit_code
def check(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Recorded logs or MCAPs. Of a folder each log is told in a line, in full with -v.",
            metavar="LOG",
            readable=False,
        ),
    ],
    purpose: Annotated[
        str,
        typer.Option(
            "--for",
            help="The first line says whether the log can be used for this analysis (a wrong name prints those there "
            "are): yes, no, in part, and what is missing where. Exit 4 at no; with --fail-on warn also at in part. "
            "Logs of a session are judged together.",
            metavar="ANALYSIS",
            autocompletion=analyses,
        ),
    ] = "",
    aircraft: AircraftFile = None,
    site: SiteFile = None,
    thresholds: ThresholdsFile = None,
    config: ConfigFile = None,
    profile: Profile = None,
    icd: IcdFiles = None,
    together: Together = False,
    timeout: Timeout = None,
    isolate: Isolate = False,
    fail_on: FailOn = "none",
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Print the integrity ledger of every topic: rates, coverage, gaps, losses, odd values.

    Writes nothing.

    With --for, the first line says whether the log can be used for that analysis; with --together, whether the logs of
    one flight can, joined as `run --together` joins them.
    """
    from groundstation.cli import check_table, listing, printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.check import check_many
    from groundstation.pipeline.verbs.named_logs import NamedLogs, logs_named

    configuration = load_configuration(config, aircraft, site, profile=profile, thresholds=thresholds, icds=icd)
    bounds = time_bound(timeout, configuration.isolation if isolate else None)
    if together and bounds is not None:
        raise UsageError("--together", "--timeout or --isolate", "--together without them")
    named = NamedLogs(tuple(logs)) if together else logs_named(logs, configuration.profile_path)
    with listener("none" if quiet else progress) as listen:
        check_logs = check_many
        if together:
            from groundstation.pipeline.verbs.check_together import check_together

            check_logs = check_together
        elif bounds is not None:
            from groundstation.pipeline.verbs.check_apart import check_apart

            check_logs = partial(check_apart, bounds=bounds)
        checked = check_logs(named.logs, configuration, purpose=purpose, fail_on=fail_on, listen=listen)
    if named.has_folder and not (json or verbose):
        listing.show_checked(named, checked, quiet=quiet)
    else:
        check_table.show(checked, as_json_text=json, quiet=quiet, everything=verbose)
    if not quiet and len(checked) > 1 and all(one.usability and one.usability.state == "no" for one in checked):
        say("logs of one flight are judged as one with --together")
    return printing.worst_code(tuple(one.outcome for one in checked))


@app.command(epilog=examples("convert"))
@answers_with_exit_code
def convert(
    logs: Annotated[list[Path], typer.Argument(help="Recorded logs.", metavar="LOG", readable=False)],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="MCAP to write; a folder for several logs. A name *.ch10 writes Chapter 10 with its ICD.",
            metavar="FILE",
        ),
    ],
    thresholds: ThresholdsFile = None,
    config: ConfigFile = None,
    profile: Profile = None,
    icd: IcdFiles = None,
    together: Together = False,
    reference: ReferenceFiles = None,
    timeout: Timeout = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Convert recorded logs to MCAP (protobuf channels, zstd, indexed).

    The clock is repaired, both times are kept.
    """
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.verbs.conversions import convert_many, convert_together

    settings = load_configuration(config, profile=profile, thresholds=thresholds, icds=icd)
    configuration = settings
    if reference:
        from groundstation.pipeline.many_flights.runs.references import judged_by

        configuration = judged_by(settings, reference, is_one_log=together or len(logs) == 1)
    if together and timeout is not None:
        raise UsageError("--together", "--timeout", "--together without it")
    with listener("none" if quiet else progress) as listen:
        convert_logs = convert_together if together else partial(convert_many, bounds=time_bound(timeout))
        outcomes = convert_logs(logs, output, configuration=configuration, force=force, listen=listen)
    printing.outcomes(outcomes, as_json_text=json, quiet=quiet)
    return printing.worst_code(outcomes)
