"""Profiles of others: TOML files in the user's folder, and those that plug-ins bring.

The folder is ``groundstation/profiles`` in the user's configuration directory. A plug-in names a file, a folder,
several of them, or a module beside which they are, by an entry point of the group ``groundstation.profiles``. A profile
that cannot be used is a line, and hides no other.
"""

import hashlib
import os
import sys
from collections.abc import Iterable, Iterator
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.plug_ins import load_plug_ins
from groundstation.readers.profile_heads import SHIPPED

if TYPE_CHECKING:
    from groundstation.readers.profile import Profile

ENTRY_POINT_GROUP = "groundstation.profiles"
READER = "csv-profile"  # that of all profiles; its title has the profile's name behind
MOST_FILES = 1000  # of one folder


@dataclass(frozen=True)
class OtherProfiles:
    """Profiles of others, and a line for each that cannot be used."""

    profiles: "tuple[Profile, ...]"
    failures: tuple[str, ...]


def user_folder() -> Path:
    """Return the folder of the user's own profiles; it need not exist."""
    if configured := os.environ.get("XDG_CONFIG_HOME"):
        base = Path(configured)
    elif sys.platform == "win32":
        base = Path(os.environ.get("APPDATA") or Path.home() / "AppData/Roaming")
    else:
        base = Path(os.environ.get("HOME") or "~").expanduser() / ".config"
    return base / "groundstation" / "profiles"


def other_profiles() -> OtherProfiles:
    """Load the profiles of the user's folder and of plug-ins; the first of a name counts.

    They are loaded again when a file of the folder has come, gone or changed.
    """
    return _loaded(user_folder(), _state_of(user_folder()))


@lru_cache(maxsize=1)
def _loaded(folder: Path, _state: tuple[object, ...]) -> OtherProfiles:
    found: dict[str, Profile] = {}
    failures: list[str] = []
    for path in _files(folder):
        failures += filter(None, [_taken(path, found)])

    def take(offered: Any) -> str:
        return "; ".join(filter(None, [_taken(path, found) for path in _named(offered)]))

    failures += load_plug_ins(ENTRY_POINT_GROUP, "profile", take)
    return OtherProfiles(tuple(found.values()), tuple(failures))


def known_profiles() -> "tuple[Profile, ...]":
    """List the profiles that are tried on every table: those of others before ours."""
    return profiles_for(sorted(SHIPPED.glob("*.toml")))


def profiles_for(shipped: Iterable[Path]) -> "tuple[Profile, ...]":
    """List the profiles of others, then some of the shipped ones."""
    others = other_profiles().profiles
    taken = {profile.name for profile in others}
    return (*others, *(profile for profile in map(_shipped, shipped) if profile.name not in taken))


@cache
def _shipped(path: Path) -> "Profile":
    from groundstation.readers.profile_file import load

    return load(path)


def known_as(path: Path) -> Path:
    """Return the path of a profile; a name is that of another's, or of a shipped one.

    A file of that name comes first.
    """
    if len(path.parts) != 1 or path.exists():
        return path
    names = ((one.path, one.name) for one in other_profiles().profiles)
    other = next((found for found, name in names if path.name in (name, found.stem, found.name)), None)
    shipped_path = SHIPPED / f"{path.name.replace('-', '_')}.toml"
    return other or (shipped_path if shipped_path.exists() else path)


def path_of_profile(reader: str) -> Path | None:
    """Return the file of another's profile by the title of its claim; None of a shipped one."""
    name = reader.removeprefix(f"{READER} ")
    found = other_profiles().profiles if name != reader else ()
    return next((profile.path for profile in found if profile.name == name), None)


def contents() -> tuple[str, ...]:
    """Return a digest of each profile of others: another content may claim other files."""
    digests = []
    for profile in other_profiles().profiles:
        try:
            digests.append(hashlib.sha256(profile.path.read_bytes()).hexdigest())
        except OSError:
            digests.append("")
    return tuple(digests)


def _taken(path: Path, found: "dict[str, Profile]") -> str:
    """Load a profile into those found; return why it is left out."""
    from groundstation.readers.profile_file import load

    try:
        profile = load(path)
    except GroundstationError as error:
        return f"profile {path} is left out: {error}"
    if profile.name in found:
        return f"profile {path} is left out: {profile.name!r} is that of {found[profile.name].path}"
    found[profile.name] = profile
    return ""


def _named(offered: Any) -> Iterator[Path]:
    """Yield the files that a plug-in names."""
    if isinstance(offered, str | Path):
        path = Path(offered)
        yield from _files(path) if path.is_dir() else (path,)
    elif getattr(offered, "__file__", None):
        yield from _files(Path(offered.__file__).parent)
    elif isinstance(offered, Iterable):
        for one in offered:
            yield from _named(one)
    else:
        raise TypeError("names no TOML file, folder or module")


def _state_of(folder: Path) -> tuple[object, ...]:
    """Return names, sizes and times of the files of a folder."""
    state = list[object]()
    for path in _files(folder):
        try:
            found = path.stat()
        except OSError:
            continue
        state.append((str(path), found.st_size, found.st_mtime_ns))
    return tuple(state)


def _files(folder: Path) -> list[Path]:
    try:
        return sorted(folder.glob("*.toml"))[:MOST_FILES]
    except OSError:
        return []
