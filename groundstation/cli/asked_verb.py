"""Application with the verb alone that is asked for: a start makes no others."""

from collections.abc import Sequence
from copy import copy

import typer
from typer.main import get_command_name
from typer.models import CommandInfo

from groundstation.cli.application import app
from groundstation.cli.plain_words import PlainGroup, PlainWords


def application_for(words: Sequence[str]) -> typer.Typer:
    """Return the application with only the verb that is asked for, of a group of verbs too.

    Typer makes the parameters of all verbs before it calls one.
    """
    if (alone := _with_verb(app, words[:1])) is not None:
        return alone
    for group in app.registered_groups:
        if [*words[:1]] == [group.name] and group.typer_instance is not None:
            inner = _with_verb(group.typer_instance, words[1:2])
            if inner is not None:
                alone, only = copy(app), copy(group)
                only.typer_instance, only.cls = inner, PlainGroup
                alone.registered_commands, alone.registered_groups = [], [only]
                return alone
    return app


def _with_verb(verbs: typer.Typer, word: Sequence[str]) -> typer.Typer | None:
    """Return verbs with that one alone which a word names, None where it names none."""
    asked = [verb for verb in verbs.registered_commands if [*word] == [_name_of(verb)]]
    if not asked:
        return None
    alone = copy(verbs)
    alone.registered_commands, alone.registered_groups = [_with_plain_words(verb) for verb in asked], []
    return alone


def _with_plain_words(verb: CommandInfo) -> CommandInfo:
    plain = copy(verb)
    plain.cls = PlainWords
    return plain


def _name_of(verb: CommandInfo) -> str:
    return verb.name or get_command_name(verb.callback.__name__ if verb.callback else "")
