"""One simulated flight as flat CSV, PX4 ULog, ArduPilot DataFlash, Chapter 10, bag, tlog, UBX, NMEA, NovAtel, .pos and
SBET gives equal tables, and equal answers where the format has what they need.

Each signal agrees within the step that the format stores it in (``RESOLUTION``); the heading error within what those
steps can move it.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.timescales import GPS_EPOCH_NS, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers.sbet import RECORD
from groundstation.simulation.chapter10_buses import WORD_TIME_NS
from groundstation.simulation.chapter10_writer import write_chapter10
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.scenario import load_scenario
from groundstation.systems.heading.analysis import HEADING
from groundstation.systems.heading.answer import HeadingResult
from groundstation.tables.table import Flight
from tests.readers.bag_writer import Messages, enu_quaternion_xyzw, write_ros2
from tests.readers.dataflash_writer import DataFlash
from tests.readers.receiver_writer import nmea, novatel, pvt, rmc, ubx
from tests.readers.telemetry_writer import Telemetry
from tests.readers.trajectory_writer import pos_rows
from tests.readers.ulog_writer import ATTITUDE, GPS, GPS_CODE, UlogWriter

BOOT_US = 5_000_000  # both autopilots have run for five seconds when the log begins
GPS_UTC_LEAP_NS = 18 * NS_PER_S
LOCAL = (
    "vehicle_local_position:uint64_t timestamp;float vx;float vy;float vz;bool v_xy_valid;bool v_z_valid;"
    "uint8_t[2] _padding0;"
)
LANDED = "vehicle_land_detected:uint64_t timestamp;bool landed;uint8_t[7] _padding0;"

# Largest difference to the flat CSV: half a stored step and a rounding, in the unit of the field.
FLOAT32 = 1.2e-7
HALF = 0.5 + 1e-6
KT_STEP_MPS = 0.125 * 0.514444  # of ARINC 429 speeds: 4096 kt in 15 bits
RESOLUTION: Mapping[str, Mapping[str, float]] = {
    "ulog": {
        "ins.true_heading_deg": 2e-5,
        "ins.roll_deg": 2e-5,
        "ins.pitch_deg": 2e-5,
        "ins.velocity_north_mps": 100 * FLOAT32,
        "ins.velocity_east_mps": 100 * FLOAT32,
        "gnss.velocity_north_mps": 100 * FLOAT32,
        "gnss.velocity_east_mps": 100 * FLOAT32,
        "gnss.latitude_deg": 0.51e-7,
        "gnss.longitude_deg": 0.51e-7,
        "gnss.altitude_msl_m": 0.51e-3,
    },
    "dataflash": {
        "ins.true_heading_deg": 0.0051,
        "ins.roll_deg": 0.0051,
        "ins.pitch_deg": 0.0051,
        "gnss.ground_speed_mps": 100 * FLOAT32,
        "gnss.velocity_north_mps": 100 * FLOAT32,
        "gnss.velocity_east_mps": 100 * FLOAT32,
        "gnss.latitude_deg": 0.51e-7,
        "gnss.longitude_deg": 0.51e-7,
        "gnss.altitude_msl_m": 0.0051,
    },
    "ubx": {
        "ins.true_heading_deg": 0.51e-5,
        "ins.roll_deg": 0.51e-5,
        "gnss.velocity_north_mps": 0.51e-3,
        "gnss.velocity_east_mps": 0.51e-3,
        "gnss.latitude_deg": 0.51e-7,
        "gnss.longitude_deg": 0.51e-7,
        "gnss.altitude_ellipsoid_m": 0.51e-3,
    },
    "nmea": {
        "ins.true_heading_deg": 0.51e-4,
        "ins.pitch_deg": 0.51e-4,
        "gnss.velocity_north_mps": 1e-4,
        "gnss.velocity_east_mps": 1e-4,
        "gnss.latitude_deg": 0.51e-9,
        "gnss.longitude_deg": 0.51e-9,
        "gnss.altitude_ellipsoid_m": 0.51e-3,
    },
    "novatel": {
        "ins.true_heading_deg": 1e-9,
        "ins.velocity_north_mps": 1e-9,
        "gnss.velocity_east_mps": 1e-9,
        "gnss.latitude_deg": 1e-12,
        "gnss.altitude_ellipsoid_m": 1e-9,
    },
    "pos": {
        "gnss.velocity_north_mps": 0.51e-5,
        "gnss.latitude_deg": 0.51e-9,
        "gnss.longitude_deg": 0.51e-9,
        "gnss.altitude_ellipsoid_m": 0.51e-4,
    },
    "sbet": {
        "ins.true_heading_deg": 1e-9,
        "ins.pitch_deg": 1e-9,
        "ins.velocity_north_mps": 1e-9,
        "ins.velocity_east_mps": 1e-9,
    },
    "ros2": {
        **{f"ins.{name}": 1e-9 for name in ("true_heading_deg", "roll_deg", "pitch_deg")},
        **{f"{topic}.velocity_{axis}_mps": 1e-9 for topic in ("ins", "gnss") for axis in ("north", "east")},
        **{f"gnss.{name}": 1e-12 for name in ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m")},
    },
    "tlog": {
        "ins.true_heading_deg": 3e-5,
        "ins.roll_deg": 2e-5,
        "ins.pitch_deg": 2e-5,
        "ins.velocity_north_mps": 0.0051,
        "ins.velocity_east_mps": 0.0051,
        "gnss.ground_speed_mps": 0.0051,
        "gnss.latitude_deg": 0.51e-7,
        "gnss.longitude_deg": 0.51e-7,
        "gnss.altitude_msl_m": 0.51e-3,
    },
    "chapter10": {  # ins by 1553, all else by ARINC 429
        **dict.fromkeys(("ins.true_heading_deg", "ins.roll_deg", "ins.pitch_deg"), HALF * 180 / 2**15),
        **dict.fromkeys(("ins.velocity_north_mps", "ins.velocity_east_mps"), HALF * 0.3048 / 2**18),
        **dict.fromkeys(("gnss.velocity_north_mps", "gnss.velocity_east_mps"), HALF * KT_STEP_MPS),
        **dict.fromkeys(("gnss.latitude_deg", "gnss.longitude_deg"), HALF * 180 / 2**31),
        "gnss.altitude_ellipsoid_m": HALF * 0.3048 / 8,
        "baro.pressure_altitude_m": HALF * 0.3048,
        "air.true_airspeed_mps": HALF * KT_STEP_MPS / 2,
        "discrete.weight_on_wheels": 0.0,
    },
    "arinc429": {  # the same file read by the labels that are shipped
        "ins.true_heading_deg": HALF * 180 / 2**15,
        **dict.fromkeys(("ins.roll_deg", "ins.pitch_deg"), HALF * 180 / 2**14),
        **dict.fromkeys(("ins.velocity_north_mps", "ins.velocity_east_mps"), HALF * KT_STEP_MPS),
        **dict.fromkeys(("gnss.velocity_north_mps", "gnss.velocity_east_mps"), HALF * KT_STEP_MPS),
        **dict.fromkeys(("gnss.latitude_deg", "gnss.longitude_deg"), HALF * 180 / 2**31),
    },
}
# GPS time is told to 1 ms; the words of a sample follow each other on their bus, up to seven of them.
LATE_NS = {
    "ulog": 1_000_000,
    "dataflash": 1_000_000,
    "chapter10": 7 * WORD_TIME_NS,
    "arinc429": 7 * WORD_TIME_NS,
    "ros2": 1_000,
    "tlog": 1_000,
}
LATE_NS |= dict.fromkeys(("ubx", "nmea", "novatel", "pos", "sbet"), 1_000_000)
# Heading steps of 0.01 deg, and speed steps of 0.06 m/s, average out over a thousand samples;
# telemetry has velocities in steps of 0.01 m/s.
ANSWER_DEG = {"ulog": 1e-3, "dataflash": 3e-3, "chapter10": 1e-3, "arinc429": 1e-3, "ros2": 1e-6, "tlog": 1e-2}


@cache
def simulated() -> Simulated:
    return simulate(load_scenario("taxi-good"))


def as_csv(path: Path) -> None:
    flight = simulated()
    write_flat_csv(path, flight.flight, resolution=flight.resolution)


def columns(topic: str, *names: str) -> list[np.ndarray]:
    """Columns as the CSV holds them: time in microseconds of the autopilot's clock, then the fields."""
    flight = simulated()
    table = flight.flight[topic]
    time_us = BOOT_US + (table.time_ns - flight.flight.start_ns) // 1000
    rounded = []
    for name in names:
        step = flight.resolution.get(f"{topic}.{name}", 0.0)
        values = table.values(name)
        rounded.append(np.round(values / step) * step if step else values)
    return [time_us, *rounded]


