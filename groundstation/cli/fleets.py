"""Verbs on folders of flights.

``serve`` offers their recordings to a team, ``report --standard`` judges them.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from groundstation.base.failures import failures, gathered_failures
from groundstation.cli.application import (
    DONE,
    FAILED,
    LIMIT_REACHED,
    FailOnMode,
    Verbose,
    answers_with_exit_code,
    app,
    examples,
    say,
    tell,
    tell_failures,
)

if TYPE_CHECKING:
    from groundstation.base.shipped_toml import TomlFile
    from groundstation.systems.folder_standard import FolderStandard

# Decision -> what ``--fail-on`` may say for it to be exit 4.
REACHED_AT = {"fail": ("warn", "fail"), "not enough flights": ("warn",), "not flown": ("warn",)}


@app.command(epilog=examples("serve"))
@answers_with_exit_code
def serve(
    out: Annotated[Path, typer.Argument(help="A folder that `run` made.", metavar="OUT", readable=False)],
    host: Annotated[str, typer.Option("--host", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", help="Port; 0: any free one.", min=0, max=65535)] = 51234,
    web: Annotated[bool, typer.Option("--web", help="Serve the viewer to a browser too.")] = False,
    verbose: Verbose = False,
) -> int | None:
    """Offer all recordings of a folder through Rerun's catalog server, until Ctrl-C."""
    from groundstation.pipeline.verbs.serve import serve as offer

    offer(out, host=host, port=port, web=web, tell=tell, say=say)
    return DONE


def acceptance(out: Path, standard: str, output: Path | None, fail_on: FailOnMode, *, quiet: bool, json: bool) -> int:
    """Write the acceptance of the INS of a folder and print its front.

    Returns 1 where a flight cannot be read.

    Else 4 where ``fail_on`` is reached: with ``warn`` also where nothing was judged that the standard asks for.
    """
    from groundstation.pipeline.verbs.folder_standards import standard_of

    own = standard_of(standard)
    if own is not None:
        return _held_to(out, own, output, fail_on, quiet=quiet, json=json)
    from groundstation.chapters.acceptance_front import front
    from groundstation.chapters.wording import NARROW_SPACE
    from groundstation.cli.text import as_json, printable
    from groundstation.pipeline.verbs.acceptance import accept_to

    with gathered_failures():
        found, paths, problem = accept_to(out, standard, output)
        lacking = failures()
    if json:
        tell(as_json(found.to_dict() | {"written": [str(path) for path in paths]}))
    elif not quiet:
        top = front(found)
        told = (line.replace(NARROW_SPACE, " ") for line in (top.line, *top.sentences))
        tell("\n".join(map(printable, (*told, *map(str, paths)))))
    if problem:
        say(f"warning: {problem}")
    unread = [flight for flight in found.flights if not flight.is_read]
    for flight in unread:
        say(f"error: {flight.flight_id}: {flight.reason}")
    if tell_failures(lacking) or unread:
        return FAILED
    return LIMIT_REACHED if fail_on in REACHED_AT.get(found.decision, ()) else DONE


def _held_to(
    out: Path,
    own: "tuple[FolderStandard, TomlFile]",
    output: Path | None,
    fail_on: FailOnMode,
    *,
    quiet: bool,
    json: bool,
) -> int:
    """Hold the flights of a folder to the standard of a system, with the exit codes of an acceptance."""
    from groundstation.chapters.wording import NARROW_SPACE
    from groundstation.cli.text import as_json, printable
    from groundstation.pipeline.verbs.folder_standards import hold_to

    found = hold_to(out, *own, output)
    if json:
        tell(as_json(found.answer.to_dict() | {"written": [str(path) for path in found.written]}))
    elif not quiet:
        tell("\n".join(map(printable, (found.line.replace(NARROW_SPACE, " "), *map(str, found.written)))))
    if found.problem:
        say(f"warning: {found.problem}")
    for one in found.unread:
        say(f"error: {one}")
    if found.unread:
        return FAILED
    return LIMIT_REACHED if fail_on in REACHED_AT.get(found.answer.decision, ()) else DONE
