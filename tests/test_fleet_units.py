"""INS units over time by serial: slopes, changes, moves, dates of limits, and what a folder of flights shows."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import SettingsError, UsageError
from groundstation.chapters.markdown import markdown
from groundstation.methods.fleet.slopes import FEWEST, line_of
from groundstation.methods.fleet.unit_series import crossing_of, series_of
from groundstation.methods.fleet.units import BOTH, CLOCK, NO_DATE, FlownUnit, UnitHistories, histories_of
from groundstation.pipeline.many_flights.fleet.publishing import report_again
from groundstation.pipeline.many_flights.fleet.statistics import gather
from groundstation.pipeline.many_flights.fleet.unit_files import UNIT_FLIGHTS_CSV, UNIT_LIMITS, UNITS_CSV, limits_in
from groundstation.results.fleet_units import FleetUnitRow, UnitLimit, UnitLimits, UnitOfFlight
from groundstation.systems.inertial.fleet_units_chapter import build
from groundstation.systems.inertial.fleet_units_share import GRAVITY_MPS2, SCHULER_RADPS, tilt_rad
from tests.acceptance_example import save_flight
from tests.fleet_example import DAY_NS, START_NS

LIMITS = UnitLimits(rate_nmiph=2.0)


def flown(
    rates: Sequence[float],
    serial: str = "S-1",
    *,
    aircraft: str = "RA-1",
    first: int = 0,
    step_days: float = 5.0,
    topic: str = "ins",
    reason: str = "",
) -> list[FlownUnit]:
    """Flights of a unit, one every few days and three hours long."""
    found = []
    for place, rate in enumerate(rates):
        start = START_NS + int((first + place * step_days) * DAY_NS)
        unit = UnitOfFlight(topic, serial, reason, "navigation", 2.5, rate_nmiph=rate)
        name = f"F{first:04d}-{place:03d}-{aircraft}-{topic}"
        found.append(FlownUnit(unit, name, aircraft, start, start + DAY_NS // 8))
    return found


def steady(count: int, seed: int = 1, level: float = 0.8) -> list[float]:
    """Rates of a unit that does not change."""
    return (level * np.random.default_rng(seed).rayleigh(0.8, count)).tolist()


def only(found: UnitHistories) -> FleetUnitRow:
    """The only unit."""
    (row,) = found.rows
    return row


def kinds(found: UnitHistories) -> list[str]:
    return [one.kind for one in found.events]


def test_the_slope_of_a_noiseless_line_is_exact_and_one_wild_flight_does_not_move_it() -> None:
    time = np.array([0.0, 1.0, 2.5, 4.0, 7.0, 8.0, 12.0, 13.0])
    line = line_of(time, 3.0 + 0.5 * time)
    assert line is not None
    assert line.slope == pytest.approx(0.5) and line.at(np.array([20.0]))[0] == pytest.approx(13.0)
    assert (line.slope_low, line.slope_high) == pytest.approx((0.5, 0.5)) and line.scatter == pytest.approx(0.0)
    wild = 3.0 + 0.5 * time
    wild[3] += 1e6
    moved = line_of(time, wild)
    assert moved is not None and moved.slope == pytest.approx(0.5)


@pytest.mark.parametrize("count", [6, 8, 12, 30, 90])
def test_the_interval_of_the_slope_holds_the_truth_as_often_as_stated(count: int) -> None:
    rng, runs, slope = np.random.default_rng([48, count]), 300, 0.01
    inside = 0
    for _ in range(runs):
        time = np.sort(rng.uniform(0.0, 300.0, count))
        line = line_of(time, slope * time + rng.standard_t(3, count))
        assert line is not None
        inside += line.slope_low <= slope <= line.slope_high
    assert inside / runs >= 0.95 - 4.0 * math.sqrt(0.95 * 0.05 / runs)


def test_neighbours_that_are_alike_widen_the_interval() -> None:
    rng, wide, plain = np.random.default_rng(5), [], []
    for _ in range(40):
        noise = rng.normal(0.0, 1.0, 60)
        alike = noise.copy()
        for place in range(1, 60):
            alike[place] = 0.7 * alike[place - 1] + math.sqrt(1.0 - 0.49) * noise[place]
        for value, into in ((alike, wide), (noise, plain)):
            line = line_of(np.arange(60.0), value)
            assert line is not None
            into.append(line.slope_high - line.slope_low)
    assert np.median(wide) > 1.5 * np.median(plain)


def test_too_few_flights_give_no_line_and_no_date() -> None:
    assert line_of(np.arange(5.0), np.arange(5.0)) is None and line_of(np.zeros(9), np.arange(9.0)) is None
    row = only(histories_of(flown(steady(4)), LIMITS))
    assert (row.outlook, row.flights_missing, row.due_utc_ns) == ("few", FEWEST - 4, None)
    assert "2 more needed" in row.text and row.rate_nmiph is not None and row.slope_nmiph_per_year is None
    assert only(histories_of(flown([0.7]), LIMITS)).flights_missing == FEWEST - 1


def test_a_unit_that_ages_gets_a_date_and_the_date_is_right() -> None:
    day = np.arange(0.0, 200.0, 10.0)
    truth = 0.5 + 0.004 * day  # reaches 2.0 at day 375
    rates = truth + np.random.default_rng(3).normal(0.0, 0.05, len(day))
    row = only(histories_of(flown(rates.tolist(), step_days=10.0), LIMITS))
    assert row.outlook == "due" and row.due_utc_ns is not None
    assert row.due_earliest_utc_ns is not None and row.due_latest_utc_ns is not None
    true_ns = START_NS + 375 * DAY_NS
    assert row.due_earliest_utc_ns <= true_ns <= row.due_latest_utc_ns
    assert abs(row.due_utc_ns - true_ns) < 60 * DAY_NS and "calibrate by" in row.text
    assert row.slope_low_nmiph_per_year is not None and row.slope_low_nmiph_per_year > 0.0


def test_the_limit_is_that_of_the_serial_then_the_users_then_the_class() -> None:
    own = UnitLimits(rate_nmiph=2.0, serials=(UnitLimit("S-1", 5.0),))
    flights = flown(steady(20))
    rows = [only(histories_of(flights, limits)) for limits in (own, LIMITS, UnitLimits())]
    assert [(row.limit_nmiph, row.limit_by) for row in rows] == [
        (5.0, "stated"),
        (2.0, "stated"),
        (2.5, "class navigation"),
    ]


def test_a_unit_over_its_limit_is_called_so() -> None:
    row = only(histories_of(flown(steady(30, level=6.0)), LIMITS))
    assert row.outlook == "over" and row.rate_low_nmiph is not None and row.rate_low_nmiph > 2.0


def test_a_steady_unit_has_no_date() -> None:
    row = only(histories_of(flown(steady(60), step_days=6.0), UnitLimits(rate_nmiph=4.0)))
    assert row.outlook == "steady" and row.due_utc_ns is None and "does not reach" in row.text


def test_a_step_is_a_change_and_a_slope_is_none() -> None:
    rng = np.random.default_rng(7)
    day = np.arange(40.0) * 5.0
    step = np.where(np.arange(40) < 20, 0.6, 1.8) * np.exp(rng.normal(0.0, 0.15, 40))
    slope = (0.5 + 0.005 * day) * np.exp(rng.normal(0.0, 0.15, 40))
    found = series_of(day, step, is_positive=True)
    assert [change.index for change in found.changes] == [20] and not found.is_sloped
    assert found.line is not None and found.line.flights == 20
    assert series_of(day, slope, is_positive=True).changes == ()
    row = only(histories_of(flown(step.tolist()), LIMITS))
    assert row.rate_nmiph == pytest.approx(1.8, rel=0.2)


def test_a_move_tells_where_from_where_to_and_when() -> None:
    first = flown(steady(10), aircraft="RA-1")
    later = flown(steady(10, 2), aircraft="RA-2", first=60)
    found = histories_of([*later, *first], LIMITS)
    (event,) = found.events
    assert event.kind == "moved" and event.text.startswith(
        "removed from RA-1 after 2026-06-18, fitted to RA-2 by 2026-07-03"
    )
    row = only(found)
    assert (row.aircraft, row.fitted_to, row.flights) == ("RA-1, RA-2", "RA-2", 20)


def test_a_replaced_unit_a_gap_and_alike_spellings_are_told() -> None:
    one, other = flown(steady(6), "SN-12"), flown(steady(6, 2), "sn 12", first=200)
    found = histories_of([*one, *other, *flown(steady(2), "SN-12", aircraft="RA-2", first=190)], LIMITS)
    assert sorted(set(kinds(found))) == ["gap", "moved", "replaced", "spelled_alike"]
    told = {event.kind: event.text for event in found.events}
    assert "SN-12 until" in told["replaced"] and "165 days" in told["gap"]


def test_one_serial_in_two_aircraft_at_one_time_counts_in_neither() -> None:
    flights = [*flown(steady(8)), *flown([9.0], aircraft="RA-2", first=10)]
    found = histories_of(flights, LIMITS)
    assert only(found).counted == 7 and "two_aircraft" in kinds(found)
    assert found.flights.reason.tolist().count(BOTH) == 2


def test_one_serial_in_two_aircraft_on_one_day_is_told_and_counts() -> None:
    later = FlownUnit(
        UnitOfFlight("ins", "S-1", rate_nmiph=0.9), "G", "RA-2", START_NS + 10 * DAY_NS + DAY_NS // 4, None
    )
    found = histories_of([*flown(steady(8)), later], LIMITS)
    assert only(found).counted == 9 and "check the serial" in next(
        one.text for one in found.events if one.kind == "two_aircraft"
    )


def test_clocks_that_were_not_set_and_flights_without_time_are_in_no_trend() -> None:
    unit = UnitOfFlight("ins", "S-1", rate_nmiph=50.0)
    wrong = FlownUnit(unit, "A", "RA-1", 3600 * 10**9, None)
    none = FlownUnit(unit, "B", "RA-1", None, None)
    found = histories_of([wrong, none, *flown(steady(7))], LIMITS)
    row = only(found)
    assert (row.flights, row.counted, row.undated) == (9, 7, 2) and row.rate_nmiph is not None and row.rate_nmiph < 5.0
    assert {CLOCK, NO_DATE} <= set(found.flights.why_undated.tolist()) and kinds(found) == ["clock"]
    assert only(histories_of([none], LIMITS)).outlook == "no_rate"


def test_an_aided_ins_has_no_rate_and_it_is_said() -> None:
    nan = [math.nan] * 3
    row = only(histories_of(flown(nan, reason="GNSS corrects it"), LIMITS))
    assert (row.outlook, row.counted, row.rate_nmiph) == ("no_rate", 0, None) and "GNSS corrects it" in row.text


def test_two_units_of_one_flight_have_histories_of_their_own() -> None:
    flights = [*flown(steady(8)), *flown(steady(8, 2, 2.0), "S-2", topic="ins.1")]
    first, second = histories_of(flights, LIMITS).rows
    assert (first.counted, second.counted) == (8, 8) and (first.rate_nmiph or 9.0) < (second.rate_nmiph or 0.0)


@pytest.mark.parametrize("serial", ["№ 7/Ж", "=1+1", "<b>x</b>", 'a,b;c"d', "x" * 300, " SN\t12 ", "..\\..", "|`*_"])
def test_odd_serials_are_kept_and_harm_nothing(serial: str, tmp_path: Path) -> None:
    for number in range(7):
        save_flight(tmp_path, number, 0.8, ins=serial)
    fleet = gather(tmp_path)
    (row,) = fleet.units
    assert row.counted == 7 and row.ins_serial == " ".join(serial.split())
    section = build(fleet)
    assert section is not None and markdown(section)
    report_again(tmp_path)
    text = (tmp_path / UNITS_CSV).read_text(encoding="utf-8")
    assert "\n=" not in text and ",=" not in text


def test_the_order_of_flights_does_not_matter() -> None:
    flights = [*flown(steady(20)), *flown(steady(9, 2), "S-2", aircraft="RA-2"), *flown(steady(3), "")]
    once, again = histories_of(flights, LIMITS), histories_of(flights[::-1], LIMITS)
    assert once.rows == again.rows and once.events == again.events
    assert once.flights.flight_id.tolist() == again.flights.flight_id.tolist()


def test_the_folder_shows_units_and_keeps_the_users_limits(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for number in range(12):
        rate = 0.5 + 0.05 * number
        save_flight(out, number * 10, rate, ins="S-1", radial_error_rate_fit_nmiph=rate)
    for number in range(3):
        save_flight(out, 200 + number, 0.7, ins="S-2")
    stated = tmp_path / "limits.toml"
    stated.write_text('rate_nmiph = 1.5\n\n[[serials]]\nins_serial = "S-2"\nrate_nmiph = 3.0\n', encoding="utf-8")
    report_again(out, limits=stated)
    first, second = gather(out).units
    assert (first.outlook, first.limit_nmiph, second.outlook, second.limit_nmiph) == ("due", 1.5, "few", 3.0)
    page = (out / "summary.html").read_text(encoding="utf-8")
    assert "INS units by serial" in page and "calibrate by" in page and "Rate of each unit over time" in page
    assert len((out / UNITS_CSV).read_text(encoding="utf-8").splitlines()) == 3
    assert len((out / UNIT_FLIGHTS_CSV).read_text(encoding="utf-8").splitlines()) == 16
    report_again(out)
    assert gather(out).units[0].limit_nmiph == 1.5 and (out / UNIT_LIMITS).is_file()


@pytest.mark.parametrize(
    "text", ["rate_nmiph = -1", "rate = 1", "rate_nmiph = 'x'", "[[serials]]\nrate_nmiph = 1", "="]
)
def test_limits_that_cannot_be_used_are_told_in_a_line(text: str, tmp_path: Path) -> None:
    for number in range(2):
        save_flight(tmp_path, number, 0.8)
    bad = tmp_path / "bad.txt"
    bad.write_text(text, encoding="utf-8")
    with pytest.raises(SettingsError) as caught:
        report_again(tmp_path, limits=bad)
    assert "\n" not in str(caught.value) and not (tmp_path / UNIT_LIMITS).exists()
    (tmp_path / UNIT_LIMITS).write_text(text, encoding="utf-8")
    done = report_again(tmp_path)
    assert any(UNIT_LIMITS in one.text for one in done.problems) and limits_in(tmp_path)[0] == UnitLimits()


def test_limits_are_of_folders(tmp_path: Path) -> None:
    folder, path = save_flight(tmp_path, 1, 0.8), tmp_path / "limits.toml"
    path.write_text("rate_nmiph = 1.0\n", encoding="utf-8")
    with pytest.raises(UsageError):
        report_again(folder, limits=path)


def test_the_tilt_at_the_start_is_that_of_the_schuler_wave() -> None:
    time = np.arange(0.0, 5400.0, 10.0)
    wave = GRAVITY_MPS2 / SCHULER_RADPS * np.sin(SCHULER_RADPS * time)
    rng = np.random.default_rng(2)
    found = tilt_rad(time, -4e-5 * wave + rng.normal(0.0, 0.05, len(time)))
    assert found is not None and abs(found[0] - 4e-5) < 4.0 * found[1] and found[1] < 4e-6
    assert tilt_rad(time[:100], wave[:100]) is None and tilt_rad(time + 1200.0, wave) is None


def test_a_line_that_falls_reaches_no_limit() -> None:
    day = np.arange(20.0) * 10.0
    found = crossing_of(day, 1.0 - 0.002 * day, 2.0)
    assert (found.best, found.earliest, found.latest) == (None, None, None)
