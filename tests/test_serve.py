"""``serve``: a client finds every recording in the catalog; what cannot be served is one line."""

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest
import rerun as rr
import rerun.blueprint as rrb
from rerun.catalog import CatalogClient
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.cli.main import app
from groundstation.pipeline.verbs.serve import recordings_in, serve
from groundstation.results.file_names import SUMMARY
from groundstation.viewer.catalog_table import COLUMNS
from groundstation.viewer.fleet import FLIGHTS_TEXT
from groundstation.viewer.fleet_catalog import FLEET, FLIGHTS, Catalog, catalog_server, reachable
from groundstation.viewer.inner import catalog_client
from groundstation.viewer.properties import send_properties
from groundstation.viewer.recorder import FLIGHT_TIME
from groundstation.viewer.recording import save_stream, send_layout
from groundstation.viewer.views import plot
from tests.viewer_example import make_flight, make_results

IDS = ("20260504T060000Z_A12_7", "20260505T060000Z_A12_8", "NOTIME_01234567")
PATIENCE_S = 60.0


def save_recording(path: Path, identity: str, views: int = 1, text: str = "") -> None:
    """A recording of one scalar and one text, with so many views."""

    def send(stream: rr.RecordingStream) -> None:
        stream.log(FLIGHTS_TEXT, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
        stream.set_time(FLIGHT_TIME, duration=1.0)
        stream.log("speed", rr.Scalars([1.0]))
        send_layout(stream, [rrb.Vertical(contents=[plot(f"Speed {one}", "speed") for one in range(views)])])

    path.parent.mkdir(parents=True, exist_ok=True)
    save_stream(path, identity, send)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder of three flights; the second has the fullest layout."""
    for number, name in enumerate(IDS):
        save_recording(tmp_path / name / f"{name}.rrd", name, views=4 if number == 1 else 1)
        (tmp_path / name / SUMMARY).write_text("{}")
    links = "\n".join(f"[{name}]({name}/{name}.rrd)" for name in (*IDS, "gone"))
    save_recording(tmp_path / "fleet.rrd", "fleet", text=links)
    return tmp_path


def client_of(url: str) -> CatalogClient:
    """The client of a notebook; without datafusion, which it asks for but does not use to list."""
    if find_spec("datafusion") is not None:
        return CatalogClient(url)
    return catalog_client(url)


@contextmanager
def served(out: Path, say: Callable[[str], None] = lambda _: None) -> Iterator[Catalog]:
    flights, sessions, fleet = recordings_in(out, say)
    with catalog_server(flights, fleet, host="127.0.0.1", port=0, sessions=sessions) as catalog:
        yield catalog


def test_a_client_lists_every_flight_by_its_id(out: Path) -> None:
    with served(out) as catalog:
        client = client_of(catalog.url)
        assert catalog.url.startswith("rerun+http://127.0.0.1:") and not catalog.refused
        assert sorted(client.dataset_names()) == [FLEET, FLIGHTS]
        assert sorted(client.get_dataset(FLIGHTS).segment_ids()) == sorted(IDS) == list(catalog.flights)
        assert client.get_dataset(FLEET).segment_ids() == ["fleet"]


def test_flights_open_with_the_fullest_layout(out: Path) -> None:
    fullest = RrdReader(out / IDS[1] / f"{IDS[1]}.rrd").blueprints()[0].recording_id
    with served(out) as catalog:
        assert client_of(catalog.url).get_dataset(FLIGHTS).default_blueprint() == fullest


def test_flights_are_a_table_of_their_results(out: Path) -> None:
    results = make_results(make_flight(200.0, 10.0))
    for name in IDS:
        save_stream(out / name / f"{name}.rrd", name, lambda stream: send_properties(stream, results))
    with served(out) as catalog:
        dataset = client_of(catalog.url).get_dataset(FLIGHTS)
        assert catalog.table_url == f"{catalog.url}/entry/{dataset.id}"
        assert dataset.default_segment_table_blueprint() is not None
        known = dataset.schema().to_arrow().names
        listed = [f"property:{name}" for name, _ in COLUMNS if not name.startswith("magnetic")]
        shown = [name for name in listed if name in known]
        assert {"property:heading:verdict", "property:heading:error_deg", "property:flight:aircraft"} <= set(shown)


def test_the_links_of_the_fleet_lead_into_the_catalog(out: Path) -> None:
    with served(out) as catalog:
        dataset = client_of(catalog.url).get_dataset(FLEET)
        texts = [
            str(chunk.to_record_batch().column("TextDocument:text")[0].as_py()[0])
            for chunk in dataset.segment_store("fleet").stream()
            if chunk.entity_path == f"/{FLIGHTS_TEXT}"
        ]
        (linked,) = [text for text in texts if catalog.url in text]
        for name in IDS:
            assert re.search(rf"\[{name}\]\({re.escape(catalog.url)}/dataset/\w+\?segment_id={name}\)", linked)
        assert "[gone](gone/gone.rrd)" in linked


def test_recordings_without_a_layout_are_served(tmp_path: Path) -> None:
    paths = [tmp_path / IDS[0] / f"{IDS[0]}.rrd", tmp_path / "fleet.rrd"]
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        save_stream(path, path.stem, lambda stream: stream.log("speed", rr.Scalars([1.0])))
    with catalog_server(paths[:1], paths[1], host="127.0.0.1", port=0) as catalog:
        assert catalog.flights == IDS[:1] and catalog.has_fleet and not catalog.refused


def test_what_cannot_be_read_is_told_and_the_rest_is_served(out: Path) -> None:
    whole = (out / IDS[0] / f"{IDS[0]}.rrd").read_bytes()
    for name, content in (("cut", whole[: len(whole) // 2]), ("empty", b""), ("noise", b"x" * 5000), ("twin", whole)):
        (out / name).mkdir()
        (out / name / SUMMARY).write_text("{}")
        (out / name / f"{name}.rrd").write_bytes(content)
    (out / "without").mkdir()
    (out / "without" / SUMMARY).write_text("{}")
    said: list[str] = []
    with served(out, said.append) as catalog:
        assert sorted(client_of(catalog.url).get_dataset(FLIGHTS).segment_ids()) == sorted(IDS)
        assert {path.stem for path, _ in catalog.refused} <= {"cut", "empty", "noise", "twin", IDS[0]}
        assert len(catalog.refused) == 4 and all("\n" not in reason and reason for _, reason in catalog.refused)
    assert len(said) == 1 and "without" in said[0]


def test_a_busy_port_is_one_line(out: Path) -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = str(listener.getsockname()[1])
        result = CliRunner().invoke(app, ["serve", str(out), "--port", port])
    assert result.exit_code == 1 and result.stdout == ""
    assert re.fullmatch(rf"error: 127\.0\.0\.1:{port}: .*in use.*--port.*\n", result.stderr)


@pytest.mark.parametrize("host", ["192.0.2.1", "no address"])
def test_an_address_of_another_machine_is_one_line(out: Path, host: str) -> None:
    with pytest.raises(GroundstationError, match="--host"):
        serve(out, host=host, port=0, web=False, tell=print, say=print)


def test_a_folder_without_recordings_is_a_usage_error(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nothing"):
        result = CliRunner().invoke(app, ["serve", str(folder)])
        assert result.exit_code == 2 and result.stderr.count("\n") == 1 and str(folder) in result.stderr


def test_nothing_readable_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "fleet.rrd").write_bytes(b"no recording")
    result = CliRunner().invoke(app, ["serve", str(tmp_path), "--port", "0"])
    assert result.exit_code == 1 and result.stderr.splitlines()[-1].startswith(f"error: {tmp_path}: no recording")


def test_the_page_is_for_this_machine_alone(out: Path) -> None:
    with pytest.raises(UsageError, match=r"--web --host 0\.0\.0\.0"):
        serve(out, host="0.0.0.0", port=0, web=True, tell=print, say=print)


def test_a_server_on_every_address_is_called_by_the_name_of_its_machine() -> None:
    assert reachable("rerun+http://0.0.0.0:51234") == f"rerun+http://{socket.gethostname()}:51234"


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process")
def test_serves_until_ctrl_c(out: Path) -> None:
    command = [
        sys.executable,
        "-c",
        "from groundstation.cli.main import main; main()",
        "serve",
        str(out),
        "--port",
        "0",
    ]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | {"CI": "1"}
    )
    assert process.stdout is not None and process.stderr is not None
    try:
        url = process.stdout.readline().strip()
        assert sorted(client_of(url).get_dataset(FLIGHTS).segment_ids()) == sorted(IDS)
        assert f"groundstation view {url}" in process.stderr.readline()
        assert "Ctrl-C" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, rest = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 0 and rest == "ended\n"
