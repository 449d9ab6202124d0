"""Printing for all verbs: text that never drives the terminal, JSON for programs."""

import json
import os
import sys
from typing import Any

import typer

from groundstation.base.printable import printable as printable
from groundstation.base.printable import printable_json


def tell(text: str) -> None:
    """Print a result on stdout."""
    typer.echo(printable_lines(text))


def say(text: str) -> None:
    """Print everything else on stderr."""
    typer.echo(printable_lines(text), err=True)


def tell_line(name: str, line: str, verdict: str, colour: str | None) -> None:
    """Print a result at once, its verdict in a colour where the terminal wants colours.

    The line begins with the verdict. Not by typer's echo: that writes past a bar of progress on the same terminal.
    """
    line = printable(line)
    if colour is not None and sys.stdout.isatty() and not os.environ.get("NO_COLOR"):
        line = typer.style(line[: len(verdict)], fg=colour) + line[len(verdict) :]
    print(printable(name), line, sep="  ", flush=True)


def printable_lines(text: str) -> str:
    """Return text of several lines, each made printable.

    Examples
    --------
    >>> printable_lines("a\\x1b[2J\\nb")
    'a?[2J\\nb'
    """
    return "\n".join(map(printable, text.split("\n")))


def as_json(document: Any) -> str:
    """Render a document as JSON text, hidden characters as escapes."""
    return printable_json(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False))
