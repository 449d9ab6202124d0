"""Server of Rerun's web viewer with one recording, under this machine's own names alone.

Viewer and recording come from one origin. Rerun's page holds the viewer and nothing of a flight; its files are taken
from its own server, which then ends.
"""

import http.client
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import TCPServer
from urllib.parse import quote, unquote, urlsplit

from groundstation.base.errors import GroundstationError
from groundstation.viewer.inner import LENGTH_HEADER, PAGE_FILES, page_port
from groundstation.viewer.own_name import LOCAL, is_own_name

BINARY = "application/octet-stream"
NOWHERE = "http://127.0.0.1:9/none.rrd"  # a recording elsewhere: Rerun then serves its page and no data
PATIENCE_S = 30.0
_RANGE = re.compile(r"bytes=(\d+)-(\d*)$")


def page_files(executable: Path, environment: Mapping[str, str]) -> dict[str, tuple[str, bytes]]:
    """Return files of Rerun's web viewer: media type and content by path (43 MB in all).

    Parameters
    ----------
    executable : Path
        The viewer.
    environment : mapping of str to str
        Its environment, in which it may log.

    Raises
    ------
    GroundstationError
        When the viewer does not give its page.
    """
    command = [str(executable), NOWHERE, "--bind", LOCAL, "--port", "auto", "--serve-web"]
    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder, (Path(folder) / "log").open("wb") as told:
        process = subprocess.Popen(
            [*command, "--web-viewer-port", "0"],
            stdin=subprocess.DEVNULL,
            stdout=told,
            stderr=told,
            env={**environment, "CI": "1", "NO_COLOR": "1"},
        )
        try:
            port = _told_port(process, Path(folder) / "log")
            return {path: _fetched(port, path) for path in PAGE_FILES}
        except OSError as error:
            raise GroundstationError("the Rerun web viewer", f"does not serve its page ({error})") from error
        finally:
            process.kill()
            process.wait()


def _told_port(process: "subprocess.Popen[bytes]", log: Path) -> int:
    """Return the port of the page, which Rerun logs."""
    deadline = time.monotonic() + PATIENCE_S
    text = ""
    while time.monotonic() < deadline and process.poll() is None:
        text = log.read_text(errors="replace")
        for line in text.splitlines():
            if (port := page_port(line)) is not None:
                return port
        time.sleep(0.05)
    raise GroundstationError("the Rerun web viewer", f"did not start: {text.strip()[-200:] or 'no output'}")


def _fetched(port: int, path: str) -> tuple[str, bytes]:
    connection = http.client.HTTPConnection(LOCAL, port, timeout=PATIENCE_S)
    try:
        connection.request("GET", path)
        response = connection.getresponse()
        content = response.read()
        if response.status != http.HTTPStatus.OK:
            raise OSError(f"{path}: {response.status}")
        return response.getheader("Content-Type", BINARY), content
    finally:
        connection.close()


@contextmanager
def page_server(
    recording: Path, files: Mapping[str, tuple[str, bytes]], *, host: str, port: int
) -> Iterator["PageServer"]:
    """Serve the viewer's page and a recording until the context is left.

    Raises
    ------
    GroundstationError
        When the port is taken or the address is not of this machine.
    """
    try:
        server = PageServer(recording, files, host, port)
    except (OSError, OverflowError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise GroundstationError(f"{host}:{port}", reason, next_step="choose another --port or --host") from error
    with server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
        try:
            yield server
        finally:
            server.shutdown()


class PageServer(ThreadingHTTPServer):
    """Server of the page's paths and that of the recording, nothing else.

    Parameters
    ----------
    recording : Path
    files : mapping of str to (str, bytes)
        What :func:`page_files` gives.
    host : str
    port : int
        0 for any free one.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, recording: Path, files: Mapping[str, tuple[str, bytes]], host: str, port: int) -> None:
        self.recording, self.files = recording, files
        self.allow_reuse_address = sys.platform != "win32"  # there it lets two servers share a port
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        super().__init__((host, port), _Visitor)

    def server_bind(self) -> None:
        """Bind without asking for the name of the address, which may take seconds."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])

    @property
    def url(self) -> str:
        """Address of the page for a browser of this machine."""
        host, port = str(self.server_address[0]), self.server_address[1]
        name = LOCAL if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
        return f"http://{name}:{port}"


class _Visitor(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "groundstation", ""
    timeout = 60.0

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or not is_own_name(hosts[0]):
            self._refuse(http.HTTPStatus.MISDIRECTED_REQUEST)
            return
        asked = urlsplit(self.path) if self.path.startswith("/") and not self.path.startswith("//") else urlsplit("")
        if asked.path == "/" and not asked.query:
            recording = f"http://{hosts[0].strip()}/{quote(self.server.recording.name)}"
            self._answer(http.HTTPStatus.FOUND, 0, Location=f"/?url={quote(recording, safe=':/[]')}")
        elif asked.path in self.server.files:
            kind, content = self.server.files[asked.path]
            self._answer(http.HTTPStatus.OK, len(content), Content_Type=kind, **{LENGTH_HEADER: str(len(content))})
            if self.command == "GET":
                with suppress(OSError):  # a visitor who leaves
                    self.wfile.write(content)
        elif unquote(asked.path) == f"/{self.server.recording.name}":
            self._send_recording()
        else:
            self._refuse(http.HTTPStatus.NOT_FOUND)

    def _send_recording(self) -> None:
        try:
            file = self.server.recording.open("rb")
        except OSError:
            self._refuse(http.HTTPStatus.NOT_FOUND)
            return
        with file:
            size = os.fstat(file.fileno()).st_size
            wish = _RANGE.match(self.headers.get("Range", ""))
            start = int(wish[1]) if wish else 0
            end = min(int(wish[2]) + 1, size) if wish and wish[2] else size
            if wish and not start < end:
                self._answer(http.HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, 0, Content_Range=f"bytes */{size}")
                return
            told = {"Content_Range": f"bytes {start}-{end - 1}/{size}"} if wish else {}
            status = http.HTTPStatus.PARTIAL_CONTENT if wish else http.HTTPStatus.OK
            self._answer(status, end - start, Content_Type=BINARY, Accept_Ranges="bytes", **told)
            file.seek(start)
            if self.command == "GET":
                with suppress(OSError):
                    self._copy(file.read, end - start)

    def _copy(self, read: Callable[[int], bytes], length: int) -> None:
        while length > 0 and (block := read(min(length, 1 << 18))):
            self.wfile.write(block)
            length -= len(block)
        self.close_connection |= length > 0  # the file became shorter meanwhile

    def _refuse(self, status: http.HTTPStatus) -> None:
        self.close_connection = True
        self._answer(status, 0)

    def _answer(self, status: http.HTTPStatus, length: int, **headers: str) -> None:
        self.send_response(status)
        always = {"Content-Length": str(length), "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store"}
        always["Cross-Origin-Resource-Policy"] = "same-origin"
        for name, text in (always | headers).items():
            self.send_header(name.replace("_", "-"), text)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Log no requests."""
