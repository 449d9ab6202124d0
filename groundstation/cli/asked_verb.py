"""Application with the verb alone that is asked for: a start makes no others."""

from collections.abc import Sequence
from copy import copy

import typer
from typer.main import get_command_name
from typer.models import CommandInfo

from groundstation.cli.application import app
from groundstation.cli.plain_words import PlainWords


def application_for(words: Sequence[str]) -> typer.Typer:
    """Return the application with only the verb that is asked for.

    Typer makes the parameters of all verbs before it calls one.
    """
    asked = [verb for verb in app.registered_commands if [*words[:1]] == [_name_of(verb)]]
    if not asked:
        return app
    alone = copy(app)
    alone.registered_commands, alone.registered_groups = [_with_plain_words(verb) for verb in asked], []
    return alone


def _with_plain_words(verb: CommandInfo) -> CommandInfo:
    plain = copy(verb)
    plain.cls = PlainWords
    return plain


def _name_of(verb: CommandInfo) -> str:
    return verb.name or get_command_name(verb.callback.__name__ if verb.callback else "")
