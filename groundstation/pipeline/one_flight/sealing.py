"""Sizes of the files of a finished flight, in its manifest.

A later run compares them with what it finds.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from groundstation.base.to_disk import sync_files, sync_folder, sync_tree
from groundstation.pipeline.one_flight.identity import sha256_of
from groundstation.results.file_names import MANIFEST, SUMMARY
from groundstation.results.files import load_manifest, save_manifest
from groundstation.results.manifest import FileOfRun, Manifest

SizeOf = Callable[[str], int | None]  # bytes of a file by its path in a folder; None where there is none


def seal(folder: Path, manifest: Manifest, digests: Mapping[str, str] = MappingProxyType({})) -> None:
    """Write the manifest with the sizes of all files of a folder, and sync all to the disk.

    Parameters
    ----------
    folder : Path
        A folder that does not count as finished yet.
    manifest : Manifest
    digests : mapping of str to str
        SHA-256 of some of its files, by name.
    """
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / MANIFEST)
    names = [path.relative_to(folder).as_posix() for path in paths]
    files = {name: _file_of_run(path, digests.get(name, "")) for name, path in zip(names, paths, strict=True)}
    save_manifest(folder, replace(manifest, files=files), is_synced=False)
    sync_tree(folder)


def _file_of_run(path: Path, sha256: str = "") -> FileOfRun:
    found = path.stat()
    return FileOfRun(found.st_size, sha256, found.st_mtime_ns if sha256 else 0)


def note(folder: Path, written: Iterable[Path], removed: Iterable[str] = ()) -> None:
    """Record the sizes of files of a finished flight that were made again, and files gone.

    The manifest of an earlier version, which has none, stays without.
    """
    paths = [path for path in (*written, folder / SUMMARY) if path.is_file()]  # findings on what failed are in it
    sync_files(paths)
    sync_folder(folder)
    manifest = load_manifest(folder)
    if manifest.files:
        gone = {name for name in removed if not (folder / name).exists()}
        files = {name: file for name, file in manifest.files.items() if name not in gone}
        files |= {path.relative_to(folder).as_posix(): _file_of_run(path) for path in paths}
        save_manifest(folder, replace(manifest, files=dict(sorted(files.items()))))


def spoiled_files(folder: Path, manifest: Manifest, size_of: SizeOf | None = None) -> frozenset[str]:
    """Return files that are missing or not as the run left them.

    For a file with a digest, time and size are compared first. ``size_of`` is given where the files are elsewhere: then
    their sizes alone are compared.
    """
    if size_of is not None:
        return frozenset(name for name, file in manifest.files.items() if size_of(name) != file.size_bytes)
    return frozenset(name for name, file in manifest.files.items() if _is_spoiled(folder / name, file))


def _is_spoiled(path: Path, file: FileOfRun) -> bool:
    try:
        found = path.stat()
        if found.st_size != file.size_bytes:
            return True
        return bool(file.sha256) and found.st_mtime_ns != file.time_ns and sha256_of(path) != file.sha256
    except OSError:
        return True
