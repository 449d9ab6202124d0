"""Logs and results in a bucket, and work on a cluster: the results are those of a run on this machine."""

import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.request import Request, urlopen

import fsspec
import pytest
from distributed import Client

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.many_flights.processes.cluster import on_cluster
from groundstation.pipeline.many_flights.remote.folder import RemoteFolder, far_logs
from groundstation.pipeline.many_flights.remote.lease import alone_elsewhere
from groundstation.pipeline.many_flights.runs.batch import run_many
from groundstation.pipeline.many_flights.runs.dry_run import plan_many
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event
from tests.test_resume import SETTINGS, SHORT, assert_equal_runs, tell_and_sleep

SAMPLES = SHORT.parent
FEW = ("taxi-short.csv", "taxi-notime.csv")


@pytest.fixture
def memory() -> str:
    """A store in the memory of this process."""
    store = fsspec.filesystem("memory")
    store.store.clear()
    store.pseudo_dirs[:] = [""]
    return "memory://"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    for name in FEW:
        shutil.copy(SAMPLES / name, folder)
    (folder / "broken.csv").write_text("time_s,ins.true_heading_deg\n")
    return folder


def sent(folder: Path, url: str) -> str:
    RemoteFolder(url).send(folder)
    return url


def fetched(url: str, target: Path) -> Path:
    far = RemoteFolder(url)
    for name in far.files():
        if not name.startswith("."):
            far.fetch(name, target / name)
    return target


