"""Files that only this user or root can have written: only such files are loaded as code.

Another user of the machine may own a folder that was named, may write into it, or may exchange a folder above it for
one of his own. In a folder with the sticky bit, as ``/tmp``, a user can exchange only what is his. Windows has no such
owners: there every file is taken for the user's own.
"""

import os
import secrets
import stat
from contextlib import suppress
from pathlib import Path

_HAS_OWNERS = hasattr(os, "geteuid")
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_OF_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_PASSED_BY_OTHERS = stat.S_IXGRP | stat.S_IXOTH


def hand_of_others(folder: Path) -> str:
    """Say which part of a folder's path another user owns or may write to; empty if none.

    Below a folder that others may not even pass, what they may do there no longer counts.
    """
    if not _HAS_OWNERS:
        return ""
    path, is_passed = folder.resolve(), True
    for part in (*reversed(path.parents), path):
        try:
            found = part.stat()
        except OSError as error:
            return f"{part}: {error.strerror or error}"
        if not _is_own(found):
            return f"{part} is another user's"
        is_sticky = bool(found.st_mode & stat.S_ISVTX) and part != path
        if is_passed and found.st_mode & _OF_OTHERS and not is_sticky:
            return f"others may write into {part}"
        is_passed &= bool(found.st_mode & _PASSED_BY_OTHERS)
    return ""


def _is_own(found: os.stat_result) -> bool:
    return found.st_uid in (0, os.geteuid())


def read_own(path: Path) -> bytes | None:
    """Return the content of a file that this user or root owns and no other may write.

    It is None for any other file, or where there is none.
    """
    try:
        number = os.open(path, os.O_RDONLY | _NO_LINK | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return None
    with os.fdopen(number, "rb") as file:
        found = os.fstat(number)
        if not stat.S_ISREG(found.st_mode) or (_HAS_OWNERS and (not _is_own(found) or found.st_mode & _OF_OTHERS)):
            return None
        try:
            return file.read()
        except OSError:
            return None


def write_own(path: Path, content: bytes) -> None:
    """Write a file that only this user may write, in place of any file of that name.

    Raises
    ------
    OSError
        When the folder cannot be written.
    """
    partial = path.with_name(f"{path.name}.{secrets.token_hex(8)}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK | getattr(os, "O_BINARY", 0)
    try:
        with os.fdopen(os.open(partial, flags, 0o600), "wb") as file:
            file.write(content)
        partial.replace(path)
    except OSError:
        with suppress(OSError):
            partial.unlink()
        raise
