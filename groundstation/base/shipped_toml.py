"""TOML files that ship with the package and are chosen by name.

A user's own files are chosen by path.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_text import toml_table, toml_text

SUFFIX = ".toml"


@dataclass(frozen=True)
class TomlFile:
    """TOML file: name without suffix, its name in errors, its table and its text.

    ``is_shipped`` tells whether it came with the package.
    """

    name: str
    where: str
    table: dict[str, Any]
    text: str
    is_shipped: bool = False


@dataclass(frozen=True)
class ShippedToml:
    """The TOML files of one folder of the package.

    Parameters
    ----------
    package, folder : str
        ``"groundstation.simulation"``, ``"scenarios"``.
    what : str
        Kind of its files, for errors: ``"scenario"``.
    """

    package: str
    folder: str
    what: str

    @property
    def _place(self) -> Path:
        return Path(import_module(self.package).__path__[0], self.folder)

    def names(self) -> tuple[str, ...]:
        """Names of the shipped files, in alphabetical order."""
        return tuple(sorted(path.stem for path in self._place.glob(f"*{SUFFIX}")))

    def read(self, name_or_path: str | Path) -> TomlFile:
        """Read a shipped file by name (any case), or a user's file by its path.

        A path ends in ``.toml``.

        Raises
        ------
        SettingsError
            For an unknown name, and for a file that cannot be read or is not TOML.
        """
        wanted = str(name_or_path)
        is_shipped = not wanted.endswith(SUFFIX)
        if not is_shipped:
            path = Path(name_or_path)
            where, name = path.name, path.stem
            text = toml_text(path, where, f"a TOML file for {self.what}")
        elif wanted.lower() in self.names():
            name = wanted.lower()
            where = f"{name}{SUFFIX}"
            text = (self._place / where).read_text(encoding="utf-8")
        else:
            raise SettingsError(self.what, repr(wanted), f"a file *{SUFFIX} or one of {', '.join(self.names())}")
        return TomlFile(name, where, toml_table(text, where, f"a TOML file for {self.what}"), text, is_shipped)
