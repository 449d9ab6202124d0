"""What the package stands on: declared, under licences that it may import, locked within its ranges."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib import metadata

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.architecture_picture import PACKAGE, import_nodes

ROOT = PACKAGE.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS_OF_USERS = ("notebook", "tlog", "cluster", "delta")
LGPL_ALLOWED = {"pymavlink"}  # the extra tlog, imported and not copied; README and docs/tlog.md tell it
FOR_TYPES_ALONE = {"_typeshed"}  # of the type checker, below TYPE_CHECKING


def declared(*extras: str) -> list[Requirement]:
    lines = [*PROJECT["dependencies"], *(line for extra in extras for line in PROJECT["optional-dependencies"][extra])]
    return [Requirement(line) for line in lines]


def imported_by_the_package() -> set[str]:
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in import_nodes(path):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [str(node.module)]
            found |= {name.partition(".")[0] for name in names}
    return found - set(sys.stdlib_module_names) - {PACKAGE.name} - FOR_TYPES_ALONE


def with_what_they_bring(requirements: list[Requirement]) -> set[str]:
    """Names of the distributions that an installation of the requirements has on this machine."""
    found: set[str] = set()
    left = requirements
    while left:
        one = left.pop()
        name = canonicalize_name(one.name)
        if name in found or (one.marker and not one.marker.evaluate({"extra": ""})):
            continue
        found.add(name)
        left += [Requirement(line) for line in metadata.requires(name) or ()]
    return found


def licences(name: str) -> Iterator[str]:
    """What a distribution says of its licence: the expression, else classifiers and the first line of the old field."""
    told = metadata.metadata(name)
    if expression := told.get("License-Expression"):
        yield expression
        return
    yield from (one for one in told.get_all("Classifier") or () if one.startswith("License ::"))
    yield (told.get("License") or "").partition("\n")[0]


def is_gpl(licence: str) -> bool:
    """Whether a licence binds who imports: GPL or AGPL, also by their long names; LGPL counts apart.

    Of "MIT OR GPL-2.0" the user may take the first.
    """
    either = re.split(r"\bOR\b", licence)
    return all(re.search(r"(?<![A-Za-z])A?GPL|(?<!Lesser )(?<!Library )General Public", one) for one in either)


def is_lgpl(licence: str) -> bool:
    return bool(re.search(r"LGPL|(Lesser|Library) General Public", licence))


@pytest.mark.parametrize(
    ("licence", "gpl", "lgpl"),
    [
        ("GPL-3.0-or-later", True, False),
        ("License :: OSI Approved :: GNU General Public License v2 (GPLv2)", True, False),
        ("GNU Affero General Public License v3", True, False),
        ("AGPL-3.0-only", True, False),
        ("LGPLv3", False, True),
        ("License :: OSI Approved :: GNU Lesser General Public License v3 (LGPLv3)", False, True),
        ("MIT OR GPL-2.0-only", False, False),
        ("BSD-3-Clause AND Zlib", False, False),
        ("", False, False),
    ],
)
def test_licences_are_told_apart(licence: str, gpl: bool, lgpl: bool) -> None:
    assert (is_gpl(licence), is_lgpl(licence)) == (gpl, lgpl)


def modules_of(name: str) -> set[str]:
    """Names that a distribution brings for import, by its list of files."""
    record = metadata.distribution(name).read_text("RECORD") or ""
    return {line.partition(",")[0].partition("/")[0].removesuffix(".py") for line in record.splitlines()}


def test_every_import_is_a_declared_dependency() -> None:
    names = [*(one.name for one in declared(*EXTRAS_OF_USERS)), "llvmlite"]  # numba's compiler comes with it
    assert not imported_by_the_package() - {module for name in names for module in modules_of(name)}


def test_nothing_that_users_install_is_under_the_gpl() -> None:
    installed = with_what_they_bring(declared(*EXTRAS_OF_USERS))
    assert len(installed) > len(declared(*EXTRAS_OF_USERS))  # what dependencies bring was walked too
    of_licence = {name: list(licences(name)) for name in installed}
    assert not {name: told for name, told in of_licence.items() if any(map(is_gpl, told))}
    assert {name for name, told in of_licence.items() if any(map(is_lgpl, told))} <= LGPL_ALLOWED
    assert not {name for name, told in of_licence.items() if not any(told)}  # none that says nothing


def test_the_lock_file_fits_the_ranges() -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    pinned = [Requirement(line.partition("\\")[0]) for line in lock.splitlines() if re.match(r"\w", line)]
    versions: dict[str, list[str]] = {}
    for one in pinned:
        (pin,) = one.specifier
        assert pin.operator == "=="
        versions.setdefault(canonicalize_name(one.name), []).append(pin.version)
    for wanted in declared():
        locked = versions[canonicalize_name(wanted.name)]
        assert all(wanted.specifier.contains(version) for version in locked), f"make lock: {wanted} is {locked}"
    entries = re.split(r"\n(?=\w)", lock)
    assert entries.pop(0).startswith("# ") and len(entries) == len(pinned)
    assert all("--hash=sha256:" in entry for entry in entries)
