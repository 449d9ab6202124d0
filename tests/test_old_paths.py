"""Old paths of modules answer for one release, each with a warning that names the new one."""

import importlib
import sys
from importlib.util import find_spec

import pytest

from groundstation.base.old_paths import FILES, FOLDERS, new_path


def test_what_was_imported_is_the_same_object(monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.systems.heading.answer import HeadingResult

    monkeypatch.delitem(sys.modules, "groundstation.results.heading", raising=False)  # another test may have asked
    with pytest.warns(DeprecationWarning, match=r"results\.heading is now groundstation\.systems\.heading"):
        old = importlib.import_module("groundstation.results.heading")
    assert old.HeadingResult is HeadingResult


def test_a_module_in_a_folder_that_moved_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "groundstation.estimators.latency.estimate", raising=False)
    with pytest.warns(DeprecationWarning, match=r"now groundstation\.systems\.latency\.estimate"):
        old = importlib.import_module("groundstation.estimators.latency.estimate")
    assert (
        old.estimate_latencies is importlib.import_module("groundstation.systems.latency.estimate").estimate_latencies
    )


@pytest.mark.parametrize(
    ("old", "names"),
    [
        ("results.heading", ("HeadingResult", "Gate", "judged_gate", "Bound", "IntervalPart")),
        ("results.inertial", ("InertialResult", "EarlyAzimuth")),
        ("results.installation", ("InstallationResult", "Lesson", "Installations", "read_installations")),
        ("results.arrays.cooperative", ("CooperativeTracks", "SessionClocks", "ControlPaths", "PlacementMap")),
        ("results.arrays.landing", ("LandingPath", "RangesPath")),
        ("estimators.two_clocks.relation", ("LogRelation", "NotOneFlightError")),
    ],
)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_names_that_went_to_other_modules_are_there(old: str, names: tuple[str, ...]) -> None:
    module = importlib.import_module(f"groundstation.{old}")
    assert not [name for name in names if not hasattr(module, name)]


def test_a_name_that_left_a_module_that_stays_is_there() -> None:
    from groundstation.results.arrays import flight
    from groundstation.systems.latency.arrays import LatencySearch

    with pytest.warns(DeprecationWarning, match=r"flight\.LatencySearch is now in groundstation\.systems\.latency"):
        assert vars(flight)["__getattr__"]("LatencySearch") is LatencySearch
    assert not hasattr(flight, "NoSuchArrays")


def test_a_folder_within_one_that_moved_is_found() -> None:
    with pytest.warns(DeprecationWarning, match=r"now groundstation\.systems\.cooperative\.filters\.pairwise"):
        old = importlib.import_module("groundstation.estimators.cooperative.plain.pairwise")
    new = importlib.import_module("groundstation.systems.cooperative.filters.pairwise")
    assert vars(old).items() >= {name: value for name, value in vars(new).items() if not name.startswith("__")}.items()


@pytest.mark.parametrize("new", sorted({*FILES.values(), *FOLDERS.values()}))
def test_every_new_path_is_there(new: str) -> None:
    assert find_spec(f"groundstation.{new}") is not None


def test_other_names_are_not_found() -> None:
    assert new_path("base.angles") == "" and new_path("estimators.weather.estimate") == ""
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("groundstation.estimators.weather")
