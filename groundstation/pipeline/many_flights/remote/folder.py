"""Folders in a bucket or on a server, named by URL and reached through fsspec."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, NO_LOGS, OUT_FOLDER_MARK


class RemoteFolder:
    """A folder named by URL.

    Parameters
    ----------
    url : str
        ``s3://bucket/folder``, ``file:///folder``; whatever fsspec has a package for.

    Raises
    ------
    UsageError
        When nothing reaches such a place.
    """

    def __init__(self, url: str) -> None:
        try:
            from fsspec.core import url_to_fs
        except ImportError as error:
            raise UsageError(url, "no package fsspec", "", "pip install 'groundstation[cluster]'") from error
        self.url = url.rstrip("/")
        try:
            self._fs, root = url_to_fs(self.url, use_listings_cache=False)
        except (ImportError, ValueError) as error:
            raise UsageError(url, str(error), "a URL that fsspec reaches") from error
        self._root = root.rstrip("/")

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}" if name else self._root

    @contextmanager
    def _told(self, name: str) -> Iterator[None]:
        """Tell in one line what the network, the server or the rights are in the way of."""
        try:
            yield
        except GroundstationError:
            raise
        except Exception as error:  # every store has errors of its own
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            raise GroundstationError(f"{self.url}/{name}".rstrip("/"), reason) from error

    def names(self, name: str = "") -> list[str]:
        """Names of what is in a folder, sorted; none where there is no folder."""
        with self._told(name):
            try:
                listed = self._fs.ls(self._path(name), detail=False)
            except FileNotFoundError:
                return []
            return sorted({PurePosixPath(path).name for path in listed} - {PurePosixPath(self._path(name)).name, ""})

    def files(self) -> dict[str, int]:
        """Bytes of all files below, by their path from here, sorted.

        The path is "" where the URL names a file itself.
        """
        with self._told(""):
            if self._fs.isfile(self._root):
                return {"": int(self._fs.size(self._root))}
            found = self._fs.find(self._root, detail=True).items()
            return dict(sorted((str(PurePosixPath(path).relative_to(self._root)), one["size"]) for path, one in found))

    def sizes(self, name: str) -> dict[str, int]:
        """Bytes of all files below a folder, by their path from it."""
        with self._told(name):
            root, found = self._path(name), self._fs.find(self._path(name), detail=True).items()
            return {PurePosixPath(path).relative_to(root).as_posix(): int(one["size"]) for path, one in found}

    def read(self, name: str) -> bytes | None:
        """Content of a file, None where there is none."""
        with self._told(name):
            try:
                return bytes(self._fs.cat_file(self._path(name)))
            except FileNotFoundError:
                return None

    def write(self, name: str, content: bytes) -> None:
        """Write a small file."""
        with self._told(name):
            self._make_parent(name)
            self._fs.pipe_file(self._path(name), content)

    def create(self, name: str, content: bytes) -> bool:
        """Write a small file unless there is one; whether it was written.

        In S3 the server decides (If-None-Match), elsewhere whatever the store has for it.
        """
        with self._told(name):
            self._make_parent(name)
            try:
                if "file" in self._fs.protocol:  # fsspec looks first and writes then
                    with Path(self._path(name)).open("xb") as stream:
                        stream.write(content)
                else:
                    self._fs.pipe_file(self._path(name), content, mode="create")
            except FileExistsError:
                return False
            return True

    def fetch(self, name: str, target: Path) -> None:
        """Copy a file from there."""
        target.parent.mkdir(parents=True, exist_ok=True)
        with self._told(name):
            self._fs.get_file(self._path(name), str(target))

    def send(self, folder: Path, name: str = "", *, last: str = FLIGHT_FOLDER_MARK) -> None:
        """Copy all files of a folder here to one there, one of them last."""
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        for path in sorted(paths, key=lambda path: path == folder / last):
            target = "/".join(part for part in (name, path.relative_to(folder).as_posix()) if part)
            with self._told(target):
                self._make_parent(target)
                self._fs.put_file(str(path), self._path(target))

    def replace(
        self, source: str, target: str, is_old: Callable[[str], bool], *, last: str = FLIGHT_FOLDER_MARK
    ) -> None:
        """Put the files of a folder in the place of old ones of another, one of them last.

        The source is gone then.
        """
        with self._told(target):
            old = self._relative(target)
            if last in old:
                self._fs.rm_file(self._path(f"{target}/{last}"))  # from now on the old folder is not whole
            new = self._relative(source)
            for name in sorted(new, key=lambda name: name == last):
                self._make_parent(f"{target}/{name}")
                self._fs.cp_file(self._path(f"{source}/{name}"), self._path(f"{target}/{name}"))
            for name in filter(is_old, set(old) - set(new)):
                self._fs.rm_file(self._path(f"{target}/{name}"))
        self.remove(source)

    def remove_where(self, name: str, is_old: Callable[[str], bool], *, first: str = FLIGHT_FOLDER_MARK) -> None:
        """Remove the old files of a folder, one of them first."""
        with self._told(name):
            for one in sorted(filter(is_old, self._relative(name)), key=lambda one: one != first):
                self._fs.rm_file(self._path(f"{name}/{one}"))

    def _relative(self, name: str) -> list[str]:
        root = self._path(name)
        return [str(PurePosixPath(path).relative_to(root)) for path in self._fs.find(root)]

    def _make_parent(self, name: str) -> None:
        if "file" in self._fs.protocol:  # buckets have no folders
            Path(self._path(name)).parent.mkdir(parents=True, exist_ok=True)

    def remove(self, name: str) -> None:
        """Remove a file or a folder, if it is there."""
        with self._told(name):
            try:
                self._fs.rm(self._path(name), recursive=True)
            except FileNotFoundError:
                return


class FarLog(NamedTuple):
    """A log by its URL or path, whether the user named it, and its bytes."""

    url: str
    is_named: bool
    size: int


def far_logs(url: str) -> list[FarLog]:
    """Logs at a URL: a file, or a folder with all below it.

    Raises
    ------
    UsageError
        When nothing is there.
    """
    folder = RemoteFolder(url)
    sizes = folder.files()
    if not sizes:
        raise UsageError(url, "no such file or folder")
    if "" in sizes:
        return [FarLog(url, True, sizes[""])]
    paths = {PurePosixPath(name): size for name, size in sizes.items()}
    ours = {path.parent for path in paths if path.name in (FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK)}
    return [FarLog(f"{folder.url}/{path}", False, size) for path, size in paths.items() if not _is_left_out(path, ours)]


def _is_left_out(path: PurePosixPath, ours: set[PurePosixPath]) -> bool:
    """Tell whether a file is hidden, holds settings, or lies in a folder of groundstation's."""
    if path.suffix.lower() == NO_LOGS:
        return True
    return any(part.startswith(".") for part in path.parts) or not ours.isdisjoint(path.parents)
