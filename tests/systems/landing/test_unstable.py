"""Share of unstable approaches of a folder: counts, intervals, what is left out, limits of the standard's file."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.base.errors import SettingsError, UsageError
from groundstation.base.shipped_toml import TomlFile
from groundstation.methods.intervals import wilson_interval
from groundstation.pipeline.verbs.folder_standards import hold_to, standard_of
from groundstation.simulation.approach import FinalMotion, simulate_approach
from groundstation.systems.landing.answer import LandingResult
from groundstation.systems.landing.unstable import SHIPPED, judge
from groundstation.systems.landing.unstable_chapter import document
from tests.systems.landing.test_criteria import EXACT, flown, result


def saved(name: str, answer: LandingResult | None, aircraft: str = "A", sha: str = "") -> Any:
    results = SimpleNamespace(
        answer=lambda kind: answer,
        reasons=lambda analysis: ["no landing in the log"],
        source=SimpleNamespace(sha256=sha or name),
        metadata={"aircraft": aircraft},
    )
    return SimpleNamespace(folder=Path(name), results=results)


def standard(**table: Any) -> TomlFile:
    return TomlFile("own", "own.toml", {"kind": "landing", **table}, repr(table))


@pytest.fixture(scope="module")
def stable() -> LandingResult:
    return result(flown())


@pytest.fixture(scope="module")
def unstable() -> LandingResult:
    scenario = replace(EXACT, flown=FinalMotion(start_distance_m=14_000.0, above_path_m=120.0))
    return result(simulate_approach(scenario).flight, established_vertical_dots=2.0)


def test_shares_by_runway_and_aircraft_with_wilsons_interval(stable: LandingResult, unstable: LandingResult) -> None:
    flights = [saved("a", stable), saved("b", unstable), saved("c", stable, "B")]
    found = judge(flights, standard())
    whole, runway, first, second = found.shares
    assert (whole.judged, whole.unstable) == (3, 1) and (whole.low, whole.high) == wilson_interval(1, 3)
    assert runway.name == "09" and (first.name, first.unstable, first.judged) == ("A", 1, 2)
    assert (second.name, second.unstable) == ("B", 0)
    assert found.decision == "no limit" and "dots high" in found.approaches[1].reason


def test_a_limit_is_decided_by_the_whole_interval(stable: LandingResult, unstable: LandingResult) -> None:
    assert judge([saved("a", stable)], standard(share_at_most=0.05)).decision == "not enough flights"
    many = [saved(f"f{k}", stable) for k in range(100)]
    assert judge(many, standard(share_at_most=0.05)).decision == "pass"
    bad = [saved(f"f{k}", unstable) for k in range(30)]
    assert judge(bad, standard(share_at_most=0.05)).decision == "fail"
    assert judge([], standard(share_at_most=0.05)).decision == "not flown"


def test_limits_of_the_file_judge_the_stored_values(stable: LandingResult) -> None:
    found = judge([saved("a", stable)], standard(landing={"sink_rate_max_mps": 0.6}))
    assert found.shares[0].unstable == 1 and "sink rate" in found.approaches[0].reason


def test_what_cannot_count_is_left_out_with_its_reason(stable: LandingResult) -> None:
    flights = [saved("a", stable), saved("b", stable, sha="a"), saved("c", None)]
    found = judge(flights, standard(landing={"sustained_s": 3.0}), ["d: cannot be read: cut"])
    assert found.flights == 1 and found.shares[0].judged == 1
    assert [one.split(":")[0] for one in found.left_out] == ["d", "b", "c"]
    other = judge(flights[:1], standard(landing={"sustained_s": 5.0}))
    assert other.flights == 0 and "sustained_s" in other.left_out[0]
    assert document(other).front.headline == "No approach can be judged"


@pytest.mark.parametrize("table", [{"check": "lowest"}, {"landing": {"nothing": 1}}, {"share_at_most": 5}])
def test_a_standard_that_cannot_be_used_is_told(table: dict[str, Any]) -> None:
    with pytest.raises(SettingsError, match=r"own\.toml"):
        judge([], standard(**table))


def test_standards_are_found_by_name_and_by_kind(tmp_path: Path) -> None:
    assert standard_of("app-g") is None and standard_of("fsf-alar") is not None
    path = tmp_path / "mine.toml"
    path.write_text('kind = "landing"\n')
    found = standard_of(str(path))
    assert found is not None and found[0].kind == "landing"
    path.write_text('kind = "other"\n')
    with pytest.raises(SettingsError, match=r"mine\.toml, key kind: found 'other', expected 'landing'"):
        standard_of(str(path))
    path.write_text('title = "of an INS"\n')
    assert standard_of(str(path)) is None
    assert judge([], SHIPPED.read("fsf-alar")).decision == "no limit"


def test_a_folder_without_results_is_told(tmp_path: Path) -> None:
    found = standard_of("fsf-alar")
    assert found is not None
    with pytest.raises(UsageError, match="no results"):
        hold_to(tmp_path / "nothing", *found)


def test_approaches_in_circuits_are_each_counted(stable: LandingResult) -> None:
    twice = replace(stable, approaches=(stable.approaches[0], replace(stable.approaches[0], number=2)))
    assert judge([saved("a", twice)], standard()).shares[0].judged == 2
