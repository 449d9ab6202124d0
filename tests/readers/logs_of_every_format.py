"""A small log of every format, with the raw fields whose canonical ones are held against them.

Values differ from row to row and from field to field, so that none stands for another.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from tests.readers.bag_writer import small_flight as small_bag
from tests.readers.bag_writer import write_ros1
from tests.readers.dataflash_writer import DataFlash, flight_log
from tests.readers.flightdata_writer import write_flightdata
from tests.readers.logged_facts import BAGS, DATAFLASH, HDF5, NMEA, NOVATEL, POS, SBET, TLOG, UBX, ULOG, Fact
from tests.readers.receiver_writer import nmea, novatel, pvt, rmc, ubx, week_ms
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.readers.trajectory_writer import pos_rows
from tests.readers.trajectory_writer import sbet as sbet_records
from tests.readers.ulog_writer import ATTITUDE, GPS, GPS_CODE, UlogWriter

ROWS = 24
RNG_SEED = 7


def numbers(rng: np.random.Generator, count: int, low: float = -40.0, high: float = 40.0) -> list[float]:
    return rng.uniform(low, high, count).tolist()


def write_dataflash(path: Path) -> int:
    log, rng = flight_log(), np.random.default_rng(RNG_SEED)
    log.define(20, "BAT", "QBff", "TimeUS,Instance,Volt,Curr")
    log.define(21, "RFND", "QBCBB", "TimeUS,Instance,Dist,Stat,Orient")
    log.define(22, "XKF2", "QBcc", "TimeUS,C,VWN,VWE")
    log.write("UNIT", 0, ord("S"), "satellites")
    log.units("GPS", "s#-s-S-DUmnhnh-", "F--C-0BGGB000--")  # of today's firmware
    log.units("BAT", "s#vA", "F-00")
    log.units("RFND", "s#m--", "F-B--")
    log.units("XKF2", "s#nn", "F-BB")
    for at in range(ROWS):
        log.write("BAT", 1_100_000 + at, 0, *numbers(rng, 2, 0.0))
        log.write("RFND", 1_100_000 + at, 0, int(rng.integers(1, 9_000)), 4, 25)
        log.write("XKF2", 1_100_000 + at, 1, *rng.integers(-900, 900, 2).tolist())
    path.write_bytes(log.content)
    records = [at for at, name in enumerate(log.names) if name not in ("FMT", "FMTU", "UNIT", "MULT", "PARM")]
    return log.starts()[records[0]]


def write_old_dataflash(path: Path) -> int:
    log, rng = DataFlash(), np.random.default_rng(RNG_SEED)
    log.define(1, "GPS", "BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T")
    log.define(2, "ATT", "IhhH", "TimeMS,Roll,Pitch,Yaw")
    log.define(3, "MAG", "Ihhh", "TimeMS,MagX,MagY,MagZ")
    log.define(4, "CURR", "IhhhhH", "TimeMS,Thr,Volt,Curr,Vcc,CurrTot")
    head = len(log.content)
    for at in range(ROWS):
        roll, pitch, x, y, z, current, vertical = rng.integers(-900, 900, 7).tolist()
        log.write("ATT", 1000 + 100 * at, roll, pitch, at * 1400)
        log.write("MAG", 1000 + 100 * at, x, y, z)
        log.write("CURR", 1000 + 100 * at, 0, 1251, current, 0, 0)
        place = (7 + at % 5, 199 + at, 550_000_000 + roll, 370_000_000 + pitch)
        motion = (0, 1578 + x, 203 + at, at * 1400, vertical / 100, 1010 + 100 * at)
        log.write("GPS", 3, 511_214_500 + 100 * at, 1768, *place, *motion)
    path.write_bytes(log.content)
    return head


COMBINED = "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;"
MAGNETOMETER = "vehicle_magnetometer:uint64_t timestamp;float[3] magnetometer_ga;"
LOCAL = "vehicle_local_position:uint64_t timestamp;float vx;float vy;float vz;"
GLOBAL = "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;"
BATTERY = "battery_status:uint64_t timestamp;float current_a;"
ULOG_TOPICS = {
    ATTITUDE: "4f",
    GPS: GPS_CODE[1:],
    COMBINED: "6f",
    MAGNETOMETER: "3f",
    LOCAL: "3f",
    GLOBAL: "ddf",
    BATTERY: "f",
}


def write_ulog(path: Path) -> int:
    log, rng = UlogWriter().flags(), np.random.default_rng(RNG_SEED)
    for text in ULOG_TOPICS:
        log.format(text)
    for number, text in enumerate(ULOG_TOPICS):
        log.subscribe(number, text.partition(":")[0])
    head = len(log.data)
    for at in range(ROWS):
        time_us = 1_000_000 + 20_000 * at
        fix = (
            1_714_989_600_000_000 + 20_000 * at,
            *rng.integers(10**8, 5 * 10**8, 2).tolist(),
            150_000 + at,
            190_000 + at,
        )
        fix += (*numbers(rng, 3, 0.1, 9.0), *numbers(rng, 3), at / 4, 3, 1, 8 + at % 9)
        values = {ATTITUDE: (1.0, 0.0, 0.0, 0.0), GPS: fix, GLOBAL: numbers(rng, 3)}
        for number, (text, code) in enumerate(ULOG_TOPICS.items()):
            count = int(code[0]) if code[0].isdecimal() else len(code)
            log.row(number, "Q" + code, time_us + number, *values.get(text, numbers(rng, count)))
    path.write_bytes(log.data)
    return head


def write_tlog(path: Path) -> int:
    log, rng = Telemetry(), np.random.default_rng(RNG_SEED)
    for at in range(ROWS):
        time_us = START_US + at * 100_000
        log.add("attitude", 100 * at, *numbers(rng, 6, -3.0, 3.0), time_us=time_us)
        place = (*rng.integers(10**8, 5 * 10**8, 2).tolist(), 150_000 + at)
        fix = (3, *place, 120 + at, 65_535, 500 + at, 1_400 * at, 8 + at % 9, 190_000 + at, 0, 0, 300 + at)
        log.add("gps_raw_int", at, *fix, time_us=time_us + 1_000)
        log.add(
            "global_position_int",
            100 * at + 20,
            *place,
            0,
            *rng.integers(-900, 900, 3).tolist(),
            0,
            time_us=time_us + 2_000,
        )
        log.add("raw_imu", at, *rng.integers(-900, 900, 9).tolist(), time_us=time_us + 3_000)
        log.add("sys_status", 0, 0, 0, 0, 12_000, 100 + at, 80, *[0] * 6, time_us=time_us + 4_000)
    path.write_bytes(bytes(log.data))
    return 0


def write_ubx(path: Path) -> int:
    content, rng = b"", np.random.default_rng(RNG_SEED)
    for at in range(ROWS):
        utc = f"2026-05-04T12:00:{at:02d}Z"
        velocity = dict(zip(("velN", "velE", "velD"), rng.integers(-9_000, 9_000, 3).tolist(), strict=True))
        place = {"lat": 515_000_000 + at, "lon": -7_000_000 - at, "height": 147_000 + at, "hMSL": 100_000 - at}
        quality = {
            "hAcc": 100 + at,
            "vAcc": 200 + at,
            "sAcc": 300 + at,
            "gSpeed": 5_000 + at,
            "headMot": 1_234_567 * at,
        }
        content += pvt(utc, **place, **velocity, **quality, numSV=9 + at % 9, pDOP=120 + at)
        content += ubx("NAV-DOP", iTOW=week_ms(utc), gDOP=150 + at, pDOP=120 + at, hDOP=80 + at)
        angles = {"roll": 100_000 * at, "pitch": -50_000 * at, "heading": 1_400_000 * at}
        content += ubx("NAV-ATT", iTOW=week_ms(utc), **angles, accRoll=1, accPitch=1, accHeading=1)
    path.write_bytes(content)
    return 0


def write_nmea(path: Path) -> int:
    content = b""
    for at in range(ROWS):
        time = f"1200{at:02d}.50"
        minutes = f"51{at:02d}.{1_234 * at:05d},N,000{at:02d}.{4_321 * at % 100_000:05d},W"
        content += nmea(f"GNGGA,{time},{minutes},1,{4 + at % 12:02d},{0.5 + at / 10:.2f},{100 + at / 8:.3f},M,47.0,M,,")
        content += rmc(time, "040526", at / 3, 14.0 * at)
        content += nmea(f"PASHR,{time},{13.5 * at:.3f},T,{-1.25 + at / 10:.2f},{2.5 - at / 10:.2f},0.1,.1,.1,.2,2,1")
    path.write_bytes(content)
    return 0


def write_novatel(path: Path) -> int:
    content, rng = b"", np.random.default_rng(RNG_SEED)
    for at in range(ROWS):
        place = dict(zip(("latitude", "longitude", "height"), numbers(rng, 3), strict=True))
        fix = {"latitude": place["latitude"], "longitude": place["longitude"], "orthometric_height": 99.5 + at}
        content += novatel("BESTPOS", 1_000 * at, **fix, height_std_dev=0.5 + at, num_soln_svs=8 + at, position_type=16)
        angles = dict(zip(("roll", "pitch", "azimuth"), (at - 9.5, 3.25 - at, 14.5 * at), strict=True))
        motion = dict(zip(("north_vel", "east_vel", "up_vel"), numbers(rng, 3), strict=True))
        content += novatel(
            "INSPVA", 1_000 * at, week=2417, seconds=1.0 * at, ins_solution_status=3, **place, **angles, **motion
        )
    path.write_bytes(content)
    return 0


def write_bag(path: Path) -> int:
    write_ros1(path, small_bag(is_ros1=True, rows=60))
    return 0


def write_pos(path: Path) -> int:
    rows, rng = [], np.random.default_rng(RNG_SEED)
    for at in range(ROWS):
        latitude, longitude, height, north, east, up = numbers(rng, 6)
        place = f"{latitude:.9f} {longitude:.9f} {height:.4f} 1 {9 + at} .1 .2 {0.3 + at:.3f} .0 .0 .0 0.0 9.9"
        rows.append(f"2025/08/28 17:30:{at + 10}.000 {place} {north:.5f} {east:.5f} {up:.5f} .1 .1 .1 .0 .0 .0")
    path.write_bytes(pos_rows(rows))
    return 600  # behind the header


def write_sbet(path: Path) -> int:
    path.write_bytes(sbet_records().tobytes())
    return 0


def write_hdf5(path: Path) -> int:
    def ramp(first: float, step: float, **told: object) -> dict[str, object]:
        return {"data": first + step * np.arange(ROWS), **told}

    parameters = {
        "Latitude": ramp(60.0, 0.001),
        "Heading": ramp(3.0, 14.0, offset=0.5),
        "Altitude Radio": ramp(10.0, 1.0),
        "Altitude STD": ramp(900.0, 25.0, units="ft"),
        "Airspeed": ramp(100.0, 3.0, units="kts"),
        "ILS Localizer": ramp(-1.0, 0.1),
    }
    write_flightdata(path, parameters)
    return 0


# Format -> file name, writer (which says where bytes may change), table, and fields of it that this log does not give.
WRITTEN: Mapping[str, tuple[str, Callable[[Path], int], list[Fact], set[str]]] = {
    "dataflash": ("x.BIN", write_dataflash, DATAFLASH, {"ins.magnetic_heading_deg"}),
    "old dataflash": ("y.BIN", write_old_dataflash, DATAFLASH, {"ins.magnetic_heading_deg"}),
    "ulog": ("x.ulg", write_ulog, ULOG, set()),
    "tlog": ("x.tlog", write_tlog, TLOG, set()),
    "ubx": ("x.ubx", write_ubx, UBX, set()),
    "nmea": ("x.nmea", write_nmea, NMEA, set()),
    "novatel": ("x.gps", write_novatel, NOVATEL, set()),
    "bag": ("x.bag", write_bag, BAGS, {"gnss.altitude_ellipsoid_m"}),  # NaN: none
    "pos": ("x.pos", write_pos, POS, set()),
    "sbet": ("sbet_20240506.out", write_sbet, SBET, set()),
    "hdf5": ("x.hdf5", write_hdf5, HDF5, {"ins.magnetic_heading_deg"}),  # brought to the times of the latitude
}
