"""Verbs on simulated flights.

``simulate`` writes them as logs, ``study`` judges the estimators by them.
"""

from pathlib import Path
from typing import Annotated, Literal

import typer

from groundstation.cli.application import (
    DONE,
    Force,
    Json,
    Progress,
    Quiet,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    tell,
    tell_written,
)
from groundstation.cli.completion import scenarios, studies


@app.command(epilog=examples("simulate"))
@answers_with_exit_code
def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            help="Name of a shipped scenario, or a TOML file.", metavar="SCENARIO", autocompletion=scenarios
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the log.", metavar="DIR")],
    seed: Annotated[int | None, typer.Option("--seed", help="Seed in place of the scenario's own.")] = None,
    form: Annotated[
        Literal["csv", "ch10", "ulog", "dataflash", "ros1"],
        typer.Option(
            "--format", help="csv; ch10: IRIG 106 Chapter 10 with its ICD; of an inertial unit ulog, dataflash, ros1."
        ),
    ] = "csv",
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Simulate a flight as a flat CSV, with the truth beside it.

    `groundstation list` names the scenarios.
    """
    from groundstation.pipeline.verbs.synthesis import simulate_to

    tell_written(simulate_to(scenario, output, seed=seed, form=form, force=force), as_json_text=json, quiet=quiet)
    return DONE


@app.command(epilog=examples("study"))
@answers_with_exit_code
def study(
    name: Annotated[
        str,
        typer.Argument(
            help="A study; `groundstation list` names them.",
            metavar="NAME",
            autocompletion=studies,
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the tables.", metavar="DIR")],
    runs: Annotated[int, typer.Option("--runs", help="Simulated runs of each family or case.", min=10)] = 200,
    seed: Annotated[int, typer.Option("--seed", help="Seed; those of families and cases follow from it.")] = 71,
    inputs: Annotated[
        Path | None,
        typer.Option("--input", help="Files or folder of a study that reads recorded data.", metavar="PATH"),
    ] = None,
    minutes: Annotated[
        float | None,
        typer.Option(
            "--minutes",
            help="Stop after so many minutes, where a study keeps its runs; the same command continues.",
            min=0.1,
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    progress: Progress = "auto",
) -> int | None:
    """Run the Monte Carlo behind the published figures, ours beside them.

    `groundstation list` names the studies.
    """
    from groundstation.cli.progress import listener
    from groundstation.pipeline.verbs.synthesis import study_to

    with listener("none" if quiet else progress) as listen:
        text = study_to(name, output, runs=runs, seed=seed, force=force, listen=listen, inputs=inputs, minutes=minutes)
    if not quiet:
        tell(text)
    return DONE
