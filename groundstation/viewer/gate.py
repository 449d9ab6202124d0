"""A gate before Rerun's catalog server, which answers any name: browsers come in by a name of this machine alone.

Viewers and programs speak HTTP/2 without encryption, which no browser does; browsers speak HTTP/1.1 and name the host
that their page asked for. The server itself listens on an address of this machine that nobody is told.
"""

import re
import secrets
import socket
import socketserver
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from groundstation.viewer.own_name import LOCAL, is_own_name

HTTP2 = b"PRI * HTTP/2.0\r\n"  # how a client begins that knows that the server speaks HTTP/2
MOST_HEAD_BYTES = 1 << 16
BLOCK_BYTES = 1 << 16
PATIENCE_S = 10.0  # for the head of the first request
REFUSAL = b"HTTP/1.1 421 Misdirected Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_HOST = re.compile(rb"\r\nhost:[ \t]*([^\r\n]*)", re.IGNORECASE)


def hidden_address() -> str:
    """One of 2^24 addresses of this machine by chance; 127.0.0.1 where the system has no others (macOS)."""
    address = f"127.{secrets.randbelow(256)}.{secrets.randbelow(256)}.{2 + secrets.randbelow(252)}"
    try:
        with socket.socket() as probe:
            probe.bind((address, 0))
    except OSError:
        return LOCAL
    return address


class Gate(socketserver.ThreadingTCPServer):
    """Passes on what may come in, byte by byte.

    Parameters
    ----------
    host : str
    port : int
        0 for any free one.

    Raises
    ------
    OSError
        When the port is taken or the address is not of this machine.
    """

    daemon_threads = True
    block_on_close = False
    request_queue_size = 64

    def __init__(self, host: str, port: int) -> None:
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.allow_reuse_address = sys.platform != "win32"  # there it lets two servers share a port
        self.behind: tuple[str, int] | None = None
        self._is_open = threading.Event()
        super().__init__((host, port), _Visitor)

    @property
    def port(self) -> int:
        """The port it listens on."""
        return int(self.server_address[1])

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take visitors until the context is left; they wait until :meth:`open` says where they are led."""
        with self:
            threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
            try:
                yield
            finally:
                self.shutdown()

    def open(self, host: str, port: int) -> None:
        """Let visitors through to an address."""
        self.behind = (host, port)
        self._is_open.set()

    def destination(self) -> tuple[str, int] | None:
        """Where visitors are led; None when it does not open in time."""
        self._is_open.wait(PATIENCE_S)
        return self.behind


class _Visitor(socketserver.BaseRequestHandler):
    request: socket.socket
    server: Gate

    def handle(self) -> None:
        with suppress(OSError):  # a visitor who leaves
            self.request.settimeout(PATIENCE_S)
            head = self._head()
            if not may_enter(head):
                self.request.sendall(REFUSAL if head else b"")
                return
            destination = self.server.destination()
            if destination is None:
                return
            with socket.create_connection(destination) as inner:
                self.request.settimeout(None)
                inner.sendall(head)
                back = threading.Thread(target=_pass_on, args=(inner, self.request), daemon=True)
                back.start()
                _pass_on(self.request, inner)
                back.join()

    def _head(self) -> bytes:
        """The first bytes, as many as tell whether the visitor may enter."""
        head = b""
        while len(head) < MOST_HEAD_BYTES and b"\r\n\r\n" not in head:
            block = self.request.recv(BLOCK_BYTES)
            if not block:
                break
            head += block
        return head


def may_enter(head: bytes) -> bool:
    """Whether a connection that begins so is let in: HTTP/2, or HTTP/1.1 with one Host, a name of this machine.

    Examples
    --------
    >>> may_enter(b"GET / HTTP/1.1\\r\\nHost: 127.0.0.1:51234\\r\\n\\r\\n")
    True
    >>> may_enter(b"GET / HTTP/1.1\\r\\nHost: pages.example\\r\\n\\r\\n")
    False
    """
    if head.startswith(HTTP2):
        return True
    lines, end, _ = head.partition(b"\r\n\r\n")
    hosts = _HOST.findall(lines)
    return bool(end) and len(hosts) == 1 and is_own_name(hosts[0].decode("latin-1"))


def _pass_on(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while block := source.recv(BLOCK_BYTES):
            target.sendall(block)
    with suppress(OSError):
        target.shutdown(socket.SHUT_WR)
