"""Messages of NovAtel OEM receivers: numbers, names and layouts.

Field names are those of NovAtel's message database.

Source: NovAtel, OEM7 commands and logs reference manual; the database of novatel_edie (MIT). Enumerations stay numbers.
"""

from collections.abc import Mapping
from types import MappingProxyType

_COUNTS = "num_svs:u1 num_soln_svs:u1 num_soln_L1_svs:u1 num_soln_multi_svs:u1 "
_SIGNALS = "extended_solution_status2:u1 ext_sol_stat:u1 gal_and_bds_mask:u1 gps_and_glo_mask:u1"
_PLACE = "latitude:r8 longitude:r8 orthometric_height:r8 undulation:r4"
_PLACE_SPREAD = "latitude_std_dev:r4 longitude_std_dev:r4 height_std_dev:r4"
_VELOCITY = "north_vel:r8 east_vel:r8 up_vel:r8"
_ANGLES = "roll:r8 pitch:r8 azimuth:r8"
_SPREADS = (
    f"{_PLACE_SPREAD} north_vel_std_dev:r4 east_vel_std_dev:r4 up_vel_std_dev:r4 roll_std_dev:r4 pitch_std_dev:r4 "
    "azimuth_std_dev:r4 extended_sol_stat:u4 time_since_update:u2"
)
_WEEK = "week:u4 seconds:r8"
_BESTPOS = (
    f"solution_status:u4 position_type:u4 {_PLACE} datum_id:u4 {_PLACE_SPREAD} base_id:c4 diff_age:r4 solution_age:r4 "
    f"{_COUNTS}{_SIGNALS}"
)
_BESTVEL = (
    "solution_status:u4 type:u4 latency:r4 diff_age:r4 horizontal_speed:r8 ground_track:r8 vertical_speed:r8 -:r4"
)
_HEADING = (
    "solution_status:u4 position_type:u4 b_length:r4 heading:r4 pitch:r4 -:r4 heading_std_dev:r4 pitch_std_dev:r4 "
)
_INSPVA = f"{_WEEK} latitude:r8 longitude:r8 height:r8 {_VELOCITY} {_ANGLES} ins_solution_status:u4"
_INSCOV = f"{_WEEK} " + " ".join(f"{kind}_cov_{at}:r8" for kind in ("pos", "att", "vel") for at in range(1, 10))
_IMU = f"{_WEEK} " + " ".join(f"corr_{kind}_{axis}:r8" for kind in ("rate", "accel") for axis in "xyz")
_COUNTS_OF_UNIT = "imu_status:u4 " + " ".join(f"del_{kind}_body_{axis}:i4" for kind in ("vel", "ang") for axis in "zyx")
_RAW_IMU = f"{_WEEK} {_COUNTS_OF_UNIT}"  # those along and about y are negative: -y
_RAW_IMU_X = f"imu_status_info:u1 imu_type:u1 week:u2 seconds:r8 {_COUNTS_OF_UNIT}"

LAYOUTS: Mapping[str, str] = MappingProxyType(
    {
        "BESTPOS": _BESTPOS,
        "BESTGNSSPOS": _BESTPOS,
        "PSRPOS": _BESTPOS,
        "BESTVEL": _BESTVEL,
        "BESTGNSSVEL": _BESTVEL,
        "PSRVEL": _BESTVEL,
        "PSRDOP": "gdop:r4 pdop:r4 hdop:r4 htdop:r4 tdop:r4 gps_elev_mask:r4 sats_count:u4 | sats_count sats:u4",
        "INSPVA": _INSPVA,
        "INSPVAS": _INSPVA,
        "INSPVAX": f"ins_solution_status:u4 position_type:u4 {_PLACE} {_VELOCITY} {_ANGLES} {_SPREADS}",
        "INSATT": f"{_WEEK} {_ANGLES} ins_solution_status:u4",
        "INSATTS": f"{_WEEK} {_ANGLES} ins_solution_status:u4",
        "INSCOV": _INSCOV,
        "INSCOVS": _INSCOV,
        "INSSTDEV": f"{_SPREADS} -:u2 enabled_updates:u4 -:u4",
        "CORRIMUDATA": _IMU,
        "CORRIMUDATAS": _IMU,
        "TIME": "clock_status:u4 offset:r8 offset_std_dev:r8 utc_offset:r8 utc_year:u4 utc_month:u1 utc_day:u1 "
        "utc_hour:u1 utc_min:u1 utc_ms:u4 utc_status:u4",
        "HEADING": f"{_HEADING}base_id:c4 {_COUNTS}{_SIGNALS}",
        "HEADING2": f"{_HEADING}rover_id:c4 base_id:c4 {_COUNTS}{_SIGNALS}",
        "DUALANTENNAHEADING": f"{_HEADING}base_id:c4 {_COUNTS}{_SIGNALS}",
        "RAWIMU": _RAW_IMU,
        "RAWIMUS": _RAW_IMU,
        "RAWIMUX": _RAW_IMU_X,
        "RAWIMUSX": _RAW_IMU_X,
    }
)
NAMES: Mapping[int, str] = MappingProxyType(
    {
        42: "BESTPOS",
        1429: "BESTGNSSPOS",
        47: "PSRPOS",
        99: "BESTVEL",
        1430: "BESTGNSSVEL",
        100: "PSRVEL",
        174: "PSRDOP",
        507: "INSPVA",
        508: "INSPVAS",
        1465: "INSPVAX",
        263: "INSATT",
        319: "INSATTS",
        264: "INSCOV",
        320: "INSCOVS",
        2051: "INSSTDEV",
        812: "CORRIMUDATA",
        813: "CORRIMUDATAS",
        971: "HEADING",
        1335: "HEADING2",
        2042: "DUALANTENNAHEADING",
        101: "TIME",
        43: "RANGE",
        140: "RANGECMP",
        268: "RAWIMU",
        325: "RAWIMUS",
        1461: "RAWIMUX",
        1462: "RAWIMUSX",
        37: "VERSION",
        93: "RXSTATUS",
        8: "IONUTC",
        7: "GPSEPHEM",
        723: "GLOEPHEMERIS",
        83: "SATVIS",
        48: "SATVIS2",
        128: "RXCONFIG",
    }
)
POSITION_SOURCES = ("BESTGNSSPOS", "BESTPOS", "PSRPOS")  # the first that a log has leads
VELOCITY_OF = MappingProxyType({"BESTGNSSPOS": "BESTGNSSVEL", "BESTPOS": "BESTVEL", "PSRPOS": "PSRVEL"})
INS_SOURCES = ("INSPVAX", "INSPVA", "INSPVAS", "INSATT", "INSATTS", "DUALANTENNAHEADING", "HEADING2", "HEADING")


def name_of(number: int) -> str:
    """Name of a message by its number.

    Examples
    --------
    >>> name_of(42), name_of(9999)
    ('BESTPOS', 'NOVATEL-9999')
    """
    return NAMES.get(number, f"NOVATEL-{number}")
