"""The list of systems: ours, other people's by entry points, and what becomes of one that cannot be used."""

import subprocess
import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.base.ledger import Ledger
from groundstation.pipeline.one_flight import analyse as analysing
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.systems import ENTRY_POINT_GROUP, OURS, systems
from groundstation.systems.loading import load_systems
from groundstation.systems.system import System, Systems
from tests.viewer_example import make_flight, make_results


@dataclass(frozen=True)
class Entry:
    """An entry point."""

    name: str
    found: Any
    value: str = "other.system:SYSTEM"

    def load(self) -> Any:
        """Return what it names, or raise it."""
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def loaded(monkeypatch: pytest.MonkeyPatch, *found: Any) -> Systems:
    entries = [Entry(f"other{place}", one) for place, one in enumerate(found)]
    monkeypatch.setattr(
        "groundstation.base.plug_ins.entry_points_of", lambda group: entries if group == ENTRY_POINT_GROUP else []
    )
    return load_systems(OURS, ENTRY_POINT_GROUP)


def test_other_peoples_systems_come_behind_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    found = loaded(monkeypatch, System("weather"))
    assert found.names == (*(path.split(".")[2] for path in OURS), "weather") and not found.failures


@pytest.mark.parametrize(
    ("found", "told"),
    [
        (ImportError("no module\nnamed x"), "cannot be used: ImportError: no module named x"),
        (SimpleNamespace(name="weather"), "cannot be used: TypeError: SimpleNamespace is no System"),
        (System("heading"), "is left out: system heading is taken"),
    ],
)
def test_a_broken_one_is_a_line_and_hides_no_other(found: Any, told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    every = loaded(monkeypatch, found, System("weather"))
    (line,) = every.failures
    assert line == f"system plug-in 'other0' (other.system:SYSTEM) {told}" and every.names[-1] == "weather"


def test_a_name_of_an_analysis_that_is_taken_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    (latency,) = next(one for one in systems().every if one.name == "latency").analyses
    (line,) = loaded(monkeypatch, System("weather", analyses=(replace(latency, columns=()),))).failures
    assert line.endswith("is left out: analysis latency, settings table latency is taken")


def test_a_run_has_a_finding_on_a_system_that_could_not_be_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = make_flight(240.0, 5.0)
    results = make_results(flight)
    flight = replace(flight, tables={"discrete": flight["discrete"]})
    monkeypatch.setattr(analysing, "systems", lambda: Systems((System("bare"),), ("system plug-in 'x' is broken",)))
    given = analysing.Given("NOTIME_01234567", results.source, Ledger(), results.clock, (), False)
    told = analysing.analyse(flight, given, Configuration()).findings
    assert [(one.severity, one.code, one.text) for one in told if one.code.startswith("plug_in")] == [
        ("warn", "plug_in.system", "system plug-in 'x' is broken")
    ]


def test_converting_and_describing_load_no_system() -> None:
    code = "import sys; import groundstation.pipeline.verbs.describe, groundstation.pipeline.one_flight.convert;"
    code += "print([name for name in sys.modules if name.startswith('groundstation.systems')])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
