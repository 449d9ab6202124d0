"""Plain bad numbers from end to end: no row is lost for them, no warning comes out, nothing is an internal error."""

from collections.abc import Callable
from pathlib import Path

import pytest

from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from tests.saved import load

SAMPLE = Path(__file__).parents[2] / "sample_logs" / "taxi-good.csv"
SAMPLE_START = "2026-05-04T06:00:00Z"
Change = Callable[[int, list[str]], list[str]]


def cells(text: str) -> Change:
    """One cell in fifty, time aside, every column in turn."""
    return lambda row, line: [text if n and (row + 7 * n) % 50 == 0 else cell for n, cell in enumerate(line)]


def clock(factor: float) -> Change:
    """The recorder's clock with another unit."""
    return lambda _row, line: [f"{float(line[0]) * factor:.3f}", *line[1:]]


CASES = {
    "1e308": (SAMPLE_START, cells("1e308")),
    "inf": (SAMPLE_START, cells("inf")),
    "1e200": (SAMPLE_START, cells("1e200")),
    "wide": (SAMPLE_START, clock(1e9)),
    "backward": (SAMPLE_START, clock(-1e7)),
    "year 9999": ("9999-12-31T00:00:00Z", cells("")),
}
ON_PAPER = ("1e308", "wide")


@pytest.mark.parametrize("name", CASES)
def test_bad_numbers_are_no_internal_error(tmp_path: Path, name: str) -> None:
    start_utc, change = CASES[name]
    lines = SAMPLE.read_text(encoding="utf-8").splitlines()
    top = [f"# start_utc: {start_utc}" if "start_utc" in line else line for line in lines if line.startswith("#")]
    header, *rows = [line for line in lines if not line.startswith("#")]
    changed = [",".join(change(row, line.split(","))) for row, line in enumerate(rows[::5])]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*top, header, *changed]) + "\n", encoding="utf-8")
    outcome = run_flight(Job(path, tmp_path, Configuration(), with_pdf=name in ON_PAPER))
    assert outcome.state != "failed", outcome
    ledger = load(Path(outcome.folder)).summary["ledger"]
    assert ledger["topics"]["ins"]["rows"] == len(changed)
