"""Logs of a fleet whose INS age and are moved: names, serials, dates, drift, files that cannot be used."""

from pathlib import Path

import pytest

from groundstation.base.errors import SettingsError, UsageError
from groundstation.pipeline.verbs.synthesis import kind_of, simulate_to
from groundstation.simulation.ins_units.fleet import FlownPeriod, load_units_fleet, units_fleet_names
from groundstation.simulation.ins_units.settings import UnitAided, UnitDrift

SHORT = """duration_s = 600.0

[[flown]]
aircraft = "RA-1"
serials = ["№ 7; <b>", ""]
first_utc = "2026-01-10T06:00:00Z"
flights = 2
every_days = 40.0
"""


@pytest.mark.parametrize("name", units_fleet_names())
def test_shipped_fleets_have_distinct_logs(name: str) -> None:
    names = [one.log_name for one in load_units_fleet(name).scenarios()]
    assert len(set(names)) == len(names) > 1 and kind_of(name) == "fleet" and kind_of("units-two") == "units"


def test_a_log_for_each_flight_with_its_date_and_its_serials(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(SHORT, encoding="utf-8")
    first, second = simulate_to(str(path), tmp_path / "logs")
    heads = [one.read_text(encoding="utf-8").split("\n\n")[0][:400] for one in (first, second)]
    assert "start_utc: 2026-01-10T06:00:00" in heads[0] and "start_utc: 2026-02-19T06:00:00" in heads[1]
    assert "ins_serial: № 7; <b>" in heads[0] and "ins_serial.ins.1" not in heads[0]
    assert first.read_bytes() != second.read_bytes()
    with pytest.raises(UsageError):
        simulate_to(str(path), tmp_path / "logs")
    with pytest.raises(UsageError):
        simulate_to(str(path), tmp_path / "other", form="ch10")


def test_an_ageing_unit_drifts_more_from_flight_to_flight() -> None:
    period = FlownPeriod("RA-1", ("A",), "2026-01-10T06:00:00Z", flights=3, drift_times=1.0, drift_times_at_end=5.0)
    drifts = [fault for flight in range(3) for fault in period.faults(flight)]
    assert [fault.times for fault in drifts if isinstance(fault, UnitDrift)] == [1.0, 3.0, 5.0]
    aided = FlownPeriod("RA-1", ("A", "B"), "2026-01-10T06:00:00Z", flights=1, is_aided=True)
    assert [type(fault) for fault in aided.faults(0)] == [UnitAided, UnitAided]


@pytest.mark.parametrize(
    "spoiled",
    ["flights = 0", "flights = 2\nserials = []", "flights = 2\nfirst_utc = 'x'", "flights = 2\nwhat = 1"],
)
def test_a_fleet_that_cannot_be_used_is_told_in_a_line(spoiled: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    known = {"aircraft": '"RA-1"', "serials": '["A"]', "first_utc": '"2026-01-10T06:00:00Z"'}
    lines = [f"{key} = {value}" for key, value in known.items() if f"{key} =" not in spoiled]
    path.write_text("\n".join(["[[flown]]", *lines, spoiled]), encoding="utf-8")
    with pytest.raises((SettingsError, UsageError)) as caught:
        simulate_to(str(path), tmp_path / "logs")
    assert "\n" not in str(caught.value)
