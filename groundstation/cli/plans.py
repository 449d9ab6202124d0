"""Verb ``plan``: set up a session or a landing for the accuracy needed."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.base.errors import UsageError
from groundstation.cli.application import (
    DONE,
    FailOn,
    Force,
    Json,
    Pdf,
    Progress,
    Quiet,
    Verbose,
    answers_with_exit_code,
    app,
    tell,
)
from groundstation.cli.completion import plans_of

plans = typer.Typer(
    help="Plan a session of several aircraft, or a landing by ranges, for the accuracy needed.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(plans, name="plan")

SCENARIO = "Name of a shipped scenario, or a TOML file."
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Folder for the results.", metavar="OUT", show_default=False)
]
Listed = Annotated[bool, typer.Option("--list", help="List the shipped scenarios and exit.")]


@plans.command()
@answers_with_exit_code
def session(
    scenario: Annotated[
        str | None,
        typer.Argument(help=SCENARIO, metavar="FILE", show_default=False, autocompletion=plans_of("session")),
    ] = None,
    output: Output = None,
    listed: Listed = False,
    fail_on: FailOn = "none",
    pdf: Pdf = False,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Plan how aircraft should move, within their bounds, for the accuracy of one of them."""
    return _plan("session", scenario, output, listed, fail_on, pdf, force, quiet, verbose, json, progress)


@plans.command()
@answers_with_exit_code
def landing(
    scenario: Annotated[
        str | None,
        typer.Argument(help=SCENARIO, metavar="FILE", show_default=False, autocompletion=plans_of("landing")),
    ] = None,
    output: Output = None,
    listed: Listed = False,
    fail_on: FailOn = "none",
    pdf: Pdf = False,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
    progress: Progress = "auto",
) -> int | None:
    """Plan an approach by ranges: where it meets the accuracy of which category.

    The ranges are to reference points.
    """
    return _plan("landing", scenario, output, listed, fail_on, pdf, force, quiet, verbose, json, progress)


def _plan(
    kind: str,
    scenario: str | None,
    output: Path | None,
    listed: bool,
    fail_on: FailOn,
    pdf: bool,
    force: bool,
    quiet: bool,
    verbose: bool,
    json: bool,
    progress: Progress,
) -> int:
    """Run a plan of any kind with the options that all kinds share."""
    from groundstation.base.text_columns import columns
    from groundstation.cli import printing
    from groundstation.cli.progress import listener
    from groundstation.pipeline.verbs.plan import run_plan, shipped_scenarios

    if listed:
        rows = [[one.name, one.title] for one in shipped_scenarios(kind)]
        names = [{"name": name, "title": title} for name, title in rows]
        tell(printing.as_json(names) if json else columns(rows))
        return DONE
    if scenario is None or output is None:
        raise UsageError(f"plan {kind}", "no FILE or no -o", "a scenario and a folder for the results")
    with listener("none" if quiet else progress) as listen:
        outcome = run_plan(kind, scenario, output, force=force, fail_on=fail_on, with_pdf=pdf, listen=listen)
    printing.outcomes((outcome,), as_json_text=json, quiet=quiet, with_times=verbose)
    return outcome.code
