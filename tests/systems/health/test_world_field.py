"""Length of the field: against the world model where place and date are known, in a fixed band elsewhere."""

import numpy as np
import pytest

from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.systems.health.evidence import Evidence
from groundstation.systems.health.world_field import against_the_model
from groundstation.tables.table import Flight, Table

START_NS = int(iso_to_utc_ns("2024-03-18T10:00:00Z")[0])
TIME_NS = START_NS + np.arange(20) * 1_000_000_000
ADELAIDE = (-34.9, 138.6)  # 0.59 gauss


def flight(place: tuple[float, float] | None, *, has_utc: bool = True) -> Flight:
    columns = {
        name: Column(np.full(len(TIME_NS), value))
        for name, value in zip(("latitude_deg", "longitude_deg"), place or (np.nan, np.nan), strict=True)
    }
    gnss = Table("gnss", TIME_NS, columns, np.arange(len(TIME_NS)), Column(TIME_NS))
    return Flight({"gnss": gnss}, start_ns=START_NS, has_utc=has_utc)


def length(gauss: float) -> Evidence:
    value = np.full(len(TIME_NS), gauss)
    return Evidence("magnetometer", "field_length_gauss", "", "raw.sensor_mag.x", "gauss", TIME_NS, value)


@pytest.mark.parametrize(("gauss", "off"), [(0.59, 0.0), (0.89, 0.5), (0.295, 0.5)])
def test_the_model_decides_where_place_and_date_are_known(gauss: float, off: float) -> None:
    (one,) = against_the_model(flight(ADELAIDE), [length(gauss)])
    assert one.quantity == "field_against_model" and "WMM" in one.source
    assert one.value == pytest.approx(off, abs=0.02)


@pytest.mark.parametrize("made", [flight(None), flight(ADELAIDE, has_utc=False)])
def test_the_band_stays_for_logs_without_a_place_or_a_date(made: Flight) -> None:
    assert against_the_model(made, [length(0.59)])[0].quantity == "field_length_gauss"


def test_other_evidence_stays_as_it_is() -> None:
    other = Evidence("vibration", "vibration_mps2", "IMU 1", "raw.VIBE.VibeX", "m/s2", TIME_NS, np.zeros(len(TIME_NS)))
    assert against_the_model(flight(ADELAIDE), [other, length(0.59)])[0] is other
