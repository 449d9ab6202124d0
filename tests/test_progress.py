"""Progress on stderr: whole JSON lines, and a run that goes on when nobody reads them."""

import json
import sys

import pytest

from groundstation.cli.progress import listener
from groundstation.pipeline.one_flight.progress import Event


class Stream:
    """Keeps what is written; a reader that has gone away when it is ``broken``."""

    def __init__(self, *, broken: bool = False) -> None:
        self.written: list[str] = []
        self.broken = broken

    def write(self, text: str) -> None:
        self.written.append(text)
        if self.broken:
            raise BrokenPipeError

    def flush(self) -> None:
        pass


def test_an_event_is_one_write_so_that_two_threads_never_mix_their_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Stream()
    monkeypatch.setattr(sys, "stderr", stream)
    with listener("json") as listen:
        listen(Event("begin", total=2))
        listen(Event("stage", "Як\n\udcff.csv", "reading"))
    assert all(text.endswith("\n") and text.count("\n") == 1 for text in stream.written)
    assert [json.loads(text)["event"] for text in stream.written] == ["begin", "stage"]


def test_a_reader_that_goes_away_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Stream(broken=True)
    monkeypatch.setattr(sys, "stderr", stream)
    with listener("json") as listen:
        listen(Event("begin", total=2))
    assert len(stream.written) == 1
