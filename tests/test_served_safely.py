"""What is served ends by no recording, gives no page of another origin anything, and no file but what it offers."""

import http.client
import os
import socket
import socketserver
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
import rerun as rr

from groundstation.base.errors import GroundstationError
from groundstation.pipeline.verbs.view import look_at
from groundstation.viewer import inner, launch, verification
from groundstation.viewer.fleet_catalog import catalog_server
from groundstation.viewer.gate import GateServer, request_of
from groundstation.viewer.own_page import page_files, page_server
from groundstation.viewer.recorder import FLIGHT_TIME
from groundstation.viewer.recording import save_stream
from groundstation.viewer.verification import damaged

STRANGER = "http://pages.example"
PATIENCE_S = 60.0
OUTSIDE = ("/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/{file}")


def save(path: Path) -> Path:
    def send(stream: rr.RecordingStream) -> None:
        for second in range(200):
            stream.set_time(FLIGHT_TIME, duration=float(second))
            stream.log("speed", rr.Scalars([second * 1.37]))

    save_stream(path, path.stem, send)
    return path


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(tmp_path_factory.mktemp("recordings") / "sound.rrd")


def altered(sound: Path, path: Path) -> Path:
    """The recording with half of a chunk turned over; its head, footer and length are as they were."""
    content = bytearray(sound.read_bytes())
    first = len(content) // 3
    content[first : first + 400] = bytes(255 - byte for byte in content[first : first + 400])
    path.write_bytes(content)
    return path


def test_a_recording_with_altered_bytes_is_told_and_the_rest_is_served(sound: Path, tmp_path: Path) -> None:
    bad = altered(sound, tmp_path / "altered.rrd")
    with catalog_server([bad, sound], altered(sound, tmp_path / "fleet.rrd"), host="127.0.0.1", port=0) as catalog:
        assert (catalog.flights, catalog.has_fleet) == (("sound",), False)
        assert {path.name for path, _ in catalog.refused} == {"altered.rrd", "fleet.rrd"}
        assert all(reason and "\n" not in reason and str(tmp_path) not in reason for _, reason in catalog.refused)


def test_a_damaged_recording_is_not_opened(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Path] = []

    def open_viewer(what: Path, **_: object) -> int:
        opened.append(what)
        return 0

    monkeypatch.setattr(launch, "open_viewer", open_viewer)
    look = partial(look_at, web=True, host="127.0.0.1", port=None, profile=None, say=print)
    with pytest.raises(GroundstationError, match=r"altered\.rrd: damaged: "):
        look(str(altered(sound, tmp_path / "altered.rrd")))
    look(str(sound))
    assert opened == [sound]


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for Rerun's executable is a script of the shell")
@pytest.mark.parametrize("end", ["kill -ABRT $$", "exit 101", "sleep 60"])
def test_a_recording_that_ends_or_hangs_its_reader_is_left_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, end: str
) -> None:
    reader = tmp_path / "rerun"
    reader.write_text(f'#!/bin/sh\ncase "$*" in *killer*) {"exec " * end.startswith("sleep")}{end};; esac\n')
    reader.chmod(0o755)
    monkeypatch.setattr(verification, "viewer_executable", lambda: reader)
    monkeypatch.setattr(verification, "PATIENCE_S", 1.0)
    recordings = [Path(f"{name}.rrd") for name in ("a", "b", "killer", "c")]
    found = damaged(recordings)
    assert list(found) == [Path("killer.rrd")] and found[Path("killer.rrd")]


def asked(address: str, method: str, path: str, **headers: str) -> tuple[int, str | None, bytes]:
    """Status, which origin may read the answer, and the answer."""
    where = urlsplit(f"http://{address}")
    connection = http.client.HTTPConnection(where.hostname or "", where.port, timeout=PATIENCE_S)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, text in headers.items():
            connection.putheader(name.replace("_", "-"), text)
        connection.endheaders()
        response = connection.getresponse()
        return response.status, response.getheader("Access-Control-Allow-Origin"), response.read()
    finally:
        connection.close()


def assert_only_own_pages_read(data: str) -> None:
    """Data are given to pages of this machine alone: the browser keeps an answer from an origin that is not named."""
    wish = {"Access_Control_Request_Method": "POST", "Access_Control_Request_Headers": "content-type,x-grpc-web"}
    assert asked(data, "OPTIONS", "/", Origin=STRANGER, **wish)[1] is None
    assert asked(data, "OPTIONS", "/", Origin=f"{STRANGER}:80", **wish)[1] is None
    assert asked(data, "OPTIONS", "/", Origin="null", **wish)[1] is None
    assert asked(data, "OPTIONS", "/", Origin="http://127.0.0.1.pages.example", **wish)[1] is None
    assert asked(data, "OPTIONS", "/", Origin="http://localhost:9090", **wish)[1] == "http://localhost:9090"


def assert_no_file_outside(address: str, file: Path) -> None:
    for path in OUTSIDE:
        status, _, content = asked(address, "GET", path.format(file=file.absolute().as_posix()))
        assert status in (400, 404) and content == b"", path


PAGE = {"/": ("text/html", b"the viewer")}


@pytest.fixture
def page(sound: Path) -> Iterator[str]:
    with page_server(sound, PAGE, host="127.0.0.1", port=0) as server:
        yield server.url.removeprefix("http://")


def test_the_page_leads_to_its_recording(page: str, sound: Path) -> None:
    connection = http.client.HTTPConnection(page, timeout=PATIENCE_S)
    connection.request("GET", "/")
    response = connection.getresponse()
    response.read()
    assert (response.status, response.getheader("Location")) == (302, f"/?url=http://{page}/sound.rrd")
    assert asked(page, "GET", f"/?url=http://{page}/sound.rrd") == (200, None, b"the viewer")
    assert asked(page, "GET", "/sound.rrd") == (200, None, sound.read_bytes())
    assert asked(page, "HEAD", "/sound.rrd") == (200, None, b""), "as curl -I asks"


