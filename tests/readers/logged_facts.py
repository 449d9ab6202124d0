"""Factors between raw fields and canonical ones, format by format: stated from what the formats document.

Nothing here is taken from the readers. Presence, modes, derived and saturated values are not stated.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi

RAD, KNOT, FOOT, G, GAUSS = 180.0 / pi, 1852.0 / 3600.0, 0.3048, 9.80665, 1e5
CM, MM, E7 = 1e-2, 1e-3, 1e-7


@dataclass(frozen=True)
class Fact:
    """A raw column is a canonical field but for a factor.

    ``raw`` is a pattern of the raw topic. ``of_integers``: the factor where the column holds plain integers.
    ``shared``: the raw record is not the row's own but the one with the same value of this column. Values from
    ``below`` on may be saturated.
    """

    raw: str
    column: str
    kind: str
    field: str
    factor: float
    of_integers: float | None = None
    shared: str = ""
    below: float = inf


def facts(raw: str, kind: str, shared: str = "", **fields: tuple[str, float] | tuple[str, float, float]) -> list[Fact]:
    return [Fact(raw, one[0], kind, name, *one[1:], shared=shared) for name, one in fields.items()]


def axes(kind: str, raw: str, names: str, columns: str, factors: tuple[float, float, float]) -> list[Fact]:
    """Facts of three axes; ``names`` as ``rate_{}_dps/x y z``, the columns likewise."""
    (name, of_names), (column, of_columns) = names.split("/"), columns.split("/")
    pairs = zip(of_names.split(), of_columns.split(), factors, strict=True)
    return [Fact(raw, column.format(b), kind, name.format(a), factor) for a, b, factor in pairs]


NED, RATE, ACCEL = "velocity_{}_mps/north east down", "rate_{}_dps/x y z", "accel_{}_mps2/x y z"
FIELD = "field_{}_nt/forward right down"
FORWARD_LEFT_UP = (1.0, -1.0, -1.0)


def same(factor: float) -> tuple[float, float, float]:
    return factor, factor, factor


# ArduPilot LogStructure.h. Numbers with c, C, e, E, L are scaled in raw already; plain integers are of old firmware.
_DEGREES = {"roll_deg": ("Roll", 1.0, CM), "pitch_deg": ("Pitch", 1.0, CM)}
_PLACE = {"latitude_deg": ("Lat", 1.0, E7), "longitude_deg": ("Lng", 1.0, E7), "altitude_msl_m": ("Alt", 1.0, CM)}
DATAFLASH = [
    *facts(
        r"raw\.GPS.*",
        "gnss",
        **_PLACE,
        ground_speed_mps=("Spd", 1.0, CM),
        track_deg=("GCrs", 1.0, CM),
        velocity_down_mps=("VZ", 1.0, CM),
        hdop=("HDop", 1.0, CM),
        satellites_used=("NSats", 1.0),
    ),
    *facts(r"raw\.GPA.*", "gnss", "TimeUS", velocity_sigma_mps=("SAcc", 1.0, CM)),
    *facts(
        r"raw\.(ATT|AHR2)",
        "ins",
        **_DEGREES,
        true_heading_deg=("Yaw", 1.0, CM),
        magnetic_heading_deg=("Yaw", 1.0, CM),
    ),
    *facts(r"raw\.(POS|AHR2)", "ins", **_PLACE),
    *axes("ins", r"raw\.(XKF1|[NE]KF[16]).*", NED, "{}/VN VE VD", same(1.0)),
    *axes("ins", r"raw\.(IMU|GYR).*", RATE, "Gyr{}/X Y Z", same(RAD)),
    *axes("ins", r"raw\.(IMU|ACC).*", ACCEL, "Acc{}/X Y Z", same(1.0)),
    *axes("magnetometer", r"raw\.MAG.*", FIELD, "Mag{}/X Y Z", same(GAUSS * 1e-3)),
    *facts(r"raw\.(BAT|CURR).*", "electric", current_a=("Curr", 1.0, CM)),
    *facts(r"raw\.(XKF2|[NE]KF[27]).*", "air", wind_north_mps=("VWN", 1.0), wind_east_mps=("VWE", 1.0)),
    *facts(r"raw\.RFND.*", "radio_altimeter", height_m=("Dist", 1.0, CM)),
]
# PX4-Autopilot, msg/*.msg
_GPS = r"raw\.(vehicle_gps_position|sensor_gps).*"
ULOG = [
    *facts(
        _GPS,
        "gnss",
        latitude_deg=("lat", E7),
        longitude_deg=("lon", E7),
        altitude_msl_m=("alt", MM),
        altitude_ellipsoid_m=("alt_ellipsoid", MM),
        ground_speed_mps=("vel_m_s", 1.0),
        track_deg=("cog_rad", RAD),
        hdop=("hdop", 1.0),
        velocity_sigma_mps=("s_variance_m_s", 1.0),
        satellites_used=("satellites_used", 1.0),
    ),
    *facts(
        _GPS,
        "gnss",
        latitude_deg=("latitude_deg", 1.0),
        longitude_deg=("longitude_deg", 1.0),
        altitude_msl_m=("altitude_msl_m", 1.0),
        altitude_ellipsoid_m=("altitude_ellipsoid_m", 1.0),
    ),
    *axes("gnss", _GPS, NED, "vel_{}_m_s/n e d", same(1.0)),
    *facts(
        r"raw\.vehicle_global_position",
        "ins",
        latitude_deg=("lat", 1.0),
        longitude_deg=("lon", 1.0),
        altitude_msl_m=("alt", 1.0),
    ),
    *axes("ins", r"raw\.vehicle_local_position", NED, "{}/vx vy vz", same(1.0)),
    *axes("ins", r"raw\.vehicle_attitude", RATE, "{}/rollspeed pitchspeed yawspeed", same(RAD)),
    *axes("ins", r"raw\.vehicle_angular_velocity", RATE, "xyz[{}]/0 1 2", same(RAD)),
    *axes("ins", r"raw\.sensor_combined", RATE, "gyro_rad[{}]/0 1 2", same(RAD)),
    *axes("ins", r"raw\.sensor_combined", ACCEL, "accelerometer_m_s2[{}]/0 1 2", same(1.0)),
    *axes(
        "magnetometer",
        r"raw\.(vehicle_magnetometer|sensor_combined).*",
        FIELD,
        "magnetometer_ga[{}]/0 1 2",
        same(GAUSS),
    ),
    *facts(r"raw\.battery_status.*", "electric", current_a=("current_a", 1.0)),
    *facts(r"raw\.airspeed(_validated)?", "air", true_airspeed_mps=("true_airspeed_m_s", 1.0)),
    *facts(
        r"raw\.(wind|wind_estimate|estimator_wind)",
        "air",
        wind_north_mps=("windspeed_north", 1.0),
        wind_east_mps=("windspeed_east", 1.0),
    ),
    *facts(r"raw\.distance_sensor.*", "radio_altimeter", height_m=("current_distance", 1.0)),
]
# MAVLink common.xml
TLOG = [
    *facts(
        r"raw\.GPS_RAW_INT",
        "gnss",
        latitude_deg=("lat", E7),
        longitude_deg=("lon", E7),
        altitude_msl_m=("alt", MM),
        altitude_ellipsoid_m=("alt_ellipsoid", MM),
        ground_speed_mps=("vel", CM),
        track_deg=("cog", CM),
        hdop=("eph", CM),
        velocity_sigma_mps=("vel_acc", MM),
        satellites_used=("satellites_visible", 1.0),
    ),
    *facts(
        r"raw\.GLOBAL_POSITION_INT",
        "ins",
        latitude_deg=("lat", E7),
        longitude_deg=("lon", E7),
        altitude_msl_m=("alt", MM),
    ),
    *axes("ins", r"raw\.GLOBAL_POSITION_INT", NED, "{}/vx vy vz", same(CM)),
    *facts(r"raw\.ATTITUDE", "ins", roll_deg=("roll", RAD), pitch_deg=("pitch", RAD), true_heading_deg=("yaw", RAD)),
    *axes("ins", r"raw\.ATTITUDE", RATE, "{}/rollspeed pitchspeed yawspeed", same(RAD)),
    *axes("magnetometer", r"raw\.(RAW|SCALED)_IMU", FIELD, "{}/xmag ymag zmag", same(GAUSS * 1e-3)),
    *facts(r"raw\.(SYS_STATUS|BATTERY_STATUS)", "electric", current_a=("current_battery", CM)),
]
# u-blox interface description; the scaled members (lat, headMot, pDOP) are scaled in raw already.
_UBX_VELOCITY = {"ground_speed_mps": "gSpeed", "velocity_sigma_mps": "sAcc"}
UBX = [
    *facts(
        r"raw\.NAV-(PVT|PVAT|POSLLH|HPPOSLLH)",
        "gnss",
        latitude_deg=("lat", 1.0),
        longitude_deg=("lon", 1.0),
        altitude_ellipsoid_m=("height", MM),
        altitude_msl_m=("hMSL", MM),
        horizontal_sigma_m=("hAcc", MM),
        vertical_sigma_m=("vAcc", MM),
        satellites_used=("numSV", 1.0),
    ),
    *facts(r"raw\.NAV-PV(T|AT)", "gnss", **{name: (column, MM) for name, column in _UBX_VELOCITY.items()}),
    *facts(r"raw\.NAV-PVT", "gnss", track_deg=("headMot", 1.0)),
    *facts(r"raw\.NAV-PVAT", "gnss", track_deg=("motHeading", 1.0)),
    *axes("gnss", r"raw\.NAV-PV(T|AT)", NED, "vel{}/N E D", same(MM)),
    *facts(r"raw\.NAV-DOP", "gnss", "iTOW", gdop=("gDOP", 1.0), hdop=("hDOP", 1.0)),
    *facts(r"raw\.NAV-ATT", "ins", roll_deg=("roll", 1.0), pitch_deg=("pitch", 1.0), true_heading_deg=("heading", 1.0)),
    *facts(
        r"raw\.NAV-PVAT",
        "ins",
        roll_deg=("vehRoll", 1.0),
        pitch_deg=("vehPitch", 1.0),
        true_heading_deg=("vehHeading", 1.0),
    ),
]
_GGA, _RMC = r"raw\...GGA", r"raw\...RMC"
NMEA = [  # NMEA 0183; receivers write 12 satellites for more
    *facts(
        _GGA,
        "gnss",
        "time",
        latitude_deg=("lat", 1.0),
        longitude_deg=("lon", 1.0),
        altitude_msl_m=("alt", 1.0),
        hdop=("HDOP", 1.0),
    ),
    Fact(_GGA, "numSV", "gnss", "satellites_used", 1.0, shared="time", below=12.0),
    *facts(_RMC, "gnss", "time", ground_speed_mps=("spd", KNOT), track_deg=("cog", 1.0)),
    *facts(
        r"raw\.PASHR",
        "ins",
        roll_deg=("roll", 1.0),
        pitch_deg=("pitch", 1.0),
        true_heading_deg=("trueHdg", 1.0),
        true_heading_sigma_deg=("hdgAcc", 1.0),
    ),
]
# NovAtel OEM7 commands and logs reference
_NOVATEL_INS = r"raw\.(INSPVA[SX]?|INSATT[SX]?)"
NOVATEL = [
    *facts(
        r"raw\.BESTPOS",
        "gnss",
        latitude_deg=("latitude", 1.0),
        longitude_deg=("longitude", 1.0),
        altitude_msl_m=("orthometric_height", 1.0),
        vertical_sigma_m=("height_std_dev", 1.0),
        satellites_used=("num_soln_svs", 1.0),
    ),
    *facts(
        _NOVATEL_INS,
        "ins",
        latitude_deg=("latitude", 1.0),
        longitude_deg=("longitude", 1.0),
        altitude_ellipsoid_m=("height", 1.0),
        roll_deg=("roll", 1.0),
        pitch_deg=("pitch", 1.0),
        true_heading_deg=("azimuth", 1.0),
    ),
    *axes("ins", _NOVATEL_INS, NED, "{}_vel/north east up", (1.0, 1.0, -1.0)),
]
# sensor_msgs and REP 103: forward-left-up, radians, tesla. Topics have the robot's names: columns tell the messages.
BAGS = [
    *axes("ins", r"raw\..*", RATE, "angular_velocity.{}/x y z", (RAD, -RAD, -RAD)),
    *axes("ins", r"raw\..*", ACCEL, "linear_acceleration.{}/x y z", FORWARD_LEFT_UP),
    *axes("magnetometer", r"raw\..*", FIELD, "magnetic_field.{}/x y z", (1e9, -1e9, -1e9)),
    *facts(
        r"raw\..*",
        "gnss",
        latitude_deg=("latitude", 1.0),
        longitude_deg=("longitude", 1.0),
        altitude_ellipsoid_m=("altitude", 1.0),
    ),
    *facts(
        r"raw\..*", "odometry", speed_mps=("twist.twist.linear.x", 1.0), turn_rate_dps=("twist.twist.angular.z", -RAD)
    ),
]
POS = [  # RTKLIB manual 2.4.2, appendix B
    *facts(
        r"raw\.pos",
        "gnss",
        latitude_deg=("latitude", 1.0),
        longitude_deg=("longitude", 1.0),
        altitude_ellipsoid_m=("height", 1.0),
        vertical_sigma_m=("sdu", 1.0),
        satellites_used=("ns", 1.0),
    ),
    *axes("gnss", r"raw\.pos", NED, "{}/vn ve vu", (1.0, 1.0, -1.0)),
]
SBET = [  # Applanix SBET: radians, the platform's axes
    *facts(
        r"raw\.sbet",
        "ins",
        latitude_deg=("latitude", RAD),
        longitude_deg=("longitude", RAD),
        altitude_ellipsoid_m=("altitude", 1.0),
        velocity_down_mps=("z_velocity", 1.0),
        roll_deg=("roll", RAD),
        pitch_deg=("pitch", RAD),
    ),
    *axes("ins", r"raw\.sbet", RATE, "{}_rate/x y z", same(RAD)),
]
HDF5 = [  # FlightDataAnalyzer's names and units; the topic's leading parameter has its own times
    *facts(r"raw\.Heading(_Continuous)?", "ins", magnetic_heading_deg=("value", 1.0)),
    *facts(r"raw\.Heading_True(_Continuous)?", "ins", true_heading_deg=("value", 1.0)),
    *facts(r"raw\.Latitude", "ins", latitude_deg=("value", 1.0)),
    *facts(r"raw\.Acceleration_Normal", "ins", accel_z_mps2=("value", -G)),
    *facts(r"raw\.Altitude_Radio.*", "radio_altimeter", height_m=("value", FOOT)),
    *facts(r"raw\.Altitude_STD", "baro", pressure_altitude_m=("value", FOOT)),
    *facts(r"raw\.Altitude_AAL", "baro", height_above_airfield_m=("value", FOOT)),
    *facts(r"raw\.Airspeed", "air", indicated_airspeed_mps=("value", KNOT)),
    *facts(r"raw\.Eng_\d_N1", "engine", n1_share=("value", 0.01)),
    *facts(r"raw\.ILS_Localizer", "guidance", lateral_deviation_dots=("value", -1.0)),
]
# Garmin G1000: raw keeps what is not mapped, so the file itself is the raw side. Cells by names of the third line.
G1000: Mapping[str, tuple[str, float]] = {
    "gnss.latitude_deg": ("Latitude", 1.0),
    "gnss.longitude_deg": ("Longitude", 1.0),
    "gnss.altitude_ellipsoid_m": ("AltGPS", FOOT),
    "gnss.altitude_msl_m": ("AltMSL", FOOT),
    "gnss.ground_speed_mps": ("GndSpd", KNOT),
    "gnss.velocity_down_mps": ("VSpdG", -FOOT / 60.0),
    "engine.1.power_share": ("E1 %Pwr", 1.0),
    "ins.pitch_deg": ("Pitch", 1.0),
    "ins.roll_deg": ("Roll", 1.0),
    "ins.magnetic_heading_deg": ("HDG", 1.0),
    "air.indicated_airspeed_mps": ("IAS", KNOT),
    "air.true_airspeed_mps": ("TAS", KNOT),
    "guidance.course_magnetic_deg": ("CRS", 1.0),
}
# ARINC 429 part 2: label -> field, bits with their sign, value of the highest bit below the sign, and factor.
ARINC_429: Mapping[int, tuple[str, int, float, float]] = {
    0o314: ("true_heading_deg", 16, 90.0, 1.0),
    0o324: ("pitch_deg", 15, 90.0, 1.0),
    0o325: ("roll_deg", 15, 90.0, 1.0),
    0o326: ("rate_y_dps", 14, 64.0, 1.0),
}
