"""Lines of a run: told as each flight is done, the verdict first, no longer than a screen is wide."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from groundstation.base.clock import StepEntry
from groundstation.base.failures import Failure
from groundstation.base.ledger import DATA_LOST, END_CUT
from groundstation.cli import completion
from groundstation.cli.lines import LONGEST, Lines, line_of
from groundstation.cli.listing import summary_of
from groundstation.pipeline.one_flight.line import line_of_results
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event
from groundstation.pipeline.verbs.describe import Description
from groundstation.systems import systems
from tests.conftest import SAMPLES
from tests.report_example import example
from tests.test_cli import groundstation

DONE = Outcome("logs/a.csv", "done", "accept: +1 deg", flight_id="A_1")


def ended(*outcomes: Outcome) -> Event:
    return Event("end", "a log", outcomes=outcomes)


def test_a_flight_is_told_as_it_ends_and_once(capsys: pytest.CaptureFixture[str]) -> None:
    lines = Lines(longest=LONGEST)
    lines.listen(ended(DONE))
    assert capsys.readouterr().out == "a.csv  accept: +1 deg  A_1\n"
    lost = Outcome("more/a.csv", "data_lost", "reject: +2 deg", flight_id="A_2", was_finished=True)
    lines.tell((DONE, lost))
    assert capsys.readouterr().out == "more/a.csv  reject: +2 deg  data lost, finished before  A_2\n"
    cut = Outcome("b.csv", "data_lost", "reject: +2 deg", flight_id="A_3", loss="end cut off")
    assert line_of(cut) == "reject: +2 deg  end cut off  A_3"


def test_a_list_of_logs_says_that_the_end_alone_is_cut_off() -> None:
    told = [
        described({"format": "receiver"}, (), (), has_lost_data=bool(loss), loss=loss)
        for loss in ("", END_CUT, DATA_LOST)
    ]
    assert told == [f"receiver  no records{tail}" for tail in ("", "  end cut off", "  data lost")]


def described(*facts: Any, **more: Any) -> str:
    return summary_of(Description(*facts, **more))


def test_what_is_learned_later_is_told_alone(capsys: pytest.CaptureFixture[str]) -> None:
    lines = Lines(longest=LONGEST)
    lines.listen(ended(DONE))
    capsys.readouterr()
    lines.tell((Outcome(DONE.source, "done", f"{DONE.text}; with what was learned +0.9 deg", flight_id="A_1"),))
    assert capsys.readouterr().out == "a.csv  with what was learned +0.9 deg\n"


def test_errors_are_told_at_once_and_when_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    lines = Lines(is_shown=False)
    part = Failure("chapter", "health", "no")
    lines.listen(ended(Outcome("a.csv", "failed", "a.csv: empty"), Outcome("b.csv", "done", "x", failures=(part,))))
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines()[0] == "error: a.csv: empty" and err.splitlines()[1].startswith("error: b.csv")


def test_flights_of_several_power_ups_are_told_each(capsys: pytest.CaptureFixture[str]) -> None:
    Lines().listen(ended(*(Outcome("a.ch10", "done", "x", flight_id=f"A_{at}", power_up=at) for at in (1, 2))))
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_line_is_no_longer_than_a_screen() -> None:
    for words in ("word ", "x", "a (b) c; ", "one, "):
        for identity in ("", "20260504T060000Z_SIM-1_101"):
            line = line_of(Outcome("a", "data_lost", words * 200, flight_id=identity, was_finished=True))
            assert len(line) <= LONGEST and line.endswith(identity)


@pytest.mark.parametrize(
    ("sizes_s", "told"),
    [((-3.0,), "; clock step -3 s"), ((-3.0, 7200.0), "; 2 clock steps, up to +2:00:00"), ((), "")],
)
def test_a_step_of_the_clock_is_told(sizes_s: tuple[float, ...], told: str) -> None:
    kept = {"mistake": "", "record_index": 24, "records_before": 18, "set_s": -4.0, "shift_of_earlier_s": -4.0}
    steps = tuple(StepEntry(kind="backward" if size < 0.0 else "forward", size_s=size, **kept) for size in sizes_s)  # type: ignore[arg-type]
    plain = example()
    stepped = replace(plain, clock=replace(plain.clock, steps=steps))
    expected = line_of_results(plain, systems()).replace("; not assessable", f"{told}; not assessable")
    assert line_of_results(stepped, systems()) == expected


def test_a_run_tells_the_verdict_first(tmp_path: Path) -> None:
    code, out, _ = groundstation(
        "run", str(SAMPLES / "taxi-good.csv"), "-o", str(tmp_path / "out"), "--only", "results"
    )
    (line,) = out.splitlines()
    assert code == 0 and line.startswith("taxi-good.csv  accept: heading error") and line.endswith("_SIM-1_101")
    assert len(line.removeprefix("taxi-good.csv  ")) <= LONGEST


@pytest.mark.parametrize("name", ["flight.xyz", "flight"])
def test_an_ending_that_nothing_is_written_as_is_refused(tmp_path: Path, name: str) -> None:
    code, _, err = groundstation("convert", str(SAMPLES / "taxi-good.csv"), "-o", str(tmp_path / name))
    assert code == 2 and "*.mcap" in err and not (tmp_path / name).exists()


@pytest.mark.parametrize("options", [("--only", "results"), ()])
def test_open_is_refused_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    log, out = SAMPLES / "taxi-good.csv", tmp_path / "out"
    code, _, err = groundstation("run", str(log), "-o", str(out), "--open", *options)
    assert code in (1, 2) and len(err.splitlines()) == 1 and not out.exists()


def test_names_are_completed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "taxi-good" in completion.scenarios("taxi-g")
    assert completion.studies("hea") == ["heading"]
    assert "heading" in completion.analyses("h") and not completion.analyses("nothing")
    assert "tum" in completion.profiles("t")
    assert all(not name.startswith("session") for name in completion.plans_of("session")(""))
    (tmp_path / "mine.toml").touch()
    assert completion.profiles(f"{tmp_path}/m") == [f"{tmp_path}/mine.toml"]
    monkeypatch.chdir(tmp_path)
    assert (completion.profiles("./m"), completion.profiles("mine")) == (["./mine.toml"], ["mine.toml"])