def test_a_recording_of_any_name_is_found(sound: Path, tmp_path: Path) -> None:
    odd = tmp_path / "a&b #1 50%.rrd"
    odd.write_bytes(sound.read_bytes())
    with page_server(odd, PAGE, host="127.0.0.1", port=0) as server:
        address = server.url.removeprefix("http://")
        connection = http.client.HTTPConnection(address, timeout=PATIENCE_S)
        connection.request("GET", "/")
        asked_for = parse_qs(urlsplit(connection.getresponse().headers["Location"]).query)["url"][0]
        connection.close()
        assert asked(address, "GET", urlsplit(asked_for).path) == (200, None, sound.read_bytes())


def test_a_page_at_no_port_is_one_line(sound: Path) -> None:
    with pytest.raises(GroundstationError, match="99999"), page_server(sound, PAGE, host="127.0.0.1", port=99999):
        pass


@pytest.mark.parametrize(
    ("wish", "status", "first", "end"),
    [
        ("bytes=10-19", 206, 10, 20),
        ("bytes=10-", 206, 10, None),
        ("bytes=0-99999999", 206, 0, None),
        ("bytes=99999999-", 416, 0, 0),
        ("bytes=20-10", 416, 0, 0),
        ("words=1-2", 200, 0, None),
    ],
)
def test_parts_of_a_recording(page: str, sound: Path, wish: str, status: int, first: int, end: int | None) -> None:
    assert asked(page, "GET", "/sound.rrd", Range=wish) == (status, None, sound.read_bytes()[first:end])


def test_the_page_and_its_recording_answer_their_own_names_alone(page: str, sound: Path) -> None:
    assert_no_file_outside(page, sound)
    for path in ("/", "/sound.rrd"):
        for stranger in (
            "pages.example",
            "pages.example:80",
            "127.0.0.1.pages.example",
            "localhost:1@pages.example",
            "",
        ):
            assert asked(page, "GET", path, Host=stranger, Origin=STRANGER) == (421, None, b"")
    assert asked(page, "GET", "/sound.rrd", Host="localhost:1", Origin=STRANGER)[:2] == (200, None)


@pytest.mark.slow
def test_the_files_of_the_page_are_there() -> None:
    files = page_files(inner.viewer_executable(), launch.viewer_environment(os.environ))
    assert b"Rerun" in files["/"][1] and files["/re_viewer_bg.wasm"][1].startswith(b"\0asm")


def test_the_catalog_is_closed_to_other_origins(sound: Path) -> None:
    with catalog_server([sound], None, host="127.0.0.1", port=0) as catalog:
        address = catalog.url.removeprefix("rerun+http://")
        assert_only_own_pages_read(address)
        assert_no_file_outside(address, sound)
        status, _, content = asked(address, "GET", "/", Host="pages.example", Origin=STRANGER)
        assert (status, content) == (421, b"")
        assert asked(address, "GET", "/", Host=f"localhost:{address.rpartition(':')[2]}")[0] != 421
        gates = inner.catalog_client(catalog.url)
        assert gates.get_dataset("flights").segment_ids() == ["sound"]  # a program comes in


@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nhOST: pages.example\r\n\r\n",
        b"GET / HTTP/1.1\r\nX: y\r\n\r\nHost: 127.0.0.1\r\n\r\n",
        b"PRI / HTTP/1.1\r\nHost: pages.example\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\nGET / HTTP/1.1\r\nHost: pages.example\r\n\r\n",
        b"GET / HTTP/1.1\nHost: pages.example\n\nX: y\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n X: folded\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : 127.0.0.1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: +1\r\n\r\n",
    ],
)
def test_who_does_not_name_this_machine_stays_outside(head: bytes) -> None:
    assert request_of(head) is None


class _Echo(socketserver.BaseRequestHandler):
    """Answers with all that it is sent, for as long as it is sent something: as a server that keeps connections."""

    def handle(self) -> None:
        while block := self.request.recv(1 << 16):
            self.request.sendall(block)


@pytest.fixture
def gate() -> Iterator[GateServer]:
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), _Echo) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
        entry = GateServer("127.0.0.1", 0)
        with entry.listening():
            entry.open("127.0.0.1", server.server_address[1])
            yield entry
        server.shutdown()


def passed(gate: GateServer, *blocks: bytes) -> bytes:
    """What of some blocks the server behind the gate gets."""
    with socket.create_connection(("127.0.0.1", gate.port), timeout=PATIENCE_S) as visitor:
        for block in blocks:
            visitor.sendall(block)
            time.sleep(0.05)
        visitor.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: visitor.recv(1 << 16), b""))


OWN = b"POST /a HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\nConnection: keep-alive, Upgrade\r\n\r\n"
OTHER = b"GET /b HTTP/1.1\r\nHost: pages.example\r\n\r\n"


def test_every_request_is_looked_at_not_the_first_alone(gate: GateServer) -> None:
    sent = OWN.replace(b"keep-alive, Upgrade", b"close")
    assert passed(gate, OWN + b"body" + OTHER) == sent + b"body"
    assert passed(gate, OWN + b"bo", b"dy" + OTHER, OTHER) == sent + b"body"
    assert passed(gate, OWN, b"body", OTHER) == sent + b"body"
    assert passed(gate, OTHER).startswith(b"HTTP/1.1 421 ")


def test_a_program_keeps_its_connection(gate: GateServer) -> None:
    everything = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"frames", OTHER
    assert passed(gate, *everything) == b"".join(everything)
