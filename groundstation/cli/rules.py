"""Verb ``rules``: past verdicts under other limits."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from groundstation.base.words import counted
from groundstation.cli.application import (
    DONE,
    FAILED,
    LIMIT_REACHED,
    FailOnMode,
    Force,
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
    from groundstation.pipeline.verbs.rules import RulesRow, RulesTest

rules = typer.Typer(
    help="Try other limits on the verdicts of past runs, without the logs.",
    epilog=examples("rules"),
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(rules, name="rules")


@rules.command(epilog=examples("rules"))
@answers_with_exit_code
def test(
    new: Annotated[
        Path, typer.Argument(help="Settings (TOML), as `run --config` takes.", metavar="NEW", readable=False)
    ],
    over: Annotated[Path, typer.Option("--over", help="A folder that `run` made.", metavar="OUT")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Table to write (CSV).", metavar="FILE")] = None,
    fail_on: Annotated[
        FailOnMode,
        typer.Option("--fail-on", help="Exit 4 if a verdict changes (warn), or if one is no longer accepted (fail)."),
    ] = "none",
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """List which verdicts would change under other limits, and why.

    The gates that the flights saved are judged again, without the logs.

    A setting that chooses data or changes what is measured needs the log: it is named; the rest is judged.

    With -v, list every gate with another limit, not only those of changed verdicts.
    """
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.export import require_place
    from groundstation.pipeline.verbs.rules import rules_test, write_rules

    if output is not None:
        require_place(new, output, force)
    found = rules_test(new, over)
    if output is not None:
        write_rules(found, output)
    if json:
        tell(as_json(found.to_dict()))
    elif not quiet:
        tell(rules_text(found, everything=verbose))
    for reason in found.unread:
        say(f"error: {reason}")
    if found.unread:
        return FAILED
    is_reached = {"warn": found.changed, "fail": found.no_longer_accepted}.get(fail_on, 0)
    return LIMIT_REACHED if is_reached else DONE


def rules_text(found: "RulesTest", *, everything: bool = False) -> str:
    """Return the text of ``rules test``: changed verdicts, their gates, totals, open settings.

    Open settings are those that need the log.
    """
    from groundstation.base.text_columns import columns

    heads = [
        "flight",
        "verdict on",
        "before",
        "after",
        "gate",
        "value",
        "old limit",
        "new limit",
        "gate before",
        "after",
    ]
    told = [
        [
            *(row.flight_id, row.subject, row.verdict_before, row.verdict_after, row.gate),
            *("" if row.value is None else f"{row.value:.4g} {row.unit}".strip(), row.limit_before, row.limit_after),
            *(row.state_before, row.state_after),
        ]
        for row in found.rows
        if everything or (row.verdict_before != row.verdict_after and _is_why(row))
    ]
    totals = (
        f"{found.rules}: {counted(found.flights, 'flight')}, {counted(found.judged, 'verdict')}, "
        f"{found.changed} change, {found.no_longer_accepted} no longer accepted"
    )
    reasons = sorted({row.needs_log for row in found.rows if row.needs_log})
    needs = [
        f"{found.need_log} verdicts are not sure without the log: other settings changed too ({'; '.join(reasons)})"
    ] * bool(reasons)
    return "\n".join(([columns([heads, *told])] if told else []) + [totals, *needs])


def _is_why(row: "RulesRow") -> bool:
    return row.state_before != row.state_after or "(informs)" in row.limit_before + row.limit_after or not row.gate
