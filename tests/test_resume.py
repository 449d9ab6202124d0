"""A run that is continued: what is finished is not done again, and the results are those of one run from scratch."""

import errno
import json
import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import wait
from pathlib import Path

import pytest
from filelock import FileLock
from typer.testing import CliRunner

from groundstation.base.errors import UsageError
from groundstation.cli.main import app
from groundstation.pipeline.many_flights.fleet.keys import KEYS
from groundstation.pipeline.many_flights.processes import workers
from groundstation.pipeline.many_flights.processes.crew import in_turn
from groundstation.pipeline.many_flights.processes.crews import crew_for
from groundstation.pipeline.many_flights.processes.workers import TASKS_PER_PROCESS, _teller, side_by_side
from groundstation.pipeline.many_flights.runs import out_folder
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.many_flights.runs.out_folder import LOCK, alone_in
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent

SAMPLES = Path(__file__).parents[1] / "sample_logs"
SHORT = SAMPLES / "taxi-short.csv"
SETTINGS = Configuration({"heading": {"standstill_min_s": 12.0}}, files={"heading": "ours.toml"})
PROMISED = ("summary.json", "report.html", "report.pdf")  # equal to the byte, and so are tables/ and index.*


def promised_files(out: Path) -> dict[str, bytes]:
    """Files of an OUT that are byte-identical in equal runs."""
    paths = [path for path in out.rglob("*") if path.name in PROMISED or path.suffix == ".csv"]
    return {str(path.relative_to(out)): path.read_bytes() for path in (*paths, out / "index.json")}


def assert_equal_runs(one: Path, other: Path) -> None:
    first, second = promised_files(one), promised_files(other)
    assert first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []
    names = [{path.name for path in folder.iterdir()} - {KEYS} for folder in (one, other)]  # not sent elsewhere
    assert names[0] == names[1]


@pytest.fixture(scope="module")
def finished(finished_run: Callable[..., Outcome]) -> Path:
    """OUT of a run of the short sample: shared, to be copied."""
    return Path(finished_run(SHORT.stem).folder).parent


def copied(finished: Path, target: Path) -> Path:
    return Path(shutil.copytree(finished, target, copy_function=shutil.copy2))


