"""Start of navigation: what proves it, and that no rate is stated without proof."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import groundstation
from groundstation.base.errors import SettingsError
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.toml_settings import settings_from
from groundstation.base.units import NS_PER_S
from groundstation.cli.lines import line_of
from groundstation.cli.main import app
from groundstation.pipeline.one_flight.configuration import read_toml
from groundstation.pipeline.one_flight.flight import sentence
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.verbs.acceptance import accept
from groundstation.results.answer import by_analysis
from groundstation.systems.inertial import chapter
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.drift_answer import judged_outage
from groundstation.systems.inertial.estimate import Estimation, estimate_ins_errors
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.known import AircraftData
from groundstation.tables.table import Flight
from tests.acceptance_example import save_fleet, save_flight
from tests.real_logs import real_log
from tests.systems.inertial.flights import batch_of, changed, flight_of, with_table, without_rows

LENGTH_S = 5400.0
STAND_S = 120.0
START_NS = 1_777_874_400 * NS_PER_S
NMI_M, S_PER_H = 1852.0, 3600.0
RATE_NMIPH = 1.2
PLACE = ("latitude_deg", "longitude_deg")
SAME = 1e-6  # of a rate, whatever part of the log is cut off in front


def flight_from_stand(rate_nmiph: float = RATE_NMIPH, offset_m: float = 0.0, velocity_mps: float = 0.0) -> Flight:
    """A flight north whose INS error grows evenly from the first second; it stands for two minutes first.

    ``offset_m`` and ``velocity_mps`` are an error of position and velocity that is there from the beginning.
    """
    flight = replace(flight_of(batch_of(duration_s=LENGTH_S)), has_utc=True, start_ns=START_NS)
    for table in flight.tables.values():
        flight = with_table(flight, replace(table, time_ns=table.time_ns + START_NS))
    time_s = flight.time_s("gnss")
    speed = np.where(time_s < STAND_S, 0.0, 100.0)
    north_m = np.concatenate([[0.0], np.cumsum(speed[:-1] * np.diff(time_s))])
    error_m = offset_m + (rate_nmiph * NMI_M / S_PER_H + velocity_mps) * time_s
    radius_m = 6.37e6
    for topic, extra in (("gnss", 0.0), ("ins", error_m)):
        flight = changed(
            flight,
            topic,
            latitude_deg=np.rad2deg((north_m + extra) / radius_m),
            longitude_deg=np.zeros(len(time_s)),
            velocity_north_mps=speed + (velocity_mps if topic == "ins" else 0.0),
            velocity_east_mps=np.zeros(len(time_s)),
        )
    return flight


def estimate(flight: Flight, nav_start_utc: str = "") -> Estimation:
    return estimate_ins_errors(flight, nav_start_utc=nav_start_utc)


def result(flight: Flight, nav_start_utc: str = "") -> InertialResult:
    return estimate(flight, nav_start_utc).result


def start_of(found: InertialResult) -> tuple[float | None, str]:
    assert found.navigation_start is not None
    return found.navigation_start.time_s, found.navigation_start.basis


def begun_at(flight: Flight, second: float) -> Flight:
    """The flight of a log that begins so late."""
    for topic in ("ins", "gnss"):
        flight = without_rows(flight, topic, flight.time_s(topic) >= second)
    return replace(flight, start_ns=int(flight["ins"].time_ns[0]))


def test_a_standstill_with_ins_and_gnss_together_is_a_start() -> None:
    found = result(flight_from_stand())
    assert start_of(found) == (0.0, "standstill")
    assert found.radial_error_rate_50_nmiph == pytest.approx(RATE_NMIPH, rel=0.02)  # scale of the sphere
    assert found.radial_error_rate_fit_nmiph == pytest.approx(RATE_NMIPH, rel=0.02)


@pytest.mark.parametrize("begin_s", [STAND_S + 10.0, 900.0, 2700.0])
def test_a_log_that_begins_in_motion_has_no_rate_but_its_growth(begin_s: float) -> None:
    found = result(begun_at(flight_from_stand(), begin_s))
    assert start_of(found) == (None, "unknown")
    rates = [getattr(found, f"radial_error_rate_{kind}_nmiph") for kind in ("50", "95", "fit")]
    assert rates == [None, None, None]
    hours = (LENGTH_S - begin_s) / S_PER_H
    assert found.compared_hours == pytest.approx(hours, abs=0.001)
    assert found.radial_error_first_m is not None and found.radial_error_last_m is not None
    grown_nmi = (found.radial_error_last_m - found.radial_error_first_m) / NMI_M
    assert grown_nmi == pytest.approx(RATE_NMIPH * hours, rel=0.02)


def test_a_log_that_begins_at_a_stop_after_hours_of_navigation_has_no_rate() -> None:
    found = result(flight_from_stand(offset_m=1500.0))
    assert start_of(found) == (None, "unknown")
    assert found.navigation_start is not None and "m off GNSS already" in found.navigation_start.reason


def test_an_ins_with_a_velocity_error_from_the_first_second_keeps_its_rate() -> None:
    """Where the position still agrees, such an error cannot have lasted: the INS began to navigate just now."""
    found = result(flight_from_stand(rate_nmiph=0.0, velocity_mps=0.8))
    assert start_of(found)[1] == "standstill"
    assert found.radial_error_rate_50_nmiph == pytest.approx(0.8 * S_PER_H / NMI_M, rel=0.02)


def test_gnss_may_come_a_minute_after_the_ins() -> None:
    """By then the velocity error has made a position error; the start is that of the INS record all the same."""
    flight = flight_from_stand(rate_nmiph=0.0, velocity_mps=0.8)
    flight = without_rows(flight, "gnss", flight.time_s("gnss") >= 60.0)
    found = result(flight)
    assert start_of(found) == (0.0, "standstill")
    assert found.radial_error_rate_50_nmiph == pytest.approx(0.8 * S_PER_H / NMI_M, rel=0.02)


def test_a_logged_change_from_alignment_is_a_start_wherever_it_is() -> None:
    flight = begun_at(flight_from_stand(), 600.0)
    time_s = flight.time_s("ins")
    aligned = changed(flight, "ins", mode=np.where(time_s < time_s[0] + 300.0, "align", "nav"))
    found = result(aligned)
    time, basis = start_of(found)
    assert basis == "mode" and time == pytest.approx(time_s[0] + 300.0, abs=1.0)


def test_a_second_alignment_is_told_and_leaves_the_acceptance() -> None:
    flight = flight_from_stand()
    time_s = flight.time_s("ins")
    again = changed(flight, "ins", mode=np.where((time_s > 3000.0) & (time_s < 3060.0), "align", "nav"))
    found = estimate(again)
    assert start_of(found.result) == (0.0, "standstill")
    assert [one.count for one in found.findings if one.code == "inertial.realigned"] == [1]


def test_a_stated_start_before_the_log_gives_the_rate_of_the_whole() -> None:
    whole = result(flight_from_stand())
    late = begun_at(flight_from_stand(), 900.0)
    stated = result(late, utc_ns_to_iso(START_NS))
    time, basis = start_of(stated)
    assert basis == "stated" and time == pytest.approx(-900.0)
    assert stated.radial_error_rate_50_nmiph == pytest.approx(whole.radial_error_rate_50_nmiph, rel=1e-3)
    by_head = replace(late, metadata={"nav_start_utc": utc_ns_to_iso(START_NS)})
    assert result(by_head).radial_error_rate_50_nmiph == pytest.approx(stated.radial_error_rate_50_nmiph, rel=SAME)


@pytest.mark.parametrize(
    ("shift_s", "why"), [(LENGTH_S + 10.0, "after the flight"), (-72 * S_PER_H, "more than 48 h before")]
)
def test_a_stated_start_that_cannot_be_is_told_and_not_used(shift_s: float, why: str) -> None:
    flight = flight_from_stand()
    found = estimate(flight, utc_ns_to_iso(flight.start_ns + round(shift_s * NS_PER_S)))
    assert start_of(found.result)[1] == "standstill"
    assert [why in one.text for one in found.findings if one.code == "inertial.nav_start"] == [True]


def test_a_stated_start_that_is_no_time_is_refused_where_it_stands() -> None:
    with pytest.raises(SettingsError, match="nav_start_utc"):
        AircraftData(nav_start_utc="yesterday")
    flight = flight_from_stand()
    found = estimate(replace(flight, metadata={"nav_start_utc": "soon"}))
    assert ["no ISO 8601" in one.text for one in found.findings if one.code == "inertial.nav_start"] == [True]


def test_the_chapter_says_why_there_is_no_rate() -> None:
    found = result(begun_at(flight_from_stand(), 900.0))
    claim = chapter.inertial_claim(found, "", is_doubtful=False)
    assert claim.headline.replace("\u202f", " ") == "INS error grew at 1.20 nmi/h within the log"
    assert (claim.mark.tone, claim.mark.text) == ("unknown", "No rate"), "no rate is no pass"
    assert claim.remark == "no rate: nothing shows when navigation began"
    why = claim.sentences[0].replace("\u202f", " ")
    assert "position error 553 m at first, 3322 m after 75 min" in why and "state nav_start_utc" in why
    line = INERTIAL.sentence(by_analysis(found))
    assert line.startswith("no rate: INS error grew 1.20 nmi/h in log (state nav_start_utc), max ")


def test_an_error_that_begins_at_zero_in_flight_is_told_as_set_there() -> None:
    set_there = result(begun_at(flight_from_stand(), 900.0))
    assert set_there.navigation_start is not None and "position was set" not in set_there.navigation_start.reason
    flight = begun_at(flight_from_stand(), 900.0)
    both = [{name: flight[kind].columns[name].values for name in PLACE} for kind in ("ins", "gnss")]
    apart = {name: both[0][name] - (both[0][name][0] - both[1][name][0]) for name in PLACE}
    moved = changed(flight, "ins", **apart)
    told = [one.text for one in estimate(moved, utc_ns_to_iso(START_NS)).findings if one.code == "inertial.nav_start"]
    assert len(told) == 1 and told[0].startswith("INS and GNSS are 0 m apart 15 min after the stated start")
    assert not [one for one in estimate(flight, utc_ns_to_iso(START_NS)).findings if one.code == "inertial.nav_start"]
    start = result(moved).navigation_start
    assert start is not None and start.time_s is None
    assert start.reason.endswith(" m apart, as after its position was set to GNSS")


def test_a_stated_start_stands_on_the_line_and_the_page() -> None:
    found = result(begun_at(flight_from_stand(), 900.0), utc_ns_to_iso(START_NS))
    line = INERTIAL.sentence(by_analysis(found))
    start = utc_ns_to_iso(START_NS)
    rate = f"INS {found.radial_error_rate_fit_nmiph:.2f} nmi/h since {start} as stated"
    assert line.startswith(f"{rate} (the aircraft file), max ")
    claim = chapter.inertial_claim(found, "", is_doubtful=False)
    assert (claim.mark.text, claim.figures[0][0]) == ("Measured", "INS drift")
    assert f"stated: the aircraft file says {start}" in claim.figures[0][2].replace("\u202f", " ")


def test_the_largest_error_has_its_utc() -> None:
    flight = flight_from_stand()
    found = result(flight)
    at_s = found.largest_radial_error_at_s
    assert at_s is not None
    utc = utc_ns_to_iso(flight.start_ns + round(at_s * NS_PER_S), 0)
    assert found.largest_radial_error_utc == utc
    assert f"at {utc[11:19]} UTC" in INERTIAL.sentence(by_analysis(found))
    (row,) = [one for one in chapter.inertial_claim(found, "", is_doubtful=False).figures if one[0].startswith("Larg")]
    assert row[2].endswith(f"({utc[:10]} {utc[11:19]} UTC)")
    without = result(replace(flight, has_utc=False))
    assert without.largest_radial_error_utc == "" and "UTC" not in INERTIAL.sentence(by_analysis(without))


@pytest.mark.real_log
def test_the_largest_error_of_a_recorded_ins_is_that_of_its_row() -> None:
    """By hand from the rows, on the ellipsoid: 17 989 s; 17 998 s is 1 cm below it, 17 991 s 6 cm."""
    found = groundstation.open(real_log("inertial/gv_ff02.csv")).results
    answer, ahead = found.answer(InertialResult), found.answer(ForecastResult)
    assert answer is not None and ahead is not None
    assert (answer.largest_radial_error_at_s, answer.largest_radial_error_utc) == (17_989.0, "2014-06-02T01:01:01Z")
    assert answer.largest_radial_error_m == pytest.approx(5896.0, abs=1.0)
    pair = judged_outage(ahead)
    assert pair is not None and pair[1] is not None
    late = [one for one in ahead.phases if one.length_s == 3600.0 and not one.is_early]
    assert [(one.rms_m, one.raw_rms_m) for one in late] == [pytest.approx((pair[0].rms_m, pair[1].rms_m))]
    line = line_of(Outcome("gv_ff02.csv", "done", sentence(found), flight_id=found.flight_id))
    assert line.startswith("no rate: INS error grew 0.61 nmi/h in log (state nav_start_utc), max 3.18 nmi at 01:01:01")
    assert "95 % forecast 942 m at 60 min" in line and len(line) <= 160


def test_flights_without_a_start_stand_outside_the_acceptance(tmp_path: Path) -> None:
    from groundstation.systems.inertial.answer import NavigationStart

    save_fleet(tmp_path, [0.5] * 3)
    save_flight(tmp_path, 10, 9.0, navigation_start=NavigationStart(None, "unknown", "the aircraft moves"))
    save_flight(tmp_path, 11, 9.0, navigation_start=None)
    save_flight(tmp_path, 12, 0.5, navigation_start=NavigationStart(-3600.0, "stated", "the aircraft file says so"))
    found = accept(tmp_path, "app-g")
    reasons = [flight.reason for flight in found.flights if not flight.is_included]
    assert sorted(reason.partition(":")[0] for reason in reasons) == [
        "nothing shows when navigation began",
        "saved by an older version, which did not ask when navigation began",
    ]
    assert max(flight.hours for flight in found.included) == pytest.approx(4.0), "an hour before the log, three in it"


@pytest.mark.parametrize(
    ("case", "rate"),
    [
        ("cases/x0_whole_flight.csv.gz", 1.65),
        ("cases/f_zero_fix_first_60s.csv.gz", 1.65),
        ("cases/x1_started_in_flight.csv.gz", None),
    ],
)
def test_one_ins_as_a_whole_and_from_the_middle(case: str, rate: float | None, tmp_path: Path) -> None:
    ended = CliRunner().invoke(app, ["run", str(real_log(case)), "-o", str(tmp_path / "out"), "--only", "results"])
    assert ended.exit_code == 0
    (summary,) = (tmp_path / "out").glob("*/summary.json")
    found = json.loads(summary.read_text())["results"]["inertial"]["radial_error_rate_50_nmiph"]
    assert found is None if rate is None else found == pytest.approx(rate, abs=0.006)


def test_a_start_is_the_same_with_and_without_quotes(tmp_path: Path) -> None:
    path = tmp_path / "aircraft.toml"
    for written in ('"2014-06-01T20:01:12Z"', "2014-06-01T20:01:12Z", "2014-06-01 20:01:12Z"):
        path.write_text(f"nav_start_utc = {written}\n")
        assert settings_from(AircraftData, read_toml(path), str(path)).nav_start_utc == "2014-06-01T20:01:12Z"


@pytest.mark.slow
def test_a_real_ins_whose_log_begins_in_the_air_has_its_rate_by_a_stated_start(tmp_path: Path) -> None:
    log, settings = real_log("inertial/gv_ff02.csv"), tmp_path / "aircraft.toml"
    settings.write_text('[aircraft]\nnav_start_utc = "2014-06-01T20:01:12Z"\n')
    rates = {}
    for name, more in (("alone", []), ("stated", ["--config", str(settings)])):
        call = ["run", str(log), "-o", str(tmp_path / name), "--only", "results", *more]
        assert CliRunner().invoke(app, call).exit_code == 0
        (summary,) = (tmp_path / name).glob("*/summary.json")
        found = json.loads(summary.read_text())["results"]["inertial"]
        rates[name] = [found[f"radial_error_rate_{kind}_nmiph"] for kind in ("50", "fit")]
    assert rates == {"alone": [None, None], "stated": pytest.approx([0.65, 0.61], abs=0.006)}
