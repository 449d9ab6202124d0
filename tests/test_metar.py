"""Wind of METAR lines."""

import math

import pytest

from groundstation.base.metar import metar_wind, metar_winds, nearest_wind
from groundstation.base.timescales import iso_to_utc_ns

KNOT = 1852.0 / 3600.0
HOUR_NS = 3600 * 10**9


@pytest.mark.parametrize(
    ("line", "north_mps", "east_mps", "sigma_mps"),
    [
        ("METAR UUEE 040600Z 27010MPS CAVOK 12/05 Q1013 NOSIG=", 0.0, 10.0, 1.5),
        ("METAR COR EDDF 040620Z 36010KT 9999", -10 * KNOT, 0.0, 1.5),
        ("SPECI EDDF 040620Z AUTO 18018KMH 9999", 5.0, 0.0, 1.5),
        ("KJFK 040651Z 09010G20KT 10SM RMK AO2 PK WND 27040/0630", 0.0, -10 * KNOT, math.hypot(1.5, 5 * KNOT)),
        ("KJFK 040651Z COR 09010KT 10SM", 0.0, -10 * KNOT, 1.5),
        ("EGLL 040650Z AUTO 27010KT 240V300 9999", 0.0, 10 * KNOT, math.hypot(1.5, 0.25 * 10 * KNOT)),
        ("EGLL 040650Z 00000KT CAVOK", 0.0, 0.0, 1.5),
        ("EGLL 040650Z VRB04KT CAVOK", 0.0, 0.0, math.hypot(1.5, 4 * KNOT / math.sqrt(2))),
        ("2026-05-04 06:50,EGLL 040650Z 270P99MPS 0050", 0.0, 99.0, 1.5),
    ],
)
def test_wind_of_a_line(line: str, north_mps: float, east_mps: float, sigma_mps: float) -> None:
    wind = metar_wind(line)
    assert wind is not None
    assert (wind.north_mps, wind.east_mps, wind.sigma_mps) == pytest.approx((north_mps, east_mps, sigma_mps), abs=1e-9)


@pytest.mark.parametrize(
    "line",
    [
        "METAR UUEE 040600Z NIL=",
        "METAR UUEE 040600Z AUTO /////KT 9999",
        "METAR UUEE 040600Z ///10KT 9999",
        "TAF UUEE 040500Z 0406/0506 27010MPS 9999",
        "METAR UUEE 042500Z 27010MPS",
        "METAR UUEE 000600Z 27010MPS",
        "METAR UUEE 040600Z 40010MPS",
        "# wind of the day",
        "",
    ],
)
def test_a_line_without_a_wind_has_none(line: str) -> None:
    assert metar_wind(line) is None


def test_a_correction_takes_the_place_of_the_report_it_corrects() -> None:
    lines = ["METAR UUEE 040600Z 27010MPS", "METAR COR UUEE 040600Z 18010MPS"]
    (wind,) = metar_winds(lines)
    assert wind.north_mps == pytest.approx(10.0)


def test_the_month_is_that_of_the_flight() -> None:
    wind = metar_wind("METAR UUEE 302350Z 27010MPS")
    assert wind is not None
    near_ns, _ = iso_to_utc_ns("2026-05-01T00:10:00Z")
    assert wind.utc_ns(near_ns) == iso_to_utc_ns("2026-04-30T23:50:00Z")[0]
    dated = metar_wind("202603302350 METAR UUEE 302350Z 27010MPS")
    assert dated is not None and dated.utc_ns(near_ns) == iso_to_utc_ns("2026-03-30T23:50:00Z")[0]


def test_the_nearest_report_of_the_field_is_taken_within_the_hour() -> None:
    lines = ["UUEE 040530Z 27010MPS", "UUEE 040630Z 18005MPS", "UUWW 040600Z 09003MPS"]
    at_ns, _ = iso_to_utc_ns("2026-05-04T06:05:00Z")
    winds = metar_winds(lines)

    def name(station: str, longest_ns: int = HOUR_NS) -> str | None:
        wind, _away_ns = nearest_wind(winds, at_ns, longest_ns, station)
        return wind.name if wind else None

    assert (name(""), name("UUEE"), name("UUDD")) == ("UUWW 040600Z", "UUEE 040630Z", None)
    assert nearest_wind(winds, at_ns + 5 * HOUR_NS, HOUR_NS)[0] is None