def times(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def flight_in(out: Path) -> Path:
    (folder,) = (path.parent for path in out.glob("*/summary.json"))
    return folder


def stages(
    paths: list[Path], out: Path, configuration: Configuration, with_pdf: bool = False
) -> tuple[Outcome, set[str]]:
    """The outcome of one log, and which stages were gone through."""
    told: set[str] = set()

    def listen(event: Event) -> None:
        told.update({event.text} if event.kind == "stage" else set())

    (outcome,) = run_many(paths, out, configuration, with_pdf=with_pdf, listen=listen)
    return outcome, told


def test_what_is_finished_is_not_done_again(
    finished: Path, finished_run: Callable[..., Outcome], tmp_path: Path
) -> None:
    out = copied(finished, tmp_path / "out")
    before = times(flight_in(out))
    (planned,) = plan_many([SHORT], out, Configuration())
    outcome, told = stages([SHORT], out, Configuration())
    assert (planned.text, told) == ("finished, nothing to do", set())
    assert times(flight_in(out)) == before
    assert_equal_runs(out, finished)
    first = finished_run(SHORT.stem)
    assert (outcome.text, outcome.state, outcome.flight_id) == (first.text, first.state, first.flight_id)


def test_a_changed_setting_keeps_the_mcap_and_gives_what_a_new_run_gives(
    finished: Path, finished_run: Callable[..., Outcome], tmp_path: Path
) -> None:
    out = copied(finished, tmp_path / "out")
    mcap = next(flight_in(out).glob("*.mcap"))
    before = mcap.stat().st_ino
    (planned,) = plan_many([SHORT], out, SETTINGS)
    _outcome, told = stages([SHORT], out, SETTINGS)
    assert planned.text.startswith("to analyse again")
    assert "converting" not in told and {"estimating", "recording", "reporting"} <= told
    assert mcap.stat().st_ino == before
    assert_equal_runs(out, Path(finished_run(SHORT.stem, SETTINGS).folder).parent)
    assert plan_many([SHORT], out, SETTINGS)[0].text == "finished, nothing to do"


@pytest.mark.slow
def test_results_alone_are_those_of_a_whole_run_which_makes_the_rest_later(finished: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ["run", str(SHORT), "-o", str(out), "--only", "results", "-q", "-j", "1"]
    assert CliRunner().invoke(app, command).exit_code == 0
    made, whole = promised_files(out), promised_files(finished)
    assert {path.suffix for path in out.rglob("*.*")}.isdisjoint({".rrd", ".html", ".pdf"})
    listed = {"index.json", "index.csv"}  # they link to what there is
    for name in made.keys() - listed:
        assert made[name] == whole[name], name
    assert whole.keys() - made.keys() == {name for name in whole if "/report." in name}
    (row,), (row_of_whole,) = (json.loads(files["index.json"])["rows"] for files in (made, whole))
    assert row_of_whole | {"report": None, "recording": None} == row
    assert plan_many([SHORT], out, Configuration(), only_results=True)[0].text == "finished, nothing to do"
    _outcome, told = stages([SHORT], out, Configuration())
    assert {"recording", "reporting"} <= told and "converting" not in told
    assert_equal_runs(out, finished)


def test_results_alone_leave_no_pages_of_other_results(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    assert plan_many([SHORT], out, Configuration(), only_results=True)[0].text == "finished, nothing to do"
    (flight_in(out) / "notes.txt").touch()
    (outcome,) = run_many([SHORT], out, SETTINGS, only_results=True)
    assert outcome.state == "done" and (flight_in(out) / "notes.txt").exists()
    assert {path.suffix for path in out.rglob("*.*")}.isdisjoint({".rrd", ".html", ".pdf"})


def test_a_limit_of_the_ledger_redoes_everything(finished: Path) -> None:
    changed = Configuration({"thresholds": {"version": 1, "gaps": {"min_s": 0.7}}}, files={"thresholds": "ours.toml"})
    (planned,) = plan_many([SHORT], finished, changed)
    assert planned.text == "to run"


@pytest.mark.parametrize(
    ("lost", "plan"), [("*.mcap", "to run"), ("*.rrd", "to analyse"), ("report.html", "to report")]
)
def test_a_file_that_was_taken_away_is_made_again(finished: Path, tmp_path: Path, lost: str, plan: str) -> None:
    out = copied(finished, tmp_path / "out")
    next(flight_in(out).glob(lost)).unlink()
    (planned,) = plan_many([SHORT], out, Configuration())
    assert planned.text.startswith(plan)


def test_a_changed_log_is_run_again_and_a_dry_run_writes_nothing(finished: Path, tmp_path: Path) -> None:
    log = tmp_path / SHORT.name
    log.write_bytes(SHORT.read_bytes() + b"\n")
    (planned,) = plan_many([log], tmp_path / "none", Configuration())
    assert planned.text == "to run" and not (tmp_path / "none").exists()
    assert plan_many([log], finished, Configuration())[0].text == "to run"
    shutil.copy(SHORT, log)
    assert plan_many([log], finished, Configuration())[0].text == "finished, nothing to do"
    assert plan_many([log], finished, Configuration(), redo=True)[0].text == "to run"


def test_a_broken_manifest_means_that_nothing_is_finished(finished: Path, tmp_path: Path) -> None:
    out = copied(finished, tmp_path / "out")
    manifest = flight_in(out) / "manifest.json"
    for text in ("{", json.dumps({"resume": {}}), json.dumps({"source": {"sha256": "0"}, "resume": None})):
        manifest.write_text(text)
        assert plan_many([SHORT], out, Configuration())[0].text == "to run"


def test_a_twin_of_a_finished_log_is_not_run(finished: Path, tmp_path: Path) -> None:
    out, logs = copied(finished, tmp_path / "out"), tmp_path / "logs"
    logs.mkdir()
    for name in (SHORT.name, "twin.csv"):
        shutil.copy(SHORT, logs / name)
    told: list[Event] = []
    assert [one.text for one in plan_many([logs], out, Configuration())] == [
        "finished, nothing to do",
        f"same content as {logs / SHORT.name}, listed once",
    ]
    done = run_many([logs], out, Configuration(), jobs=1, listen=told.append)
    assert [one.state for one in done] == ["done", "skipped"]
    assert [event.kind for event in told] == ["begin", "end", "end"]
    assert done[1].text == f"twin.csv: same content as {logs / SHORT.name}, listed once"


def test_a_log_that_is_written_to_while_it_is_read_has_failed(tmp_path: Path) -> None:
    log = tmp_path / SHORT.name
    shutil.copy(SHORT, log)

    def grow(event: Event) -> None:
        if event.text == "converting":
            with log.open("ab") as stream:
                stream.write(b"\n")

    (outcome,) = run_many([log], tmp_path / "out", Configuration(), jobs=1, listen=grow)
    assert outcome.text == "taxi-short.csv: changed while it was read: run it again once it is complete"
    assert [path.name for path in (tmp_path / "out").iterdir() if path.is_dir()] == []


def test_a_log_that_is_merely_touched_is_run(tmp_path: Path) -> None:
    log = tmp_path / SHORT.name
    shutil.copy(SHORT, log)
    (outcome,) = run_many(
        [log], tmp_path / "out", Configuration(), jobs=1, with_pdf=False, listen=lambda _event: os.utime(log)
    )
    assert outcome.state == "done"


def test_an_interrupted_run_stops_at_once_and_keeps_its_index(tmp_path: Path) -> None:
    def interrupt(event: Event) -> None:
        if event.kind == "end":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        run_many([SAMPLES], tmp_path / "out", Configuration(), jobs=2, only_results=True, listen=interrupt)
    assert caught.value is not None  # the frames of the run are alive: its processes ended all the same
    assert ended_children()
    assert (tmp_path / "out" / "index.json").is_file()


def tell_and_sleep(job: Job, listen: Listener) -> Outcome:
    """What a worker of :func:`test_workers_end_with_a_run_that_is_killed` does."""
    (job.out / "worker").write_text(str(os.getpid()))
    time.sleep(120.0)
    return Outcome(job.log, "done", "")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc to look for processes")
def test_workers_end_with_a_run_that_is_killed(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from tests.test_resume import tell_and_sleep;"
        "from groundstation.pipeline.one_flight.configuration import Configuration;"
        "from groundstation.pipeline.one_flight.flight import Job;"
        "from groundstation.pipeline.one_flight.progress import silent;"
        "from groundstation.pipeline.many_flights.processes.workers import side_by_side;"
        "job = Job(Path('x'), Path(sys.argv[1]), Configuration());"
        "list(side_by_side([(0, job)], tell_and_sleep, workers=1, listen=silent))"
    )
    run = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], cwd=SAMPLES.parent)
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "worker").exists() or not (tmp_path / "worker").read_text():
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    run.kill()
    run.wait()
    worker = int((tmp_path / "worker").read_text())
    while is_alive(worker):
        assert time.monotonic() < deadline, "the worker outlived its run"
        time.sleep(0.05)


