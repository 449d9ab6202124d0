"""Versions by the names of folders are those that ``importlib.metadata`` reads."""

import importlib
import importlib.metadata
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.base import installed
from groundstation.pipeline.one_flight.resume import PACKAGES


@pytest.fixture(autouse=True)
def _looked_up_anew() -> Iterator[None]:
    for one in (installed.installed_version, installed._versions):
        one.cache_clear()
    yield
    for one in (installed.installed_version, installed._versions):
        one.cache_clear()


def put(folder: Path, name: str, version: str) -> None:
    about = folder / f"{name}-{version}.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", encoding="utf-8")


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_that_results_depend_on(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = importlib.metadata.version(package)
    monkeypatch.setattr(importlib.metadata, "version", lambda _name: pytest.fail("read from its folder"))
    assert installed.installed_version(package) == expected


def test_of_two_versions_the_first_on_the_way_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path / "new", "gs_made_up", "2.0")
    put(tmp_path / "old", "gs_made_up", "1.0")
    monkeypatch.setattr(sys, "path", [str(tmp_path / "old"), str(tmp_path / "new"), *sys.path])
    importlib.invalidate_caches()
    assert installed.installed_version("gs-made.up") == importlib.metadata.version("gs-made.up") == "1.0"


def test_what_is_not_installed_has_no_version() -> None:
    with pytest.raises(ModuleNotFoundError):
        installed.installed_version("gs-made-up")
