"""What is served ends by no recording, gives no page of another origin anything, and no file but what it offers."""

import http.client
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import rerun as rr

from groundstation.viewer import verification
from groundstation.viewer.fleet_catalog import catalog_server
from groundstation.viewer.launch import viewer_command, viewer_environment
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


@contextmanager
def page_of(recording: Path) -> Iterator[tuple[str, str]]:
    """Addresses of the page of `view --web` and of its data."""
    command = viewer_command(recording, web=True, port=0, headless=True)
    command[command.index("auto")] = "0"
    with tempfile.TemporaryFile() as told:
        process = subprocess.Popen(command, stdout=told, stderr=told, env=viewer_environment(os.environ) | {"CI": "1"})
        try:
            for _ in range(int(PATIENCE_S * 10)):
                told.seek(0)
                text = told.read().decode()
                page = re.search(r"web-viewer at http://([\d.]+:\d+)", text)
                data = re.search(r"gRPC connections on ([\d.]+:\d+)", text)
                if page and data:
                    break
                with pytest.raises(subprocess.TimeoutExpired):
                    process.wait(0.1)
            assert page and data, text
            yield page[1], data[1]
        finally:
            process.kill()
            process.wait()


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


def test_the_page_and_its_data_are_closed_to_other_origins(sound: Path) -> None:
    with page_of(sound) as (page, data):
        assert_only_own_pages_read(data)
        for one in (page, data):
            assert_no_file_outside(one, sound)
        status, allowed, content = asked(page, "GET", "/", Host="pages.example", Origin=STRANGER)
        assert (status, allowed) == (200, None)  # Rerun's page answers any name; there is nothing of the flight in it
        assert b"Rerun" in content and sound.stem.encode() not in content


def test_the_catalog_is_closed_to_other_origins(sound: Path) -> None:
    with catalog_server([sound], None, host="127.0.0.1", port=0) as catalog:
        address = catalog.url.removeprefix("rerun+http://")
        assert_only_own_pages_read(address)
        assert_no_file_outside(address, sound)