def is_alive(process: int) -> bool:
    """Whether there is such a process, and not merely its entry that nobody has fetched."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_many_logs_are_never_run_in_the_process_that_leads() -> None:
    few, many = (crew_for("", 1, logs, silent) for logs in (TASKS_PER_PROCESS, TASKS_PER_PROCESS + 1))
    assert (few.func, many.func) == (in_turn, side_by_side)  # recordings leave threads behind


def test_without_recordings_a_process_serves_many_logs(tmp_path: Path) -> None:
    jobs = [Job(tmp_path / f"{number}.csv", tmp_path, Configuration()) for number in range(TASKS_PER_PROCESS + 8)]
    served = {}
    for only_results in (False, True):
        crew = crew_for("", 1, len(jobs), silent, only_results=only_results)
        served[only_results] = Counter(outcome.text for _number, outcome in crew(enumerate(jobs), tell_process))
    assert sorted(served[False].values()) == [8, TASKS_PER_PROCESS]
    assert list(served[True].values()) == [len(jobs)]


def tell_process(job: Job, _listen: Listener) -> Outcome:
    """What the workers of the test above do."""
    return Outcome(job.log, "done", str(os.getpid()))


def test_an_event_of_a_worker_is_one_write_to_a_pipe() -> None:
    sent: list[bytes] = []

    class Pipe:
        def send_bytes(self, data: bytes) -> None:
            sent.append(data)

    _teller(Pipe())(Event("stage", "\U0001f6e9" * 5000, "\U0001f6e9" * 5000))
    assert len(sent[0]) + 4 <= 4096 and json.loads(sent[0])["kind"] == "stage"


def test_two_runs_do_not_write_into_one_folder(finished: Path) -> None:
    with FileLock(finished / LOCK), pytest.raises(UsageError, match="another run is writing"):
        run_many([SHORT], finished, Configuration())


def test_a_folder_has_one_run_at_a_time(tmp_path: Path) -> None:
    with alone_in(tmp_path), pytest.raises(UsageError, match="another run is writing"), alone_in(tmp_path):
        pass
    with alone_in(tmp_path):
        pass


@pytest.mark.filterwarnings("ignore:flock not supported")  # filelock tells whom it concerns
def test_a_run_goes_on_where_the_file_system_knows_no_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_number: int, _how: int) -> None:
        raise OSError(errno.ENOSYS, "no flock")

    monkeypatch.setattr(out_folder.fcntl, "flock", refuse)
    with alone_in(tmp_path):
        pass


def test_a_run_alone_in_its_folder_calls_no_python_at_each_file_that_is_opened(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path;"
        "from groundstation.pipeline.many_flights.runs.out_folder import alone_in;"
        f"alone_in(Path({str(tmp_path)!r})).__enter__(); print('filelock' in sys.modules, 'asyncio' in sys.modules)"
    )
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert told.split() == ["False", "False"]


def die_or_run(job: Job, listen: Listener) -> Outcome:
    """What a worker of the next test does: the log named "killer" ends its process, another one takes a moment."""
    if job.name == "killer":
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.3)
    return Outcome(job.log, "done", "")


@pytest.mark.slow
def test_a_process_that_dies_takes_its_own_log_alone(tmp_path: Path) -> None:
    jobs = [Job(Path(name), tmp_path, Configuration()) for name in ("a", "killer", "b", "c")]
    ended = dict(side_by_side(enumerate(jobs), die_or_run, workers=2, listen=silent))
    assert [ended[number].state for number in range(4)] == ["done", "failed", "done", "done"]
    assert ended[1].text == "killer: its process died (killed, or out of memory)" and ended[1].code == 1


@pytest.mark.slow
def test_a_run_goes_on_when_a_process_is_killed(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for number, name in enumerate(("a", "killer", "z")):
        (logs / f"{name}.csv").write_bytes(SHORT.read_bytes().replace(b"# flight: ", b"# flight: %d" % number))

    def kill(event: Event) -> None:
        if event.kind == "stage" and event.name == "killer.csv" and event.text == "estimating":
            for child in multiprocessing.active_children():
                os.kill(child.pid or 0, signal.SIGKILL)

    first, killer, last = run_many([logs], tmp_path / "out", Configuration(), jobs=2, only_results=True, listen=kill)
    assert (first.state, last.state) == ("done", "done")
    assert killer.state == "failed" and killer.text == "killer.csv: its process died (killed, or out of memory)"


def hang_or_run(job: Job, listen: Listener) -> Outcome:
    """What a worker of the tests of time limits does: the log named "hang" never ends, another one takes a moment."""
    time.sleep(120.0 if job.name == "hang" else 0.3)
    return Outcome(job.log, "done", "")


@pytest.mark.slow
def test_a_log_that_takes_too_long_costs_itself_alone(tmp_path: Path) -> None:
    jobs = [Job(Path(name), tmp_path, Configuration()) for name in ("a", "hang", "b", "c", "d")]
    began = time.monotonic()
    ended = dict(side_by_side(enumerate(jobs), hang_or_run, workers=2, listen=silent, timeout_s=2.0))
    assert [ended[number].state for number in range(5)] == ["done", "failed", "done", "done", "done"]
    assert ended[1].text == "hang: not done within 2 s (--timeout), ended" and ended[1].code == 1
    assert time.monotonic() - began < 60.0 and ended_children()


@pytest.mark.slow
def test_logs_that_wait_are_run_when_all_but_a_late_one_ended_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def late_look(*arguments: object, **how: object) -> object:
        time.sleep(3.0)  # as on a machine that is busy with other work
        return wait(*arguments, **how)  # type: ignore[call-overload]

    monkeypatch.setattr(workers, "wait", late_look)
    jobs = [Job(Path(name), tmp_path, Configuration()) for name in ("hang", *"abcd")]
    ended = dict(side_by_side(enumerate(jobs), hang_or_run, workers=2, listen=silent, timeout_s=2.0))
    assert [ended[number].state for number in range(len(jobs))] == ["failed", *["done"] * 4]


def ended_children() -> bool:
    deadline = time.monotonic() + 10.0
    while multiprocessing.active_children() and time.monotonic() < deadline:
        time.sleep(0.05)
    return not multiprocessing.active_children()


@pytest.mark.slow
def test_a_time_limit_leaves_no_part_of_a_flight(tmp_path: Path) -> None:
    limited = crew_for("", 1, 1, silent, 1.0)
    assert limited.func is side_by_side  # one log, too, is run in a process that can be ended

    def stop(event: Event) -> None:
        if event.text == "estimating":
            for child in multiprocessing.active_children():
                os.kill(child.pid or 0, signal.SIGSTOP)

    (late,) = run_many([SHORT], tmp_path, Configuration(), jobs=1, timeout_s=8.0, listen=stop, only_results=True)
    assert late.state == "failed" and "not done within 8 s" in late.text
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == []
    assert ended_children()


def killed_and_continued(moments_s: list[float], folder: Path) -> None:
    """Kill a run with all its processes at each moment, then let it finish."""
    command = [sys.executable, "-m", "groundstation", "run", str(SAMPLES), "-o", str(folder), "-j", "2", "-q"]
    for moment_s in moments_s:
        process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
        time.sleep(moment_s)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=False, timeout=300)


@pytest.mark.slow
def test_killed_at_ten_moments_the_result_is_that_of_one_run(tmp_path: Path) -> None:
    run_many([SAMPLES], tmp_path / "whole", Configuration(), jobs=2)
    rng = random.Random(17)
    for number in range(5):
        killed_and_continued([rng.uniform(1.0, 12.0) for _ in range(2)], tmp_path / f"killed-{number}")
        assert_equal_runs(tmp_path / f"killed-{number}", tmp_path / "whole")
