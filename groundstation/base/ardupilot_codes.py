"""Names of what ArduPilot logs as numbers: events, errors, modes, reasons of a mode.

Source: ArduPilot, AP_Logger/AP_Logger.h (LogEvent, LogErrorSubsystem, LogErrorCode), AP_Vehicle/ModeReason.h, mode.h
of each vehicle, 4.7.0-dev of 2025-10-24. Numbers were added and never reused since 2.x.
"""

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.base.findings import Severity

# Estimators by the number of AHRS_EKF_TYPE and ATT.AEKF (AP_AHRS.h, EKFType); 10 is the truth of the simulator.
ESTIMATORS: Mapping[int, str] = MappingProxyType(
    {0: "DCM", 1: "EKF1", 2: "EKF2", 3: "EKF3", 10: "simulator", 11: "external"}
)
EVENTS: Mapping[int, str] = MappingProxyType(
    {
        10: "armed",
        11: "disarmed",
        15: "auto armed",
        16: "take-off",
        17: "land complete maybe",
        18: "land complete",
        19: "GPS lost",
        21: "flip started",
        22: "flip ended",
        25: "home set",
        28: "not landed",
        30: "autotune initialised",
        31: "autotune off",
        32: "autotune restarted",
        33: "autotune succeeded",
        34: "autotune failed",
        35: "autotune reached its limit",
        36: "autotune tested by the pilot",
        37: "autotune gains saved",
        38: "trim saved",
        41: "fence enabled",
        42: "fence disabled",
        49: "parachute disabled",
        50: "parachute enabled",
        51: "parachute released",
        52: "landing gear deployed",
        53: "landing gear retracted",
        54: "motors emergency stopped",
        55: "motors emergency stop cleared",
        56: "motor interlock disabled",
        57: "motor interlock enabled",
        58: "rotor run-up complete",
        59: "rotor speed below critical",
        60: "EKF altitude reset",
        61: "landing cancelled by the pilot",
        62: "EKF yaw reset",
        67: "GPS primary changed",
        76: "fence of highest altitude enabled",
        77: "fence of highest altitude disabled",
        78: "circular fence enabled",
        79: "circular fence disabled",
        80: "fence of lowest altitude enabled",
        81: "fence of lowest altitude disabled",
        82: "polygon fence enabled",
        83: "polygon fence disabled",
        85: "EKF3 sources set to primary",
        86: "EKF3 sources set to secondary",
        87: "EKF3 sources set to tertiary",
        90: "airspeed primary changed",
        163: "surfaced",
        164: "not surfaced",
        165: "bottomed",
        166: "not bottomed",
    }
)
SUBSYSTEMS: Mapping[int, str] = MappingProxyType(
    {
        1: "main loop",
        2: "radio",
        3: "compass",
        4: "optical flow",
        5: "failsafe of the radio",
        6: "failsafe of the battery",
        7: "failsafe of GPS",
        8: "failsafe of the ground station",
        9: "failsafe of the fence",
        10: "flight mode",
        11: "GPS",
        12: "crash check",
        13: "flip",
        14: "autotune",
        15: "parachute",
        16: "EKF check",
        17: "failsafe of the EKF",
        18: "barometer",
        19: "processor",
        20: "failsafe of ADS-B",
        21: "terrain data",
        22: "navigation",
        23: "failsafe of terrain data",
        24: "EKF lane",
        25: "thrust loss check",
        26: "failsafe of sensors",
        27: "failsafe of a leak",
        28: "pilot input",
        29: "failsafe of vibration",
        30: "internal error",
        31: "failsafe of dead reckoning",
    }
)
GRAVE_SUBSYSTEMS = frozenset((5, 6, 7, 8, 12, 16, 17, 19, 20, 23, 25, 26, 27, 29, 30, 31))
LANES, _MODES = 24, 10
GRAVE_EVENTS, LIGHT_EVENTS = frozenset((19, 51, 54)), frozenset((34, 35, 59, 60, 62, 67, 90))
_CODES: Mapping[tuple[int, int], str] = MappingProxyType(
    {
        (1, 1): "late",
        (2, 2): "late frame",
        (3, 1): "not initialised",
        (3, 4): "unhealthy",
        (9, 1): "breach of the highest altitude",
        (9, 2): "breach of the circle",
        (9, 3): "breach of altitude and circle",
        (9, 4): "breach of the polygon",
        (9, 8): "breach of the lowest altitude",
        (11, 2): "glitch",
        (12, 1): "crash",
        (12, 2): "loss of control",
        (13, 2): "abandoned",
        (15, 2): "not deployed, too low",
        (15, 3): "not deployed, landed",
        (16, 2): "bad variance",
        (18, 1): "not initialised",
        (18, 2): "glitch",
        (18, 3): "bad depth",
        (18, 4): "unhealthy",
        (21, 2): "missing",
        (22, 2): "destination not set",
        (22, 3): "RTL restarted",
        (22, 4): "circle not begun",
        (22, 5): "destination outside the fence",
        (22, 6): "RTL without a range finder",
        (30, 1): "detected",
    }
)


