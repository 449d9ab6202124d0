"""Garmin G1000 logs: hand-written ones with every oddity, and the facts of the recorded ones (PROVENANCE.md)."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import direction_of, wrap_180
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Damage, Item, RecordBatch
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import MPS_PER_KNOT, NS_PER_S
from groundstation.integrity import Survey, corrected, ledger_findings, survey
from groundstation.readers import registry
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

TOP = (
    '#airframe_info, log_version="1.03", airframe_name="Cirrus SR22 Turbo", system_id="25B289D04", mode=NORMAL,\n'
    "#yyy-mm-dd, hh:mm:ss,   hh:mm, degrees, degrees, kt, deg, deg, deg, G, G, ft wgs, fpm, ft, inch, enum, amps\n"
    "  Lcl Date, Lcl Time, UTCOfst, Latitude, Longitude, GndSpd, HDG, TRK, MagVar, LatAc, NormAc, AltGPS, VSpdG, "
    "AltInd, BaroA, GPSfix, amp1\n"
)
ROW = "{date}, {time}, +02:00, 49.5, 4.25, 100.0, 359.0, 90.0, 2.0, 0.10, 0.50, 1000.0, 600.0, 100.0, 29.92126, 3D, 1\n"
UNTIMED = "          ,         ,        ,       ,       ,    , 10.0,    ,   ,    ,    ,    ,    ,    ,    , NoSoln, 1\n"


def row(time: str, date: str = "2022-04-17") -> str:
    return ROW.format(date=date, time=time)


def write(tmp_path: Path, *parts: str) -> Path:
    path = tmp_path / "log.csv"
    path.write_text("".join((TOP, *parts)), encoding="ascii")
    return path


def test_units_signs_and_derived_fields(tmp_path: Path) -> None:
    log = Read(write(tmp_path, row("12:00:00")))
    assert log.header.reader == "csv-profile garmin-g1000" and log.header.utc_of_zero_ns == 0
    assert log.header.metadata["aircraft"] == "Cirrus SR22 Turbo 25B289D04"
    assert log.times("gnss") == [iso_to_utc_ns("2022-04-17T10:00:00Z")[0]]  # local minus offset
    assert log.values("ins", "magnetic_heading_deg") == [359.0] and log.values("ins", "true_heading_deg") == [1.0]
    assert log.values("gnss", "track_deg") == [92.0]
    assert log.values("gnss", "ground_speed_mps") == [pytest.approx(100 * MPS_PER_KNOT)]
    assert log.values("gnss", "velocity_east_mps") == [pytest.approx(100 * MPS_PER_KNOT * np.cos(np.deg2rad(2)))]
    assert log.values("gnss", "velocity_down_mps") == [pytest.approx(-600 * 0.3048 / 60)]
    assert log.values("gnss", "altitude_ellipsoid_m") == [pytest.approx(304.8)]
    assert log.values("ins", "accel_y_mps2") == [pytest.approx(0.980665)]
    assert log.values("ins", "accel_z_mps2") == [pytest.approx(-1.5 * 9.80665)]  # normal acceleration leaves 1 g out
    assert log.values("baro", "pressure_altitude_m") == [pytest.approx(30.48)]  # the setting is the standard one
    assert log.values("gnss", "fix") == ["3d"] and log.values("raw.g1000", "amp1") == [1.0]


def test_every_word_for_the_kind_of_fix(tmp_path: Path) -> None:
    words = ["NoSoln", "2D", "2D-", "2DDiff", "3D", "3D-", "3DDiff"]
    rows = [row(f"12:00:{at:02d}").replace(" 3D,", f" {word},") for at, word in enumerate(words)]
    expected = ["none", "2d", "2d", "dgnss", "3d", "3d", "dgnss"]
    assert Read(write(tmp_path, *rows)).values("gnss", "fix") == expected


def test_a_word_for_the_fix_that_nobody_knows_is_named(tmp_path: Path) -> None:
    words = ["3D", "3D+", "3D+", "DR"]
    rows = [row(f"12:00:{at:02d}").replace(" 3D,", f" {word},") for at, word in enumerate(words)]
    log = Read(write(tmp_path, *rows))
    (told,) = log.damages
    assert (told.count, told.what) == (3, "cells that the profile does not list ('3D+' and 'DR')")
    assert len(log.values("gnss", "ground_speed_mps")) == 4


def test_both_date_formats_headers_in_the_middle_and_rows_without_time(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        UNTIMED,
        UNTIMED,
        row("12:00:00", "17/04/2022"),
        row("12:00:01", "17/04/2022"),
        TOP,
        row("12:00:02"),
        row("12:00:02"),
        row("12:00:04"),
        row("12:00:05")[:40],
    )
    log = Read(path)
    assert log.rows("ins") == [4, 5, 6, 7, 11, 12, 13] and log.times("ins")[:2] == [None, None]
    assert log.damage("repeated_header").count == 3 and not log.damage("repeated_header").loses_data
    assert log.damage("truncated").place == "row 14"
    found = survey(registry.read(path))
    first_ns = iso_to_utc_ns("2022-04-17T09:59:58Z")[0]
    times = [(int(t) - first_ns) // NS_PER_S for b in batches(path, found, "ins") for t in _times(b)]
    assert times == [0, 1, 2, 3, 4, 4, 6] and found.clock.missing_times == 2
    assert found.ledger["ins"].duplicates == 1 and not found.clock.steps


def _times(batch: RecordBatch) -> np.ndarray:
    assert batch.time_ns is not None
    return batch.time_ns


def batches(path: Path, found: Survey, topic: str) -> list[RecordBatch]:
    return [batch for batch in corrected(registry.read(path), found.clock) if batch.topic == topic]


def column(items: list[RecordBatch], name: str) -> np.ndarray:
    parts = [np.where(batch.columns[name].mask, batch.columns[name].values, np.nan) for batch in items]
    return np.concatenate(parts)


def step_of(found: Survey) -> tuple[int, float, str, str]:
    (step,) = found.clock.steps
    times = [found.clock.text(ns)[11:19] for ns in (step.device_before_ns, step.device_after_ns)]
    return step.record_index, step.size_s, times[0], times[1]


def kinds(items: list[Item]) -> dict[str, str]:
    return {item.kind: item.place for item in items if isinstance(item, Damage)}


@pytest.mark.real_log
def test_flight_of_17_april_steps_back_when_gps_time_arrives() -> None:
    path = real_log("g1000/log_220417_125002_LFQA.csv")
    items = list(registry.read(path))
    found = survey(items)
    assert step_of(found) == (24, -3.0, "12:49:04", "12:49:01")  # file line 24, the 21st row of data
    assert found.clock.missing_times == 2 and kinds(items) == {"truncated": "row 2845"}
    raw = found.ledger["raw.g1000"]
    assert (raw.rows, raw.backward_steps, raw.duplicates, len(raw.gaps)) == (2841, 1, 0, 0)
    assert found.clock.text(raw.first_ns)[:19] == "2022-04-17T12:48:41" and raw.span_s == 2840.0
    assert raw.coverage == 1.0 and found.ledger["air"].fields[0].out_of_range == 1  # TAS of -1 kt
    finding = next(f for f in ledger_findings(found.ledger) if f.code == "clock.backward_step")
    assert "3.000 s" in finding.text and "12:49:04" in finding.text and finding.place.endswith("record 24")


@pytest.mark.real_log
def test_log_of_2_may_steps_back_by_fifteen_seconds() -> None:
    path = real_log("g1000/log_220502_135932_EGPN.csv")
    found = survey(registry.read(path))
    assert step_of(found) == (21, -15.0, "13:58:41", "13:58:26") and found.clock.missing_times == 0
    assert found.ledger["raw.g1000"].rows == 400 and found.ledger["raw.g1000"].span_s == 399.0


@pytest.mark.real_log
def test_log_of_23_june_writes_day_month_year_and_repeats_seconds() -> None:
    items = list(registry.read(real_log("g1000/log_210623_141501_TEST1.csv")))
    found = survey(items)
    raw = found.ledger["raw.g1000"]
    assert (raw.rows, raw.duplicates, raw.backward_steps, len(raw.gaps)) == (4683, 139, 0, 0)
    assert found.clock.text(raw.first_ns)[:19] == "2021-06-23T14:13:51" and raw.span_s == 4682.0
    assert not found.clock.steps and found.clock.stray_rows == 0 and not found.ledger.loses_data
    codes = {finding.code: finding.severity for finding in ledger_findings(found.ledger)}
    assert codes["time.duplicates"] == "info"  # one-second resolution: no error


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "rows", "missing", "cut"),
    [
        ("g1000/log_220416_161856_LFQA.csv", 192, 3, "row 196"),
        ("damaged/log_220502_095923______.csv", 9, 0, "row 13"),
    ],
)
def test_cut_logs(name: str, rows: int, missing: int, cut: str) -> None:
    items = list(registry.read(real_log(name)))
    found = survey(items)
    assert found.ledger["raw.g1000"].rows == rows and found.clock.missing_times == missing
    assert kinds(items) == {"truncated": cut} and found.ledger.loses_data and not found.clock.steps


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["log_220416_161856_LFQA.csv", "log_220502_135932_EGPN.csv"])
def test_taxi_only_logs_stay_below_six_metres_per_second(name: str) -> None:
    path = real_log(f"g1000/{name}")
    assert np.nanmax(column(batches(path, survey(registry.read(path)), "gnss"), "ground_speed_mps")) < 6.0


MEDIAN_TRACK_ERROR_DEG = 0.15  # TRK and MagVar are written to 0.1 deg
VARIATION_ERROR_DEG = 0.3  # Garmin's table against the World Magnetic Model 2020 on the ground


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "year"), [("log_210623_141501_TEST1.csv", 2021.5), ("log_220417_125002_LFQA.csv", 2022.3)]
)
def test_variation_is_east_positive_by_positions_and_by_the_magnetic_model(name: str, year: float) -> None:
    from pygeomag import GeoMag

    path = real_log(f"g1000/{name}")
    found = survey(registry.read(path))
    gnss = batches(path, found, "gnss")
    latitude, longitude = column(gnss, "latitude_deg"), column(gnss, "longitude_deg")
    first = int(np.flatnonzero(np.isfinite(latitude))[0])  # the rows before it say that there is no fix
    north, east = north_east_m(latitude, longitude, float(latitude[first]), float(longitude[first]))
    moved = direction_of(north[2:] - north[:-2], east[2:] - east[:-2])
    fast = column(gnss, "ground_speed_mps")[1:-1] > 30.0
    errors = wrap_180(moved - column(gnss, "track_deg")[1:-1])[fast]
    assert abs(np.nanmedian(errors)) < MEDIAN_TRACK_ERROR_DEG
    variation = column(batches(path, found, "raw.g1000"), "MagVar")
    model = GeoMag(base_year=2020).calculate(glat=float(latitude[-1]), glon=float(longitude[-1]), alt=0, time=year).d
    assert abs(float(variation[-1]) - model) < VARIATION_ERROR_DEG
