"""Progress on stderr: a bar on a terminal, JSON lines for programs, or nothing."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Literal

from groundstation.base.printable import printable, printable_json
from groundstation.pipeline.one_flight.progress import Event, Listener, silent


@contextmanager
def listener(mode: Literal["auto", "none", "json"], also: Listener = silent) -> Iterator[Listener]:
    """Yield a listener for progress events; ``also`` hears each of them.

    ``auto`` draws a bar only where stderr is a terminal.
    """

    def with_other(listen: Listener) -> Listener:
        def both(event: Event) -> None:
            also(event)
            listen(event)

        return both

    if mode == "json":
        yield with_other(_as_json)
    elif mode == "auto" and sys.stderr.isatty():
        _tell_of_compiling()
        with _bar() as listen:
            yield with_other(listen)
    else:
        yield also


def _tell_of_compiling() -> None:
    """Say why the first log of a format takes long.

    It does where nothing is compiled yet or compiled code cannot be kept.
    """
    from groundstation.base.compile import keeps_nothing

    if keeps_nothing():
        sys.stderr.write("no compiled code is kept here yet: logs above 64 kB wait some seconds while it is compiled\n")


def _as_json(event: Event) -> None:
    document: dict[str, str | int] = {"event": event.kind, "name": event.name, "text": event.text}
    if event.kind == "begin":
        document["total"] = event.total
    line = printable_json(json.dumps(document, ensure_ascii=False)) + "\n"
    with suppress(OSError):  # the reader of stderr is gone: the run goes on
        sys.stderr.write(line)  # one write: events come from two threads
        sys.stderr.flush()


@contextmanager
def _bar() -> Iterator[Listener]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Rate(TextColumn):
        """Column with logs per minute."""

        def render(self, task: Task) -> Text:
            return Text(f"{60.0 * task.speed:.1f}/min" if task.speed else "")

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(""), TimeRemainingColumn())
    # Lines of results go through the bar only where both are on one terminal: else they would go to stderr.
    is_shared = sys.stdout.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=is_shared) as bar:
        task = bar.add_task("starting", total=None)

        def listen(event: Event) -> None:
            if event.kind == "begin":
                bar.update(task, total=event.total)
            elif event.kind == "stage":
                bar.update(task, description=escape(printable(f"{event.name}: {event.text}")))
            else:
                bar.advance(task)

        yield listen
