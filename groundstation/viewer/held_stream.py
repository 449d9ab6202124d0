"""Stream that holds back what tabs log until their layout is out.

The layout then stands before the data: a viewer that is still loading shows the tabs, not a grid of its own.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

import rerun as rr

from groundstation.base.failures import attempt

FLUSH_SECONDS = 60.0
Call = Callable[[], object]
T = TypeVar("T")


class HeldStream:
    """Calls to a stream, by the part of the recording that made them.

    Held are columns as Rerun has them before it makes chunks: that takes no more memory at the peak than to send them
    at once.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._calls: list[Call] = []
        self._parts: list[tuple[str, str, list[Call]]] = []

    @property
    def stream(self) -> rr.RecordingStream:
        """The stream for a recorder: this object, with the methods of a stream that tabs use."""
        return cast("rr.RecordingStream", self)

    def log(self, *args: Any, **options: Any) -> None:
        """Hold back a call of the same name."""
        self._calls.append(partial(self._stream.log, *args, **options))

    def send_columns(self, *args: Any, **options: Any) -> None:
        """Hold back a call of the same name."""
        self._calls.append(partial(self._stream.send_columns, *args, **options))

    def set_time(self, *args: Any, **options: Any) -> None:
        """Hold back a call of the same name."""
        self._calls.append(partial(self._stream.set_time, *args, **options))

    def reset_time(self) -> None:
        """Hold back a call of the same name."""
        self._calls.append(self._stream.reset_time)

    def attempt(self, part: str, name: str, log: Callable[[], T]) -> T | None:
        """Let a part log; see :func:`attempt`. Nothing stays of one that fails."""
        self._calls = []
        made = attempt(part, name, log)
        if made is not None:
            self._parts.append((part, name, self._calls))
        self._calls = []
        return made

    def release(self) -> None:
        """Send what is held, and wait until all is out."""
        parts, self._parts = self._parts, []
        parts.reverse()
        while parts:  # each part is freed when it is sent
            part, name, calls = parts.pop()
            attempt(part, name, _each, calls)
        self._stream.flush(timeout_sec=FLUSH_SECONDS)


def _each(calls: list[Call]) -> None:
    calls.reverse()
    while calls:
        calls.pop()()
