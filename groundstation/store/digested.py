"""File whose digest is made while it is written."""

import hashlib
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor, Future
from typing import BinaryIO

AT_ONCE = 1 << 20  # bytes that are handed to a thread together


class DigestedFile:
    """File that is written from beginning to end; its digest is made in a thread meanwhile.

    Parameters
    ----------
    file : binary file
    threads : Executor
        One of its threads makes the digest.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from io import BytesIO
    >>> file = BytesIO()
    >>> with ThreadPoolExecutor(1) as threads:
    ...     digested = DigestedFile(file, threads)
    ...     digested.writelines([b"a", b"bc"])
    ...     digested.sha256 == hashlib.sha256(b"abc").hexdigest(), digested.tell()
    (True, 3)
    """

    def __init__(self, file: BinaryIO, threads: Executor) -> None:
        self._file, self._threads, self._at = file, threads, 0
        self._digest = hashlib.sha256()
        self._parts: list[bytes | memoryview] = []
        self._waiting = 0  # bytes of them
        self._before: Future[None] | None = None

    @property
    def sha256(self) -> str:
        """SHA-256 of all that was written, hexadecimal."""
        self._hand_over()
        self._wait()
        return self._digest.hexdigest()

    def tell(self) -> int:
        """Bytes written."""
        return self._at

    def write(self, data: bytes | memoryview) -> None:
        """Write bytes at the end."""
        self._file.write(data)
        self._at += len(data)
        self._parts.append(data)
        self._waiting += len(data)
        if self._waiting >= AT_ONCE:
            self._hand_over()

    def writelines(self, parts: Iterable[bytes]) -> None:
        """Write several parts at the end."""
        for part in parts:
            self.write(part)

    def _hand_over(self) -> None:
        """Let a thread go on with the digest, when it is done with what came before."""
        self._wait()
        self._before = self._threads.submit(self._update, self._parts)
        self._parts, self._waiting = [], 0

    def _wait(self) -> None:
        if self._before is not None:
            self._before.result()

    def _update(self, parts: Sequence[bytes | memoryview]) -> None:
        for part in parts:
            self._digest.update(part)
