"""Verb ``watch``: run the logs that arrive in a folder, and update the page of the fleet."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from groundstation.cli.application import (
    DONE,
    AircraftFile,
    ConfigFile,
    FailOn,
    Force,
    IcdFiles,
    Isolate,
    Jobs,
    Json,
    Only,
    Pdf,
    Profile,
    Progress,
    Quiet,
    ReferenceFiles,
    SiteFile,
    ThresholdsFile,
    Timeout,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    refuse_pdf_of_results,
    say,
    time_limit_s,
)

if TYPE_CHECKING:
    from groundstation.pipeline.one_flight.outcome import Outcome


@app.command(epilog=examples("watch"))
@answers_with_exit_code
def watch(
    folder: Annotated[
        Path, typer.Argument(help="Folder where logs arrive, with its sub-folders.", metavar="FOLDER", readable=False)
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.", metavar="OUT")],
    every: Annotated[
        float,
        typer.Option(
            "--every",
            help="Seconds between two looks; a log is run when two of them find it unchanged.",
            metavar="SECONDS",
            min=0.1,
            max=86_400.0,
        ),
    ] = 30.0,
    once: Annotated[bool, typer.Option("--once", help="Look twice, run what is ready and stop.")] = False,
    config: ConfigFile = None,
    aircraft: AircraftFile = None,
    site: SiteFile = None,
    thresholds: ThresholdsFile = None,
    profile: Profile = None,
    icd: IcdFiles = None,
    reference: ReferenceFiles = None,
    stations: Annotated[
        Path | None,
        typer.Option("--stations", help="Ground stations of the sessions (TOML).", metavar="FILE", readable=False),
    ] = None,
    jobs: Jobs = 0,
    timeout: Timeout = None,
    isolate: Isolate = False,
    fail_on: FailOn = "none",
    pdf: Pdf = False,
    only: Only = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Run the logs that arrive in a folder, once they have stopped growing, until Ctrl-C.

    Index and fleet page stay current.

    It may be killed at any moment: the same command continues with what is not finished.
    """
    from groundstation.cli import printing
    from groundstation.cli.lines import LONGEST, Lines
    from groundstation.cli.progress import listener
    from groundstation.pipeline.many_flights.runs.references import judged_by
    from groundstation.pipeline.one_flight.configuration import load_configuration
    from groundstation.pipeline.one_flight.progress import silent
    from groundstation.pipeline.verbs.watching import fresh
    from groundstation.pipeline.verbs.watching import watch as looked_at

    refuse_pdf_of_results(only, pdf=pdf)
    timeout_s = time_limit_s(timeout)
    settings = load_configuration(config, aircraft, site, profile=profile, thresholds=thresholds, icds=icd)
    configuration = judged_by(settings, reference or (), is_one_log=False)
    every_outcome: list[Outcome] = []
    lines = Lines(longest=LONGEST, is_shown=not quiet, everything=verbose, only_news=True)
    with listener("none" if quiet else progress, silent if json else lines.listen) as listen:
        batches = looked_at(
            *(folder, output, configuration),
            every_s=every,
            once=once,
            jobs=jobs,
            fail_on=fail_on,
            with_pdf=pdf,
            stations=stations,
            force=force,
            only_results=only == "results",
            timeout_s=timeout_s,
            is_isolated=isolate,
            say=say,
            listen=listen,
        )
        try:
            for outcomes in batches:
                news = fresh(outcomes)
                printing.outcomes(news, as_json_text=json, quiet=quiet, with_times=verbose, lines=lines)
                every_outcome += outcomes if once else ()
        except KeyboardInterrupt:
            say(f"stopped: {output} keeps what is finished; the same command continues with the rest")
            return DONE
    return printing.worst_code(tuple(every_outcome))
