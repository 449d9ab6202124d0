"""True heading: as logged, or magnetic + declination of the world magnetic model of the flight's date."""

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.declination import declination_along, declination_sigma_deg
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.tables.headings import true_from_magnetic, true_heading
from groundstation.tables.table import Flight, Table

JUNE_2026 = iso_to_utc_ns("2026-06-01T00:00:00Z")[0]
WMM_PRINTED_DEG = 0.01  # the test values are printed to 0.01 deg


def table(topic: str, step_s: float, start_ns: int, **columns: object) -> Table:
    arrays = {name: Column(np.array(values, dtype=np.float64)) for name, values in columns.items()}
    count = len(next(iter(arrays.values())))
    time_ns = start_ns + np.arange(count) * round(step_s * NS_PER_S)
    return Table(topic, time_ns, arrays, np.arange(count), Column(time_ns))


def flight(*tables: Table, start_ns: int = JUNE_2026, has_utc: bool = True, **metadata: str) -> Flight:
    keys = {name.replace("__", "."): text for name, text in metadata.items()}
    return Flight({one.topic: one for one in tables}, keys, start_ns, has_utc, "a.csv")


@pytest.mark.parametrize(
    ("date", "altitude_km", "latitude", "longitude", "declination", "horizontal"),
    [
        # NOAA, WMM2020testvalues.pdf and WMM2015v2testvalues.pdf, as kept in boxpet/pygeomag test/test_values
        ("2020-01-01T00:00:00Z", 0.0, 80.0, 0.0, -1.28, 6572.0),
        ("2020-01-01T00:00:00Z", 100.0, -80.0, 240.0, 68.78, 15875.4),
        ("2022-07-02T12:00:00Z", 0.0, -80.0, 240.0, 69.13, 16885.0),
        ("2022-07-02T12:00:00Z", 100.0, 0.0, 120.0, -0.05, 37694.1),
        ("2017-07-02T12:00:00Z", 0.0, 80.0, 0.0, -2.59, 6612.0),
    ],
)
def test_model_gives_its_published_test_values(
    date: str, altitude_km: float, latitude: float, longitude: float, declination: float, horizontal: float
) -> None:
    utc_ns = iso_to_utc_ns(date)[0]
    found = declination_along(np.array([latitude]), np.array([longitude]), np.array([altitude_km * 1e3]), utc_ns)
    assert found.values_deg[0] == pytest.approx(declination, abs=WMM_PRINTED_DEG)
    assert found.horizontal_nt[0] == pytest.approx(horizontal, abs=0.2)


def test_interpolation_along_a_track_agrees_with_the_model_at_every_point() -> None:
    latitude, longitude = np.linspace(52.0, 60.0, 901), np.linspace(10.0, 60.0, 901)
    dense = declination_along(latitude, longitude, np.full(901, 9_000.0), JUNE_2026)
    for row in (0, 123, 456, 900):
        alone = declination_along(latitude[row : row + 1], longitude[row : row + 1], np.array([9e3]), JUNE_2026)
        assert dense.values_deg[row] == pytest.approx(alone.values_deg[0], abs=1e-3)


def test_declination_crosses_the_date_line_and_keeps_unknown_positions_unknown() -> None:
    latitude = np.array([60.0, np.nan, 60.0, 60.0])
    longitude = np.array([179.9, 179.95, -179.99, -179.9])
    found = declination_along(latitude, longitude, np.full(4, np.nan), JUNE_2026)
    assert np.isnan(found.values_deg[1])
    assert np.ptp(found.values_deg[[0, 2, 3]]) < 0.2


def test_sign_worked_example() -> None:
    """Needle 15 deg east of true north (Seattle): nose on magnetic north looks to 15 deg true."""
    ins = table(
        "ins", 1.0, JUNE_2026, magnetic_heading_deg=[0.0, 350.0], latitude_deg=[47.62] * 2, longitude_deg=[-122.35] * 2
    )
    result = true_heading(flight(ins))
    assert result.values_deg[0] == pytest.approx(14.9, abs=0.2)
    assert result.values_deg[1] == pytest.approx(4.9, abs=0.2)
    assert float(true_from_magnetic(np.array(350.0), np.array(-15.0))) == 335.0
    assert result.declination_sigma_deg == pytest.approx(np.hypot(0.26, 5417 / 18_800), abs=0.01)
    assert "WMM-2025 at the position of ins: +14." in result.description