def test_a_run_elsewhere_gives_what_a_run_here_gives(
    memory: str, logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = tmp_path / "whole"
    run_many([logs], whole, Configuration(), jobs=1)
    source, out = sent(logs, f"{memory}logs"), f"{memory}out"
    first = run_many([source], out, Configuration(), jobs=1)
    assert [one.state for one in first] == ["failed", "done", "done"]
    assert first[0].source == f"{source}/broken.csv"
    copy = fetched(out, tmp_path / "copy")
    # the one difference is where the logs are: the index names the broken one by its place
    text = (copy / "index.json").read_text().replace(f"{source}/", f"{logs}/")
    (copy / "index.json").write_text(text)
    (copy / "index.csv").write_text((copy / "index.csv").read_text().replace(f"{source}/", f"{logs}/"))
    (copy / ".lock").touch()
    assert_equal_runs(copy, whole)
    assert [name for name in RemoteFolder(out).names() if name == ".staging"] == []


@pytest.mark.slow
def test_what_is_finished_elsewhere_is_not_done_again(
    memory: str, finished_run: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, source = f"{memory}out", f"{memory}logs"
    RemoteFolder(source).write(SHORT.name, SHORT.read_bytes())
    told: list[str] = []

    def listen(event: Event) -> None:
        told.append(event.text if event.kind == "stage" else "")

    run_many([source], out, Configuration(), jobs=1, with_pdf=False)
    (again,) = run_many([source], out, Configuration(), jobs=1, with_pdf=False, listen=listen)
    assert again.state == "done" and set(told) == {""}
    run_many([source], out, SETTINGS, jobs=1, listen=listen)
    assert "estimating" in told and "converting" not in told
    copy = fetched(out, tmp_path / "copy")
    (copy / ".lock").touch()
    assert_equal_runs(copy, Path(finished_run(SHORT.stem, SETTINGS).folder).parent)


@pytest.mark.slow
def test_a_flight_elsewhere_loses_its_pdf_and_keeps_what_somebody_put_there(
    memory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, source = f"{memory}out", f"{memory}logs"
    far = RemoteFolder(out)
    RemoteFolder(source).write(SHORT.name, SHORT.read_bytes())
    (done,) = run_many([source], out, Configuration(), jobs=1, with_pdf=True)
    far.write(f"{done.flight_id}/notes.txt", b"mine")
    assert json.loads(far.read(f"{done.flight_id}/manifest.json") or b"")["source"]["path"] == f"{source}/{SHORT.name}"
    pdfs = f"{done.flight_id}/report.pdf", "summary.pdf"
    (content,) = {far.read(pdfs[0])} - {None}
    run_many([source], out, Configuration(), jobs=1)  # nothing: they tell of what is there
    assert far.read(pdfs[0]) == content and pdfs[1] in far.files()
    far.remove(pdfs[0])
    page = far.read(f"{done.flight_id}/report.html")
    run_many([source], out, Configuration(), jobs=1, with_pdf=True)  # the PDF alone
    assert far.read(pdfs[0]) == content and far.read(f"{done.flight_id}/report.html") == page
    run_many([source], out, SETTINGS, jobs=1)  # the analysis
    assert pdfs[0] not in far.files()
    assert far.read(f"{done.flight_id}/notes.txt") == b"mine"


def test_places_that_cannot_be_reached_are_told_in_one_line(memory: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        far_logs(f"{memory}nothing")
    with pytest.raises(UsageError, match="fsspec reaches"):
        RemoteFolder("nosuchprotocol://x")
    RemoteFolder(f"{memory}mine").write("photo.jpg", b"x")
    with pytest.raises(UsageError, match="did not make"):
        run_many([SHORT], f"{memory}mine", Configuration())
    with pytest.raises(UsageError, match="local ones"):
        plan_many([SHORT], f"{memory}out", Configuration())
    with pytest.raises(GroundstationError):
        RemoteFolder(f"{memory}out").fetch("nothing", tmp_path / "x")


def test_what_groundstation_made_is_no_log(memory: str) -> None:
    far = RemoteFolder(f"{memory}flights")
    for name in (
        "a.ulg",
        "sub/b.csv",
        ".hidden/c.csv",
        "out/index.json",
        "out/x/x.mcap",
        "one/manifest.json",
        "one/one.mcap",
    ):
        far.write(name, b"x")
    assert [log.url.removeprefix(far.url) for log in far_logs(far.url)] == ["/a.ulg", "/sub/b.csv"]
    assert far_logs(f"{far.url}/a.ulg") == [(f"{far.url}/a.ulg", True, 1)]


@pytest.mark.slow
def test_twins_elsewhere_are_run_once(memory: str) -> None:
    source, told = RemoteFolder(f"{memory}logs"), []
    content = SHORT.read_bytes()
    for name, one in {"a.csv": content, "b.csv": content, "c.csv": b"!" + content[1:]}.items():
        source.write(name, one)

    def listen(event: Event) -> None:
        if event.text == "estimating":
            told.append(event.name)

    outcomes = run_many([source.url], f"{memory}out", Configuration(), jobs=1, with_pdf=False, listen=listen)
    assert [one.state for one in outcomes][:2] == ["done", "skipped"]
    assert outcomes[1].text == f"b.csv: same content as {source.url}/a.csv, listed once"
    assert told.count("b.csv") == 0 and told.count("a.csv") == 1


def test_one_run_at_a_time_writes_into_a_place_elsewhere(memory: str, monkeypatch: pytest.MonkeyPatch) -> None:
    out = RemoteFolder(f"{memory}out")
    with alone_elsewhere(out):
        with pytest.raises(UsageError, match=rf"another run is writing into it \({platform.node()}, process \d+\)"):
            run_many([SHORT], out.url, Configuration())
        assert out.names() == [".lock"]
    assert out.names(".lock") == []
    dead = f'{{"token": "x", "owner": "gone", "until_s": {time.time() - 1.0}}}'.encode()
    out.write(".lock/6", dead)
    with alone_elsewhere(out) as lease:  # nobody renewed it
        assert out.names(".lock") == ["7"]
        lease.require()
        out.write(".lock/8", json.dumps({"token": "y", "owner": "other", "until_s": time.time() + 9.0}).encode())
        with pytest.raises(GroundstationError, match=r"another run took over \(other\)"):
            lease.require()
    assert out.names(".lock") == ["8"]
    out.remove(".lock/8")
    with alone_elsewhere(out):  # lock 0; it ended, one took over and ended, and a third began
        out.write(".lock/0", json.dumps({"token": "z", "owner": "third", "until_s": time.time() + 9.0}).encode())
    assert out.names(".lock") == ["0"]
    out.remove(".lock/0")
    out.write(".lock/8", b"not a lock")
    monkeypatch.setattr("groundstation.pipeline.many_flights.remote.lease.RENEW_S", 0.05)
    with alone_elsewhere(out):
        first = json.loads(out.read(".lock/9") or b"")["until_s"]
        deadline = time.monotonic() + 10.0
        while json.loads(out.read(".lock/9") or b"")["until_s"] <= first:
            assert time.monotonic() < deadline
            time.sleep(0.02)


def test_a_run_that_another_one_overtook_puts_nothing_in_place(memory: str) -> None:
    out = RemoteFolder(f"{memory}out")
    other = json.dumps({"token": "y", "owner": "other", "until_s": time.time() + 600.0}).encode()

    def overtake(event: Event) -> None:
        if event.text == "estimating":
            out.write(".lock/1", other)

    with pytest.raises(GroundstationError, match=r"another run took over \(other\)"):
        run_many([SHORT], out.url, Configuration(), jobs=1, with_pdf=False, only_results=True, listen=overtake)
    assert [name for name in out.names() if not name.startswith(".")] == [] and out.names(".lock") == ["1"]


def begun_together(out: RemoteFolder, runs: int = 8) -> list[str]:
    """What becomes of runs that begin at the same moment in one place; who is let in stays until all have tried."""
    together, found, all_tried = threading.Barrier(runs), [], threading.Event()

    def tell(what: str) -> None:
        found.append(what)
        if len(found) == runs:
            all_tried.set()

    def begin() -> None:
        together.wait()
        try:
            with alone_elsewhere(RemoteFolder(out.url)):
                tell("alone")
                all_tried.wait(60.0)
        except UsageError:
            tell("refused")

    threads = [threading.Thread(target=begin) for _ in range(runs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return sorted(found)


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A bucket of a server on this machine."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    urlopen(Request(f"http://{host}:{port}/moto-api/reset", method="POST")).close()  # servers of one process share it
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    fsspec.filesystem("s3").clear_instance_cache()
    fsspec.filesystem("s3", skip_instance_cache=True).mkdir("flights")
    yield "s3://flights"
    fsspec.filesystem("s3").clear_instance_cache()
    server.stop()


@pytest.mark.slow
def test_a_bucket_lets_one_of_several_runs_begin(bucket: str) -> None:
    out = RemoteFolder(f"{bucket}/out")
    assert begun_together(out) == ["alone", *["refused"] * 7]
    out.write(".lock/3", b'{"token": "x", "owner": "gone", "until_s": 0}')
    assert begun_together(out) == ["alone", *["refused"] * 7]


@pytest.mark.slow
def test_a_cluster_loses_nothing_when_a_worker_is_killed(bucket: str, logs: Path, tmp_path: Path) -> None:
    from distributed import LocalCluster

    whole = tmp_path / "whole"
    run_many([logs], whole, Configuration(), jobs=1)
    source, out = sent(logs, f"{bucket}/logs"), f"{bucket}/out"
    killed = threading.Event()
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:

        def kill_when_busy() -> None:
            while not any(worker.processing for worker in cluster.scheduler.workers.values()):
                time.sleep(0.02)
            time.sleep(1.0)
            busy = next(
                (worker for worker in cluster.scheduler.workers.values() if worker.processing),
                next(iter(cluster.scheduler.workers.values())),
            )
            process = next(nanny for nanny in cluster.workers.values() if nanny.worker_address == busy.address).process
            os.kill(process.pid, signal.SIGKILL)
            killed.set()

        thread = threading.Thread(target=kill_when_busy)
        thread.start()
        outcomes = run_many([source], out, Configuration(), scheduler=cluster.scheduler_address)
        thread.join()
    assert killed.is_set()
    assert [one.state for one in outcomes] == ["failed", "done", "done"]
    copy = fetched(out, tmp_path / "copy")
    for name in ("index.json", "index.csv"):
        (copy / name).write_text((copy / name).read_text().replace(f"{source}/", f"{logs}/"))
    (copy / ".lock").touch()
    assert_equal_runs(copy, whole)


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_told_in_one_line(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler_file = tmp_path / "scheduler.json"
    scheduler = subprocess.Popen(
        [*command, "--no-dashboard", "--scheduler-file", str(scheduler_file)], stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + 120.0
    while not scheduler_file.exists() or not scheduler_file.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    address = json.loads(scheduler_file.read_text())["address"]
    worker = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--no-dashboard"],
        stderr=subprocess.DEVNULL,
        cwd=SAMPLES.parent,
    )
    began = tmp_path / "worker"

    def kill_when_begun() -> None:
        while not began.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        scheduler.kill()

    try:
        with Client(address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        job = Job(tmp_path / "x", tmp_path, Configuration())
        waiting = on_cluster(iter([(0, job)]), tell_and_sleep, scheduler=address)
        threading.Thread(target=kill_when_begun, daemon=True).start()
        with pytest.raises(GroundstationError, match="the scheduler is gone"):
            list(waiting)
        assert caplog.text == ""
    finally:
        scheduler.kill()
        worker.kill()


def test_a_scheduler_that_does_not_answer_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.pipeline.many_flights.processes.cluster.CONNECT_S", 1.0)
    with pytest.raises(UsageError, match="no scheduler answers"):
        run_many([SHORT], tmp_path / "out", Configuration(), scheduler="tcp://127.0.0.1:1")
