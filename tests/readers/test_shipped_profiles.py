"""Shipped profiles: each table is recognised, and each value comes in its unit, with its sign."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from groundstation.base.timescales import iso_to_utc_ns
from groundstation.readers import registry
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

UTC = iso_to_utc_ns("2024-05-06T10:00:00Z")[0]
MPS_PER_KT = 1852 / 3600


@dataclass(frozen=True)
class Case:
    """A table, and what its first row must give; ``profile`` where it is not recognised by itself."""

    name: str
    text: str
    values: Mapping[str, float | str]
    utc_ns: int | None = UTC
    profile: str = ""
    end: str = ""


FLYSIGHT = (
    "time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,heading,cAcc,gpsFix,numSV\n"
    ",(deg),(deg),(m),(m/s),(m/s),(m/s),(m),(m),(m/s),(deg),(deg),,\n"
    "2024-05-06T10:00:00.00Z,47.5,-122.25,100.5,3.00,4.00,-2.00,1.5,2.5,0.25,53.13,2.0,3,9\n"
)
OPENSKY = (
    "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,alert,spi,squawk,baroaltitude,geoaltitude,"
    "lastposupdate,lastcontact\n"
    "1714989600,4b1814,47.5,8.25,100,90,-2.5,SWR1  ,False,False,False,1000,1000,1100.5,1714989599.5,1714989599.9\n"
    "1714989600,3c6444,48.5,9.25,,NaN,,,False,False,False,,,,1714989590,1714989599.9\n"
)
DYNON = (
    "Session Time,GPS Fix Quality,Number of Satellites,GPS Date & Time,Latitude (deg),Longitude (deg),"
    "GPS Altitude (feet),Ground Speed (knots),Ground Track (deg),Mag Var (deg),System Time,Pitch (deg),Roll (deg),"
    "Magnetic Heading (deg),Indicated Airspeed (knots),Pressure Altitude (ft),True Airspeed (knots)\n"
) + "".join(
    f"{500 + k / 4},2,9,2024-05-06 10:00:0{k // 4},27.1,-82.4,1000,100,90,,10:00:00,1.5,-2.5,85,90,950,95\n"
    for k in range(20)
)
AVIDYNE = (
    "Avidyne Engine Data Log; DAU Software ID: 5.0\n5/6/24 09:59:58\n"
    '"TIME","LAT","LON","PALT","DALT","E1","OAT"\n10:00:00,47.5,-122.25,1000,1100,1006,12\n'
    "10:00:01,-0.0000,-0.0000,1000,1100,1006,12\n"
)
BETAFLIGHT = (
    "loopIteration, time (us), gyroADC[0], amperageLatest (A), GPS_numSat, GPS_coord[0], GPS_coord[1], GPS_altitude, "
    "GPS_speed (m/s), GPS_ground_course\n0, 2500000, 7, 15.2, 12, 47.5000000, -122.2500000, 120, 10.50, 90.0\n"
)
EDGETX = (
    "Date,Time,1RSS(dB),RQly(%),GPS,GSpd(kmh),Hdg(°),Alt(m),Sats,Curr(A),Rud,Ele,Thr,Ail,SA,LSW,CH1(us),TxBat(V)\n"
    "2024-05-06,10:00:00.000,-70,100,47.500000 -122.250000,36.0,90,20,12,5.5,0,0,-1024,0,-1,0x0,1500,7.9\n"
)
OPENTX = (
    "Date,Time,GPS,GSpd(f/s),Hdg(@),Curr(mA),Sei,H\u00f6h,Gas,Que,SA,LSW,TxBat(V)\n"
    "2024-05-06,10:00:00.000,47.500000 -122.250000,100.0,90,550,0,0,-1024,0,-1,0x0,7.9\n"
    "2024-05-06,10:00:00.100,,100.0,90,550,0,0,-1024,0,-1,0x0,7.9\n"
)
KITTI = (
    "2024-05-06 10:00:00.000000000 49.0 8.4 116.5 0.1 0.05 0.5235987755982988 3 4 5 0 0.5 0.1 0.2 9.8 0.1 0.2 9.8 "
    "0.01 0.02 0.03 0.01 0.02 0.03 0.1 0.05 4 8 4 4 0\n"
)
TUM = "# timestamp tx ty tz qx qy qz qw\n1714989600.0 1.5 2.5 3.5 0 0 0.7071067811865476 0.7071067811865476\n"
WAYPOINT = (
    "Project:     line 7\nProgram:     Inertial Explorer Version 8.90.6611\nDatum:       WGS84\n\n"
    " Week    GPSTime       Latitude      Longitude    H-Ell    VUp  SDEast SDNorth    HdngSD Q\n"
    "           (sec)          (deg)          (deg)      (ft)  (m/s)     (m)     (m)     (deg)\n"
    " 2313 122418.000  47.5000000000 -0.2500000000    100.0    2.0   0.030   0.040    0.0500 1\n"
)
CASES = (
    Case(
        "flysight",
        FLYSIGHT,
        {
            "gnss.latitude_deg": 47.5,
            "gnss.longitude_deg": -122.25,
            "gnss.altitude_msl_m": 100.5,
            "gnss.velocity_north_mps": 3.0,
            "gnss.velocity_east_mps": 4.0,
            "gnss.velocity_down_mps": -2.0,
            "gnss.horizontal_sigma_m": 1.5,
            "gnss.vertical_sigma_m": 2.5,
            "gnss.velocity_sigma_mps": 0.25,
            "gnss.track_deg": 53.13,
            "gnss.fix": "3d",
            "gnss.satellites_used": 9.0,
        },
    ),
    Case(
        "opensky-states",
        OPENSKY,
        {"gnss.latitude_deg": 48.5, "gnss.longitude_deg": 9.25},  # the one that appears last is first
    ),
    Case(
        "dynon-skyview",
        DYNON,
        {
            "gnss.latitude_deg": 27.1,
            "gnss.altitude_msl_m": 304.8,
            "gnss.ground_speed_mps": 100 * MPS_PER_KT,
            "gnss.track_deg": 90.0,
            "gnss.velocity_east_mps": 100 * MPS_PER_KT,
            "gnss.fix": "dgnss",
            "gnss.satellites_used": 9.0,
            "ins.magnetic_heading_deg": 85.0,
            "ins.pitch_deg": 1.5,
            "ins.roll_deg": -2.5,
            "baro.pressure_altitude_m": 950 * 0.3048,
            "air.indicated_airspeed_mps": 90 * MPS_PER_KT,
            "air.true_airspeed_mps": 95 * MPS_PER_KT,
        },
        utc_ns=500_000_000_000,  # the counter; UTC is that of its zero
    ),
    Case(
        "avidyne-entegra",
        AVIDYNE,
        {"gnss.latitude_deg": 47.5, "gnss.longitude_deg": -122.25, "baro.pressure_altitude_m": 304.8},
    ),
    Case(
        "betaflight-blackbox",
        BETAFLIGHT,
        {
            "gnss.latitude_deg": 47.5,
            "gnss.longitude_deg": -122.25,
            "raw.blackbox.GPS_altitude": 120.0,
            "gnss.ground_speed_mps": 10.5,
            "gnss.track_deg": 90.0,
            "gnss.satellites_used": 12.0,
            "electric.current_a": 15.2,
            "raw.blackbox.gyroADC[0]": 7.0,
        },
        utc_ns=2_500_000_000,
    ),
    Case(
        "edgetx",
        EDGETX,
        {
            "gnss.latitude_deg": 47.5,
            "gnss.longitude_deg": -122.25,
            "gnss.ground_speed_mps": 10.0,
            "gnss.track_deg": 90.0,
            "gnss.velocity_east_mps": 10.0,
            "gnss.satellites_used": 12.0,
            "electric.current_a": 5.5,
            "raw.edgetx.Alt(m)": 20.0,
        },
    ),
    Case(
        "edgetx",
        OPENTX,
        {
            "gnss.longitude_deg": -122.25,
            "gnss.ground_speed_mps": 30.48,
            "gnss.track_deg": 90.0,
            "electric.current_a": 0.55,
        },
    ),
    Case(
        "kitti-oxts",
        KITTI,
        {
            "ins.latitude_deg": 49.0,
            "ins.altitude_msl_m": 116.5,
            "ins.roll_deg": 5.729577951308232,
            "ins.pitch_deg": -2.864788975654116,
            "ins.true_heading_deg": 60.0,
            "ins.velocity_north_mps": 3.0,
            "ins.velocity_down_mps": -0.5,
            "ins.accel_y_mps2": -0.2,
            "ins.accel_z_mps2": -9.8,
            "ins.rate_y_dps": -1.1459155902616465,
            "ins.horizontal_sigma_m": 0.1,
        },
        profile="kitti-oxts",
    ),
    Case(
        "tum",
        TUM,
        {
            "ins.position_east_m": 1.5,
            "ins.position_north_m": 2.5,
            "ins.position_down_m": -3.5,
            "ins.roll_deg": 0.0,
            "ins.pitch_deg": 0.0,
            "ins.true_heading_deg": 0.0,
        },
    ),
    Case("tum", TUM.split("\n", 1)[1], {"ins.position_east_m": 1.5}, profile="tum"),
    Case(
        "inertial-explorer",
        WAYPOINT,
        {
            "ins.latitude_deg": 47.5,
            "ins.longitude_deg": -0.25,
            "ins.altitude_ellipsoid_m": 30.48,
            "ins.velocity_down_mps": -2.0,
            "ins.horizontal_sigma_m": 0.05,
            "ins.true_heading_sigma_deg": 0.05,
            "raw.inertial_explorer.Q": 1.0,
        },
    ),
)


@pytest.mark.parametrize("case", CASES, ids=[f"{case.name} {number}" for number, case in enumerate(CASES)])
def test_every_value_comes_in_its_unit(tmp_path: Path, case: Case) -> None:
    path = tmp_path / "log.txt"
    path.write_text(case.text, encoding="utf-8")
    profile = Path(case.profile) if case.profile else None
    found = Read(path, profile)
    assert found.header.reader == f"csv-profile {case.name}"
    assert registry.identify(path, profile).detail == case.name
    for target, value in case.values.items():
        topic, _, field = target.rpartition(".")
        first = found.values(topic, field)[0]
        assert first == (value if isinstance(value, str) else pytest.approx(value, abs=1e-9)), target
        assert found.times(topic)[0] == case.utc_ns, target
    assert not [one for one in found.damages if one.loses_data]


def test_aircraft_of_opensky_are_logs_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "states.csv"
    path.write_text(OPENSKY)
    found = Read(path)
    assert found.header.metadata["aircraft"] == "3c6444"
    assert (
        found.values("gnss", "velocity_down_mps")[-1] == 2.5 and found.values("gnss", "velocity_east_mps")[-1] == 100.0
    )
    assert found.values("gnss", "altitude_ellipsoid_m")[-1] == 1100.5
    assert found.values("baro", "pressure_altitude_m") == [1000.0]


def test_utc_of_a_skyview_is_that_of_its_counter(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(DYNON)
    assert Read(path).header.utc_of_zero_ns == UTC - 500_000_000_000


def test_an_avidyne_without_a_fix_has_no_place(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(AVIDYNE)
    assert Read(path).damage("no_position").count == 1


@pytest.mark.parametrize("name", ["e6_inertial_explorer.txt", "e3_g5.csv"])
def test_made_cases_of_two_makers_agree(name: str) -> None:
    """An aircraft that goes east at 12 m/s from 47 N, 122 W, 91.44 m above the ellipsoid, at 10:00 UTC."""
    found = Read(real_log(f"cases/{name}"))
    topic = "ins" if "explorer" in name else "gnss"
    assert found.times(topic)[:2] == [UTC, UTC + 1_000_000_000] and len(found.times(topic)) == 400
    assert found.values(topic, "latitude_deg")[-1] == pytest.approx(47.0, abs=1e-7)
    assert found.values(topic, "longitude_deg")[1] == pytest.approx(-121.9998418, abs=1e-6)
    assert found.values(topic, "altitude_ellipsoid_m")[0] == pytest.approx(91.44)
    assert found.values(topic, "velocity_east_mps")[0] == pytest.approx(12.0)
    attitude = ("true_heading_deg", "pitch_deg", "roll_deg")
    assert [found.values("ins", field)[0] for field in attitude] == pytest.approx([90.0, 1.5, 0.5])