def quaternion_wxyz(roll_deg: float, pitch_deg: float, heading_deg: float) -> tuple[float, float, float, float]:
    half = np.deg2rad([roll_deg, pitch_deg, heading_deg]) / 2
    (cr, cp, ch), (sr, sp, sh) = np.cos(half), np.sin(half)
    return (
        cr * cp * ch + sr * sp * sh,
        sr * cp * ch - cr * sp * sh,
        cr * sp * ch + sr * cp * sh,
        cr * cp * sh - sr * sp * ch,
    )


def start_utc_ns() -> int:
    return simulated().flight.start_ns


def as_ulog(path: Path) -> None:
    log = UlogWriter(start_us=BOOT_US).flags().format(ATTITUDE).format(GPS).format(LOCAL).format(LANDED)
    for number, name in enumerate(("vehicle_attitude", "vehicle_gps_position", "vehicle_local_position")):
        log.subscribe(number, name)
    log.subscribe(3, "vehicle_land_detected")
    rows: list[tuple[int, int, str, tuple[float, ...]]] = []
    for time_us, roll, pitch, heading in zip(*columns("ins", "roll_deg", "pitch_deg", "true_heading_deg"), strict=True):
        rows.append((int(time_us), 0, "Q4f", quaternion_wxyz(roll, pitch, heading)))
    for time_us, north, east in zip(*columns("ins", "velocity_north_mps", "velocity_east_mps"), strict=True):
        rows.append((int(time_us), 2, "Q3fBB", (north, east, 0.0, 1, 1)))
    fields = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps")
    for time_us, lat, lon, alt, north, east in zip(*columns("gnss", *fields), strict=True):
        utc_us = (start_utc_ns() // 1000) + int(time_us) - BOOT_US
        place = (round(lat * 1e7), round(lon * 1e7), round(alt * 1e3), 0)
        rest = (0.05, 1.0, float(np.hypot(north, east)), north, east, 0.0, 0.0, 3, 1, 12)
        rows.append((int(time_us), 1, GPS_CODE, (utc_us, *place, *rest)))
    for time_us, wheels in zip(*columns("discrete", "weight_on_wheels"), strict=True):
        rows.append((int(time_us), 3, "QB", (int(wheels),)))
    for time_us, number, code, values in sorted(rows, key=lambda row: row[:2]):
        log.row(number, code, time_us, *values)
    path.write_bytes(log.data)


def as_dataflash(path: Path) -> None:
    log = DataFlash()
    log.define(1, "PARM", "QNf", "TimeUS,Name,Value")
    log.define(5, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw")
    log.define(8, "GPS", "QBIHBcLLefff", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ")
    log.write("PARM", BOOT_US - 1, "COMPASS_AUTODEC", 1.0)
    rows: list[tuple[int, str, tuple[float, ...]]] = []
    for time_us, roll, pitch, heading in zip(*columns("ins", "roll_deg", "pitch_deg", "true_heading_deg"), strict=True):
        stored = (0, round(roll * 100), 0, round(pitch * 100), 0, round(heading * 100) % 36000)
        rows.append((int(time_us), "ATT", stored))
    fields = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps")
    for time_us, lat, lon, alt, north, east in zip(*columns("gnss", *fields), strict=True):
        since_gps_ns = start_utc_ns() + (int(time_us) - BOOT_US) * 1000 - GPS_EPOCH_NS + GPS_UTC_LEAP_NS
        week, rest_ns = divmod(since_gps_ns, 604_800 * NS_PER_S)
        course = float(np.rad2deg(np.arctan2(east, north)) % 360.0)
        place = (round(lat * 1e7), round(lon * 1e7), round(alt * 100))
        speed = float(np.hypot(north, east))
        rows.append((int(time_us), "GPS", (3, rest_ns // 1_000_000, week, 12, 100, *place, speed, course, 0.0)))
    for time_us, name, values in sorted(rows, key=lambda row: row[:2]):
        log.write(name, time_us, *values)
    path.write_bytes(log.content)


PLACE = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m")
MOTION = ("velocity_north_mps", "velocity_east_mps")
ATTITUDE_FIELDS = ("roll_deg", "pitch_deg", "true_heading_deg")


def timed(topic: str, *names: str) -> list[tuple[int, tuple[float, ...]]]:
    """Rows of a topic: UTC nanoseconds and values."""
    time_us, *values = columns(topic, *names)
    utc_ns = start_utc_ns() + (time_us - BOOT_US) * 1000
    return [(int(at), tuple(row)) for at, *row in zip(utc_ns.tolist(), *(one.tolist() for one in values), strict=True)]


def week_ms(utc_ns: int) -> int:
    return (utc_ns - GPS_EPOCH_NS + GPS_UTC_LEAP_NS + 500_000) // 1_000_000 % 604_800_000


def hhmmss(utc_ns: int) -> str:
    return utc_ns_to_iso(utc_ns)[11:23].replace(":", "")


def in_order(path: Path, rows: list[tuple[int, bytes]]) -> None:
    path.write_bytes(b"".join(content for _utc_ns, content in sorted(rows, key=lambda row: row[0])))


def as_ubx(path: Path) -> None:
    rows = []
    for at, (lat, lon, height, north, east) in timed("gnss", *PLACE, *MOTION):
        place = {"lat": round(lat * 1e7), "lon": round(lon * 1e7), "height": round(height * 1e3)}
        motion = {"velN": round(north * 1e3), "velE": round(east * 1e3)}
        second = utc_ns_to_iso(at // NS_PER_S * NS_PER_S, 0)
        rows.append((at, pvt(second, at % NS_PER_S, week_ms(at), **place, **motion)))
    for at, angles in timed("ins", *ATTITUDE_FIELDS):
        roll, pitch, heading = (round(angle * 1e5) for angle in angles)
        known = {"accRoll": 1, "accPitch": 1, "accHeading": 1}
        rows.append((at, ubx("NAV-ATT", iTOW=week_ms(at), roll=roll, pitch=pitch, heading=heading, **known)))
    in_order(path, rows)


def minutes(degrees: float, letters: str) -> str:
    size = abs(degrees)
    return f"{int(size):03d}{size % 1 * 60:012.9f},{letters[degrees < 0]}"


def as_nmea(path: Path) -> None:
    rows = []
    for at, (lat, lon, height, north, east) in timed("gnss", *PLACE, *MOTION):
        track = float(np.rad2deg(np.arctan2(east, north)) % 360.0)
        date = utc_ns_to_iso(at)
        gga = f"GNGGA,{hhmmss(at)},{minutes(lat, 'NS')},{minutes(lon, 'EW')},1,12,0.80,{height:.3f},M,0.0,M,,"
        moved = rmc(hhmmss(at), date[8:10] + date[5:7] + date[2:4], float(np.hypot(north, east)), track)
        rows.append((at, nmea(gga) + moved))
    for at, (roll, pitch, heading) in timed("ins", *ATTITUDE_FIELDS):
        text = f"PASHR,{hhmmss(at)},{heading:.4f},T,{roll:.4f},{pitch:.4f},0.00,0.1,0.1,0.1,2,1"
        rows.append((at, nmea(text)))
    in_order(path, rows)


def as_novatel(path: Path) -> None:
    rows = []
    for at, (lat, lon, height, north, east) in timed("gnss", *PLACE, *MOTION):
        track = float(np.rad2deg(np.arctan2(east, north)) % 360.0)
        place = {"latitude": lat, "longitude": lon, "orthometric_height": height, "position_type": 50}
        moved = {"horizontal_speed": float(np.hypot(north, east)), "ground_track": track}
        both = novatel("BESTPOS", at, **place) + novatel("BESTVEL", at, **moved)
        rows.append((at, both))
    for at, (roll, pitch, heading, north, east) in timed("ins", *ATTITUDE_FIELDS, *MOTION):
        since_s = ((at - GPS_EPOCH_NS + GPS_UTC_LEAP_NS) % (604_800 * NS_PER_S)) / 1e9
        angles = {"roll": roll, "pitch": pitch, "azimuth": heading, "north_vel": north, "east_vel": east}
        week = (at - GPS_EPOCH_NS + GPS_UTC_LEAP_NS) // (604_800 * NS_PER_S)
        rows.append((at, novatel("INSPVA", at, week=week, seconds=since_s, ins_solution_status=3, **angles)))
    in_order(path, rows)


def as_pos(path: Path) -> None:
    rows = []
    for at, (lat, lon, height, north, east) in timed("gnss", *PLACE, *MOTION):
        time = utc_ns_to_iso(at + GPS_UTC_LEAP_NS).replace("-", "/").replace("T", " ").rstrip("Z")
        place = f"{lat:.9f} {lon:.9f} {height:.4f} 1 12 .1 .1 .1 .0 .0 .0 0.0 9.9"
        rows.append(f"{time}  {place} {north:.5f} {east:.5f} 0.0 .1 .1 .1 .0 .0 .0")
    path.write_bytes(pos_rows(rows))


def as_sbet(path: Path) -> None:
    known = timed("ins", *ATTITUDE_FIELDS, *MOTION)
    records = np.zeros(len(known), RECORD)
    utc_ns = np.array([at for at, _values in known])
    records["time"] = ((utc_ns - GPS_EPOCH_NS + GPS_UTC_LEAP_NS) % (604_800 * NS_PER_S)) / 1e9
    names = ("roll", "pitch", "platform_heading", "x_velocity", "y_velocity")
    for name, values in zip(names, np.array([values for _at, values in known]).T, strict=True):
        records[name] = values if "velocity" in name else np.deg2rad(values)
    records["latitude"], records["longitude"] = np.deg2rad(55.0), np.deg2rad(37.0)
    path.write_bytes(records.tobytes())


def as_ros2(path: Path) -> None:
    messages = Messages()
    start_ns = start_utc_ns() - BOOT_US * 1_000
    fields = ("roll_deg", "pitch_deg", "true_heading_deg", "velocity_north_mps", "velocity_east_mps")
    for time_us, *angles, north, east in zip(*columns("ins", *fields), strict=True):
        stamp_ns, quaternion = start_ns + int(time_us) * 1_000, enu_quaternion_xyzw(*angles)
        messages.imu("/nav/imu", stamp_ns, quaternion)
        messages.twist("/nav/velocity", stamp_ns, (east, north, np.nan))
    fields = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps")
    for time_us, lat, lon, alt, north, east in zip(*columns("gnss", *fields), strict=True):
        stamp_ns = start_ns + int(time_us) * 1_000
        messages.fix("/gps/fix", stamp_ns, (lat, lon, alt))
        messages.twist("/gps/velocity", stamp_ns, (east, north, np.nan))
    write_ros2(path, messages)


def as_tlog(path: Path) -> None:
    log, start_us = Telemetry(), start_utc_ns() // 1_000 - BOOT_US
    rows: list[tuple[int, str, tuple[float, ...]]] = []
    for time_us, *angles in zip(*columns("ins", "roll_deg", "pitch_deg", "true_heading_deg"), strict=True):
        rows.append((int(time_us), "attitude", (0, *np.deg2rad(angles), 0.0, 0.0, 0.0)))
    for time_us, north, east in zip(*columns("ins", "velocity_north_mps", "velocity_east_mps"), strict=True):
        velocity = (round(north * 100), round(east * 100), 0)
        rows.append((int(time_us), "global_position_int", (0, 1, 1, 0, 0, *velocity, 0)))
    fields = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "velocity_north_mps", "velocity_east_mps")
    for time_us, lat, lon, alt, north, east in zip(*columns("gnss", *fields), strict=True):
        course = round(float(np.rad2deg(np.arctan2(east, north)) % 360.0) * 100) % 36_000
        place = (round(lat * 1e7), round(lon * 1e7), round(alt * 1e3))
        fix = (0, 3, *place, 100, 100, round(float(np.hypot(north, east)) * 100), course, 12)
        rows.append((int(time_us), "gps_raw_int", fix))
    for time_us, name, values in sorted(rows, key=lambda row: row[:2]):
        log.add(name, *values, time_us=start_us + time_us)
    path.write_bytes(log.data)


def as_chapter10(path: Path) -> None:
    write_chapter10(path, simulated().flight)


WRITERS = {
    "csv": (as_csv, "x.csv"),
    "ulog": (as_ulog, "x.ulg"),
    "dataflash": (as_dataflash, "x.BIN"),
    "ros2": (as_ros2, "bag"),
    "tlog": (as_tlog, "x.tlog"),
    "chapter10": (as_chapter10, "x.ch10"),
    "arinc429": (as_chapter10, "y.ch10"),
}
WRITERS |= {"ubx": (as_ubx, "x.ubx"), "nmea": (as_nmea, "x.nmea"), "novatel": (as_novatel, "x.gps")}
WRITERS |= {"pos": (as_pos, "x.pos"), "sbet": (as_sbet, "sbet_{day}.out")}
ICDS = {"chapter10": ("x.icd.yaml",), "arinc429": ("arinc429_inertial", "arinc429_gnss")}


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Flight]:
    folder = tmp_path_factory.mktemp("formats")
    found = {}
    day = utc_ns_to_iso(start_utc_ns())[:10].replace("-", "")
    for name, (write, pattern) in WRITERS.items():
        file_name = pattern.format(day=day)
        write(folder / file_name)
        mcap = folder / f"{name}.mcap"
        icds = tuple(str(folder / icd) if icd.endswith(".yaml") else icd for icd in ICDS.get(name, ()))
        found[name] = read_flight(mcap, convert_log(open_log(folder / file_name, icds=icds), mcap))
    return found


@pytest.mark.parametrize(
    ("form", "signal"), [(form, signal) for form, signals in RESOLUTION.items() for signal in signals]
)
def test_tables_are_equal_within_the_formats_step(flights: dict[str, Flight], form: str, signal: str) -> None:
    topic, field = signal.rsplit(".", 1)
    expected_table, table = flights["csv"][topic], flights[form][topic]
    if field == "ground_speed_mps":
        expected = np.hypot(expected_table.values("velocity_north_mps"), expected_table.values("velocity_east_mps"))
    elif field == "altitude_msl_m":  # the simulation has no geoid: the autopilots are given the one altitude it has
        expected = expected_table.values("altitude_ellipsoid_m")
    else:
        expected = expected_table.values(field)
    known = np.isfinite(table.values(field))
    values, time_ns = table.values(field)[known], table.time_ns[known]
    assert len(values) == np.isfinite(expected).sum()
    assert np.abs(time_ns - expected_table.time_ns[np.isfinite(expected)]).max() <= LATE_NS[form]
    difference = values - expected[np.isfinite(expected)]
    if field.endswith("heading_deg"):
        difference = wrap_180(difference)
    assert np.abs(difference).max() <= RESOLUTION[form][signal]


def heading_of(flight: Flight) -> HeadingResult:
    found = run_analyses((HEADING,), flight, known_of(flight, Configuration())).answers["heading"]
    assert isinstance(found, HeadingResult)
    return found


@pytest.fixture(scope="module")
def expected(flights: dict[str, Flight]) -> HeadingResult:
    return heading_of(flights["csv"])


@pytest.mark.parametrize("form", sorted(ANSWER_DEG))
def test_the_heading_error_is_the_same(flights: dict[str, Flight], expected: HeadingResult, form: str) -> None:
    found = heading_of(flights[form])
    assert found.paper_error_deg == pytest.approx(expected.paper_error_deg, abs=10 * ANSWER_DEG[form])
    assert found.confidence95_deg[0] < expected.error_deg < found.confidence95_deg[1]


def test_every_format_has_the_same_absolute_time(flights: dict[str, Flight]) -> None:
    starts = {form: flight["gnss"].time_ns[0] for form, flight in flights.items() if "gnss" in flight.topics()}
    assert all(flight.has_utc for flight in flights.values())
    assert max(starts.values()) - min(starts.values()) <= max(LATE_NS.values())
