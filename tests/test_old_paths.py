"""Old paths of modules answer for one release, each with a warning that names the new one."""

import importlib
from importlib.util import find_spec

import pytest

from groundstation.base.old_paths import FILES, FOLDERS, new_path


def test_what_was_imported_is_the_same_object() -> None:
    from groundstation.systems.heading.answer import HeadingResult

    with pytest.warns(DeprecationWarning, match=r"results\.heading is now groundstation\.systems\.heading"):
        old = importlib.import_module("groundstation.results.heading")
    assert old.HeadingResult is HeadingResult


def test_a_module_in_a_folder_that_moved_is_found() -> None:
    with pytest.warns(DeprecationWarning, match=r"now groundstation\.systems\.latency\.estimate"):
        old = importlib.import_module("groundstation.estimators.latency.estimate")
    assert (
        old.estimate_latencies is importlib.import_module("groundstation.systems.latency.estimate").estimate_latencies
    )


@pytest.mark.parametrize("new", sorted({*FILES.values(), *FOLDERS.values()}))
def test_every_new_path_is_there(new: str) -> None:
    assert find_spec(f"groundstation.{new}") is not None


def test_other_names_are_not_found() -> None:
    assert new_path("base.angles") == "" and new_path("estimators.weather.estimate") == ""
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("groundstation.estimators.weather")
