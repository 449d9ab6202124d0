"""Verb ``profile``: write a profile for a table, try it, list those that are known."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from groundstation.cli.application import (
    DATA_LOST,
    DONE,
    FAILED,
    LIMIT_REACHED,
    FailOn,
    Force,
    Json,
    Quiet,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    say,
    tell,
    tell_written,
)
from groundstation.cli.completion import profiles as profile_names

if TYPE_CHECKING:
    from groundstation.pipeline.verbs.profiles import Draft, ProfileCheck

MOST_SHOWN = 40  # columns that are left, without -v

profiles = typer.Typer(
    help="Write a profile for a table of any layout, and see what each column becomes.",
    epilog=examples("profile"),
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(profiles, name="profile")

Table = Annotated[Path, typer.Argument(help="A table of text: CSV or the like.", metavar="FILE", readable=False)]


@profiles.command(epilog=examples("profile"))
@answers_with_exit_code
def new(
    table: Table,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Profile to write. Default: print it.", metavar="FILE")
    ] = None,
    names: Annotated[
        str | None,
        typer.Option(help="Names of the columns of a table that has no row of names, with commas.", metavar="NAMES"),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Write a draft of a profile from the names, units and values of a table.

    What was understood is printed too, and what to look at: each line of the draft with a question mark.
    """
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.export import require_place
    from groundstation.pipeline.verbs.profiles import facts_of_draft, new_profile, write_profile

    if output is not None:
        require_place(table, output, force)
    draft = new_profile(table, tuple(name.strip() for name in names.split(",")) if names else ())
    if output is not None:
        write_profile(draft, output)
    if json:
        tell(as_json(dict(facts_of_draft(draft))))
        return DONE
    if not quiet:
        (say if output is None else tell)(draft_text(draft, everything=verbose))
    if output is None:
        tell(draft.text.rstrip("\n"))
    else:
        tell_written((output,), as_json_text=False, quiet=quiet)
    return DONE


@profiles.command(epilog=examples("profile"))
@answers_with_exit_code
def check(
    profile: Annotated[
        Path,
        typer.Argument(
            help="A profile (TOML), or the name of a shipped one.",
            metavar="PROFILE",
            readable=False,
            autocompletion=profile_names,
        ),
    ],
    table: Table,
    fail_on: FailOn = "none",
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> int | None:
    """Show what each column of a table becomes by a profile, what is left, what is missing.

    Writes nothing.
    """
    from groundstation.base.serial import to_json
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.profiles import findings_of, try_profile

    checked = try_profile(profile, table)
    if json:
        document = to_json(checked)
        document["findings"] = to_json(findings_of(checked))
        tell(as_json(document))
    elif not quiet:
        tell(check_text(checked, everything=verbose))
    if not any(one.values and one.became not in ("", "time") for one in checked.columns):
        say(f"error: {checked.table}: no column became a field with values")
        return FAILED
    severities = {one.severity for one in findings_of(checked)}
    if fail_on != "none" and severities & ({"fail", "warn"} if fail_on == "warn" else {"fail"}):
        return LIMIT_REACHED
    return DATA_LOST if checked.has_lost_data else DONE


@profiles.command(name="list", epilog=examples("profile"))
@answers_with_exit_code
def list_(json: Json = False, verbose: Verbose = False) -> int | None:
    """List the profiles that are tried on every table, and the folder for your own."""
    from groundstation.base.text_columns import columns
    from groundstation.cli.text import as_json
    from groundstation.pipeline.verbs.profiles import folder_of_the_user, known_profiles

    found, failures = known_profiles()
    if json:
        rows = [{"name": one.name, "summary": one.summary, "origin": one.origin} for one in found]
        tell(as_json({"profiles": rows, "failures": list(failures), "folder": str(folder_of_the_user())}))
    else:
        tell(columns([[one.name, one.origin, one.summary] for one in found]))
        tell(f"your own: {folder_of_the_user()}")
    for line in failures:
        say(f"warning: {line}")
    return DONE


def draft_text(draft: "Draft", *, everything: bool = False) -> str:
    """Return what a draft understood, for people."""
    from groundstation.base.text_columns import columns
    from groundstation.base.words import counted

    header = f"row {draft.header}" if draft.header else "none: the columns are numbered"
    rows = [["header", f"{header}, {_parting(draft.delimiter)}"]]
    rows += [["time", f"{', '.join(draft.time_names)}: {draft.time.why}"]]
    rows += [
        [one.name, " ".join(filter(None, (one.target, f"in {one.unit}" * bool(one.unit), one.why)))]
        for one in draft.understood
    ]
    left = [one.name for one in draft.columns if not one.target]
    shown = left if everything else left[:MOST_SHOWN]
    more = f" and {len(left) - len(shown)} more (-v lists them)" if len(left) > len(shown) else ""
    parts = [columns(rows), f"left: {', '.join(shown) or 'nothing'}{more}"]
    doubts = draft.doubts
    if doubts:
        parts.append(f"look at {counted(len(doubts), 'line')}:\n" + "\n".join(f"? {one}" for one in doubts))
    return "\n".join(parts)


def check_text(checked: "ProfileCheck", *, everything: bool = False) -> str:
    """Return what a profile made of a table, for people."""
    from groundstation.base.text_columns import columns
    from groundstation.base.words import counted
    from groundstation.pipeline.verbs.profiles import findings_of

    header = f"row {checked.header}" if checked.header else "none, by the profile's names"
    width = counted(sum(one.is_first for one in checked.columns), "column")
    parts = [
        f"profile {checked.profile}, {checked.table}",
        f"header {header}, {_parting(checked.delimiter)}, {width}, {counted(checked.rows, 'row')}, {checked.encoding}",
    ]
    used = [
        [one.name, one.became, "" if one.became == "time" else f"{one.values}", f"{one.shown} {one.unit}".strip()]
        for one in checked.columns
        if one.became
    ]
    parts.append(columns([["column", "became", "values", "from to"], *used], right=(2,)))
    parts += [f"derived: {one}" for one in checked.derived]
    left = [one for one in checked.columns if not one.became]
    shown = left if everything else left[:MOST_SHOWN]
    more = f" and {len(left) - len(shown)} more (-v lists them)" if len(left) > len(shown) else ""
    if everything and left:
        parts.append("left, and kept as they are\n" + columns([[one.name, one.shown] for one in left]))
    else:
        parts.append(f"left: {', '.join(one.name for one in shown) or 'nothing'}{more}")
    findings = findings_of(checked)
    if findings:
        parts.append("findings\n" + columns([[one.severity, one.text] for one in findings]))
    return "\n".join(parts)


def _parting(delimiter: str) -> str:
    return {",": "commas", ";": "semicolons", "\t": "tabs"}.get(delimiter, "blanks") + " between cells"
