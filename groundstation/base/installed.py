"""Versions of installed packages, by the names of the folders that hold their metadata.

``importlib.metadata`` reads those folders, with the mail parser of the standard library: importing it takes longer than
to find a compiled loop and link it.
"""

import os
import re
import sys
from functools import cache

SUFFIX = ".dist-info"


@cache
def installed_version(package: str) -> str:
    """Return the version of an installed package, by the name that pip knows.

    ``importlib.metadata`` is asked where the folders do not tell: there are several of a package, or none.

    Raises
    ------
    importlib.metadata.PackageNotFoundError
        When it is not installed.

    Examples
    --------
    >>> import numpy
    >>> installed_version("numpy") == numpy.__version__
    True
    """
    found = _versions().get(_plain(package), frozenset())
    if len(found) == 1:
        return next(iter(found))
    from importlib.metadata import version

    return version(package)


@cache
def _versions() -> dict[str, frozenset[str]]:
    """Return the versions of what is in the folders that modules are looked for in, by name."""
    versions: dict[str, frozenset[str]] = {}
    for folder in dict.fromkeys(sys.path):
        try:
            entries = os.listdir(folder or ".")  # noqa: PTH208 (a Path of each takes ten times as long)
        except OSError:  # a zip, or a folder that is not there
            continue
        for entry in entries:
            name, dash, version = entry.removesuffix(SUFFIX).partition("-")
            if dash and entry.endswith(SUFFIX):
                versions[_plain(name)] = versions.get(_plain(name), frozenset()) | {version}
    return versions


def _plain(name: str) -> str:
    """Return a name as pip compares names.

    Examples
    --------
    >>> _plain("Rerun_SDK")
    'rerun-sdk'
    """
    return re.sub(r"[-_.]+", "-", name).lower()
