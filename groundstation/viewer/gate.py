"""Gate before Rerun's catalog server, for browsers that use this machine's own names.

The server itself answers to any host name. Viewers and programs speak HTTP/2 without encryption, which no browser does;
browsers speak HTTP/1.1 and name the host that their page asked for. Each connection of HTTP/1.1 takes one request, so
that every request is looked at. The server itself listens on an address of this machine that nobody is told.
"""

import math
import re
import secrets
import socket
import socketserver
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NamedTuple

from groundstation.viewer.own_name import LOCAL, is_own_name

HEAD_END = b"\r\n\r\n"
HTTP2 = b"PRI * HTTP/2.0\r\n"  # how a client begins that knows that the server speaks HTTP/2
MOST_HEAD_BYTES = 1 << 16
BLOCK_BYTES = 1 << 16
PATIENCE_S = 10.0  # for the head of the first request
REFUSAL = b"HTTP/1.1 421 Misdirected Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
LENGTH_DIGITS = 18  # of the length of a body
_FIRST = re.compile(rb"[A-Z]+ [!-~]+ HTTP/1\.[01]")
_LINE = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*([^\r\n\0]*)")
_OF_THE_CONNECTION = (b"connection", b"keep-alive", b"proxy-connection", b"upgrade", b"http2-settings")


def hidden_address() -> str:
    """Return a random one of 2^24 addresses of this machine.

    127.0.0.1 where the system has no others (macOS).
    """
    address = f"127.{secrets.randbelow(256)}.{secrets.randbelow(256)}.{2 + secrets.randbelow(252)}"
    try:
        with socket.socket() as probe:
            probe.bind((address, 0))
    except OSError:
        return LOCAL
    return address


class GateServer(socketserver.ThreadingTCPServer):
    """Server that forwards permitted connections, byte by byte.

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
        """Port it listens on."""
        return int(self.server_address[1])

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Accept connections until the context is left.

        They wait until :meth:`open` sets their destination.
        """
        with self:
            threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()
            try:
                yield
            finally:
                self.shutdown()

    def open(self, host: str, port: int) -> None:
        """Let waiting connections through to an address."""
        self.behind = (host, port)
        self._is_open.set()

    def destination(self) -> tuple[str, int] | None:
        """Return the address that connections are forwarded to.

        None when the gate does not open in time.
        """
        self._is_open.wait(PATIENCE_S)
        return self.behind


class _Visitor(socketserver.BaseRequestHandler):
    request: socket.socket
    server: GateServer

    def handle(self) -> None:
        with suppress(OSError):  # a visitor who leaves
            self.request.settimeout(PATIENCE_S)
            head, rest = self._head()
            wanted = None if head.startswith(HTTP2) else request_of(head)
            if wanted is None and not head.startswith(HTTP2):
                self.request.sendall(REFUSAL if head else b"")
                return
            destination = self.server.destination()
            if destination is None:
                return
            with socket.create_connection(destination) as inner:
                self.request.settimeout(None)
                back = threading.Thread(target=_answer, args=(inner, self.request, wanted is not None), daemon=True)
                back.start()
                if wanted is None:
                    _pass_on(self.request, inner, head + rest)
                else:
                    inner.sendall(wanted.head)
                    _pass_on(self.request, inner, rest, wanted.body_bytes)
                back.join()

    def _head(self) -> tuple[bytes, bytes]:
        """Return the first head of the connection, to its end, and the bytes after it."""
        head = b""
        while len(head) < MOST_HEAD_BYTES and HEAD_END not in head:
            block = self.request.recv(BLOCK_BYTES)
            if not block:
                break
            head += block
        first, end, rest = head.partition(HEAD_END)
        return first + end, rest


class Request(NamedTuple):
    """Request to forward: a head that ends the connection, and the length of its body."""

    head: bytes
    body_bytes: int


def request_of(head: bytes) -> Request | None:
    """Return the first request of a connection of HTTP/1.1, if its one Host is this machine.

    None else, and where two readers of it might see two requests: ends of lines that are none, a body without a
    length, or with two.

    Examples
    --------
    >>> request_of(b"GET / HTTP/1.1\\r\\nHost: 127.0.0.1:51234\\r\\n\\r\\n").head
    b'GET / HTTP/1.1\\r\\nHost: 127.0.0.1:51234\\r\\nConnection: close\\r\\n\\r\\n'
    >>> request_of(b"GET / HTTP/1.1\\r\\nHost: pages.example\\r\\n\\r\\n") is None
    True
    """
    lines, end, rest = head.partition(HEAD_END)
    first, *others = lines.split(b"\r\n")
    found = [_LINE.fullmatch(line) for line in others]
    if not end or rest or not _FIRST.fullmatch(first) or None in found:
        return None
    fields = [(line[1].lower(), line[2].strip()) for line in found if line is not None]
    hosts, lengths = ([text for name, text in fields if name == wanted] for wanted in (b"host", b"content-length"))
    is_sized = len(lengths) <= 1 and all(one.isdigit() and len(one) <= LENGTH_DIGITS for one in lengths)
    if b"transfer-encoding" in dict(fields) or not is_sized:
        return None
    if len(hosts) != 1 or not is_own_name(hosts[0].decode("latin-1")):
        return None
    kept = [line for line, (name, _) in zip(others, fields, strict=True) if name not in _OF_THE_CONNECTION]
    passed = b"\r\n".join((first, *kept, b"Connection: close")) + HEAD_END
    return Request(passed, int(lengths[0]) if lengths else 0)


def _pass_on(source: socket.socket, target: socket.socket, first: bytes = b"", most: float = math.inf) -> None:
    """Forward bytes until the source ends; bytes after the first ``most`` are dropped."""
    with suppress(OSError):
        block = first or source.recv(BLOCK_BYTES)
        while block:
            passed = block[: int(min(most, len(block)))]
            most -= len(passed)
            target.sendall(passed)
            block = source.recv(BLOCK_BYTES)
    with suppress(OSError):
        target.shutdown(socket.SHUT_WR)


def _answer(inner: socket.socket, visitor: socket.socket, is_last: bool) -> None:
    """Forward answers; after the last one the connection is closed."""
    _pass_on(inner, visitor)
    if is_last:
        with suppress(OSError):
            visitor.shutdown(socket.SHUT_RDWR)