def error_name(subsystem: int, code: int) -> str:
    """Return subsystem and code of an ERR record in words.

    Examples
    --------
    >>> error_name(6, 1), error_name(6, 0), error_name(11, 2), error_name(99, 7)
    ('failsafe of the battery', 'failsafe of the battery over', 'GPS: glitch', 'error 99: code 7')
    """
    if subsystem == LANES:
        return f"EKF lane changed to {code}"
    name = SUBSYSTEMS.get(subsystem, f"error {subsystem}")
    if subsystem == _MODES:
        return f"{name} {code} refused"
    if code == 0:
        return f"{name} over"
    told = _CODES.get((subsystem, code), "" if name.startswith("failsafe") and code == 1 else f"code {code}")
    return f"{name}: {told}" if told else name


def error_severity(subsystem: int, code: int) -> Severity:
    """Grade an ERR record: information where it says that an error is over.

    Examples
    --------
    >>> error_severity(6, 1), error_severity(6, 0), error_severity(11, 2), error_severity(24, 0)
    ('fail', 'info', 'warn', 'warn')
    """
    if subsystem == LANES:
        return "warn"
    if code == 0:
        return "info"
    return "fail" if subsystem in GRAVE_SUBSYSTEMS else "warn"


def event_severity(number: int) -> Severity:
    """Grade an EV record."""
    return "fail" if number in GRAVE_EVENTS else "warn" if number in LIGHT_EVENTS else "info"


# Rsn of MODE, from 3.4 on.
MODE_REASONS: Mapping[int, str] = MappingProxyType(
    {
        0: "unknown",
        1: "remote control",
        2: "ground station",
        3: "radio failsafe",
        4: "battery failsafe",
        5: "ground station failsafe",
        6: "EKF failsafe",
        7: "GPS glitch",
        8: "end of the mission",
        9: "throttle up while landing",
        10: "fence breached",
        11: "terrain failsafe",
        12: "end of braking",
        13: "end of the flip",
        14: "avoidance",
        15: "end of avoidance",
        16: "end of the throw",
        17: "termination",
        18: "toy mode",
        19: "crash",
        20: "soaring with motor",
        21: "thermal found",
        22: "thermal lost",
        23: "VTOL transition failed",
        24: "VTOL take-off failed",
        25: "failsafe",
        26: "start",
        27: "surfaced",
        28: "bad depth",
        29: "leak failsafe",
        30: "servo test",
        31: "start",
        32: "script",
        33: "not available",
        34: "autorotation",
        35: "end of autorotation",
        36: "soaring too high",
        37: "soaring too low",
        38: "soaring too far",
        39: "RTL over, VTOL landing",
        40: "RTL over, landing",
        41: "mission",
        42: "FrSky",
        43: "end of the fence's return",
        44: "QRTL in place of RTL",
        45: "end of auto RTL",
        46: "altitude reached",
        47: "loiter in VTOL",
        48: "radio failsafe over",
        49: "QLAND in place of RTL",
        50: "dead reckoning failsafe",
        51: "take-off failsafe",
        52: "DDS",
        53: "switch",
        54: "landing by itself",
        55: "fence on again",
    }
)
BAD_MODE_REASONS = frozenset((3, 4, 5, 6, 7, 10, 11, 17, 19, 23, 24, 25, 28, 29, 50, 51))
_PLANE = (
    *("MANUAL", "CIRCLE", "STABILIZE", "TRAINING", "ACRO", "FBWA", "FBWB", "CRUISE", "AUTOTUNE", "", "AUTO", "RTL"),
    *("LOITER", "TAKEOFF", "AVOID_ADSB", "GUIDED", "INITIALISING", "QSTABILIZE", "QHOVER", "QLOITER", "QLAND", "QRTL"),
    *("QAUTOTUNE", "QACRO", "THERMAL", "LOITER_ALT_QLAND", "AUTOLAND"),
)
_COPTER = (
    *(
        "STABILIZE",
        "ACRO",
        "ALT_HOLD",
        "AUTO",
        "GUIDED",
        "LOITER",
        "RTL",
        "CIRCLE",
        "",
        "LAND",
        "",
        "DRIFT",
        "",
        "SPORT",
    ),
    *("FLIP", "AUTOTUNE", "POSHOLD", "BRAKE", "THROW", "AVOID_ADSB", "GUIDED_NOGPS", "SMART_RTL", "FLOWHOLD", "FOLLOW"),
    *("ZIGZAG", "SYSTEMID", "AUTOROTATE", "AUTO_RTL", "TURTLE"),
)
_ROVER = (
    *("MANUAL", "ACRO", "", "STEERING", "HOLD", "LOITER", "FOLLOW", "SIMPLE", "DOCK", "CIRCLE", "AUTO", "RTL"),
    *("SMART_RTL", "", "", "GUIDED", "INITIALISING"),
)
_SUB = (
    *("STABILIZE", "ACRO", "ALT_HOLD", "AUTO", "GUIDED", "", "", "CIRCLE", "", "SURFACE", "", "", "", "", "", ""),
    *("POSHOLD", "", "", "MANUAL", "MOTOR_DETECT", "SURFTRAK"),
)
MODES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        **dict.fromkeys(("ArduPlane", "APM:Plane"), _PLANE),
        **dict.fromkeys(("ArduCopter", "APM:Copter"), _COPTER),
        **dict.fromkeys(("ArduRover", "APM:Rover", "Rover"), _ROVER),
        "ArduSub": _SUB,
    }
)


def mode_severity(reason: int) -> Severity:
    """Grade a change of mode by its reason: a failsafe that made it fails."""
    return "fail" if reason in BAD_MODE_REASONS else "info"