def test_logged_true_heading_comes_first_with_its_origin() -> None:
    ins = table("ins", 1.0, 0, true_heading_deg=[360.0, np.nan], magnetic_heading_deg=[1.0, 2.0])
    result = true_heading(flight(ins, has_utc=False, start_ns=0))
    np.testing.assert_array_equal(result.values_deg, [0.0, np.nan])
    assert (result.description, result.declination_sigma_deg) == ("true heading as logged", None)
    told = flight(ins, derived__ins__true_heading_deg="magnetic heading + logged variation")
    assert (
        true_heading(told).description
        == "true heading, which the reader derived from magnetic heading + logged variation"
    )


def test_position_of_the_receiver_is_carried_over_at_most_ten_minutes() -> None:
    ins = table("ins", 300.0, JUNE_2026, magnetic_heading_deg=[10.0, np.nan, 10.0, 10.0, 10.0, 10.0])
    gnss = table("gnss", 300.0, JUNE_2026, latitude_deg=[np.nan, 56.0, 56.0], longitude_deg=[40.0, 40.0, 40.0])
    values = true_heading(flight(ins, gnss)).values_deg
    assert np.isfinite(values).tolist() == [True, False, True, True, True, False]


def test_what_cannot_be_assessed_says_why() -> None:
    magnetic = table("ins", 1.0, JUNE_2026, magnetic_heading_deg=[1.0])
    placed = table("ins", 1.0, JUNE_2026, magnetic_heading_deg=[1.0], latitude_deg=[56.0], longitude_deg=[40.0])
    nothing = table("ins", 1.0, JUNE_2026, true_heading_deg=[np.nan], magnetic_heading_deg=[np.nan])
    late = iso_to_utc_ns("2030-01-01T00:00:00Z")[0]
    for case, text in (
        (flight(), "no samples of ins"),
        (flight(nothing), "neither true nor magnetic"),
        (flight(placed, has_utc=False), "without date"),
        (flight(magnetic), "without any position"),
        (flight(placed, start_ns=late), "1970 to 2029"),
    ):
        with pytest.raises(NotAssessableError, match=text):
            true_heading(case)


@pytest.mark.parametrize(
    ("date", "model"),
    [
        ("1970-01-01", "IGRF-14"),
        ("2009-12-31", "IGRF-14"),
        ("2010-01-01", "WMM-2010"),
        ("2019-12-31", "WMM-2015v2"),
        ("2029-12-31", "WMM-2025"),
    ],
)
def test_model_of_the_date(date: str, model: str) -> None:
    utc_ns = iso_to_utc_ns(f"{date}T23:59:00Z")[0]
    assert declination_along(np.array([56.0]), np.array([40.0]), np.array([0.0]), utc_ns).model == model


def test_reference_field_goes_over_into_the_world_magnetic_model() -> None:
    """On the last day of the one and the first of the other they agree by far better than either is known."""
    latitude, longitude = (
        np.array([-60.0, -30.0, 0.0, 30.0, 56.0, 65.0]),
        np.array([20.0, 150.0, -60.0, 100.0, 40.0, -20.0]),
    )
    before, after = (
        declination_along(latitude, longitude, np.full(6, 1000.0), iso_to_utc_ns(f"{date}T12:00:00Z")[0])
        for date in ("2009-12-31", "2010-01-01")
    )
    assert np.abs(wrap_180(after.values_deg - before.values_deg)).max() < 0.15
    assert np.abs(after.horizontal_nt / before.horizontal_nt - 1.0).max() < 0.005
    assert np.abs(after.down_nt - before.down_nt).max() < 150.0


def test_declination_of_an_older_flight_is_that_of_its_year() -> None:
    """In London the needle stood some 7 deg west in 1970 and came nearer to north by some 8 arcmin a year."""
    west = [
        -float(declination_along(np.array([51.5]), np.array([-0.1]), np.zeros(1), ns).values_deg[0])
        for ns in (iso_to_utc_ns(f"{year}-07-01T00:00:00Z")[0] for year in (1970, 2005))
    ]
    assert west[0] > 6.0 and 1.5 < west[1] < 3.5 and west[0] > west[1]
    assert np.isfinite(declination_along(np.array([90.0]), np.zeros(1), np.zeros(1), 10**18).values_deg).all()


def test_sigma_of_declination() -> None:
    assert float(declination_sigma_deg(np.array(5417.0))) == pytest.approx(np.hypot(0.26, 1.0))
