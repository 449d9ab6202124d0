"""Meanings of column names: the field, the unit and the axis that a name tells.

The words are those of public logs of drones, gliders, boats, cars and phones, in English and Russian.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType

from groundstation.base.dataclasses import dataclass

_IN_BRACKETS = re.compile(r"\(([^()]*)\)|\[([^\[\]]*)\]|\{([^{}]*)\}")
_CAMEL = re.compile(r"(?<=[a-zа-я0-9])(?=[A-ZА-Я])|(?<=[A-Z])(?=[A-Z][a-z])")
_MAGNETIC = re.compile(r"[\[({]?(?:deg(?:rees)?|°)?[ .,_]*(?:m|mag|magn|magnetic)[\])}]?", re.IGNORECASE)
_SQUARED = re.compile(r"([a-zA-Z]+)(?:\^?2|²)")  # m^2
_PARTING = re.compile(r"[^0-9A-Za-zА-Яа-яёЁ]+")
MOST_CHARACTERS = 80  # of a name: a longer one is no name of a quantity
_GNSS = frozenset(["gps", "gnss", "ubx", "rtk", "nmea", "ublox", "receiver"])
_INS = frozenset(["ins", "ahrs", "imu", "ekf", "nav", "fused", "fusion", "filter", "attitude", "euler"])
# Words that leave the meaning of a name as it is.
_PADDING = (
    _GNSS
    | _INS
    | frozenset(
        [
            "osd",
            "location",
            "position",
            "pos",
            "uav",
            "drone",
            "aircraft",
            "vehicle",
            "current",
            "value",
            "data",
            "sensor",
            "field",
        ]
    )
)
_UNITS_BY_KIND: Mapping[str, Mapping[str, tuple[str, float]]] = MappingProxyType(
    {
        kind: MappingProxyType({word: (unit, scale) for unit, scale, words in entries for word in words.split("|")})
        for kind, entries in {
            "deg": (
                ("deg", 1.0, "deg|degs|degree|degrees|°|dd|decimal degrees|wgs84|degt|deg true|degm|deg mag|град"),
                ("rad", 1.0, "rad|rads|radian|radians"),
                ("deg1e7", 1.0, "1e-7 deg|dege7|deg e7|deg*1e7|e7|1e7|deg1e7"),
                ("deg", 0.01, "cdeg|centideg|centidegrees"),
            ),
            "m": (
                ("m", 1.0, "m|mt|meter|meters|metre|metres|m msl|msl m|м"),
                ("ft", 1.0, "ft|feet|foot|ft msl|ft wgs84|wgs84 ft|ft agl"),
                ("mm", 1.0, "mm"),
                ("cm", 1.0, "cm"),
                ("km", 1.0, "km|kilometers"),
                ("nmi", 1.0, "nm|nmi"),
            ),
            "mps": (
                ("mps", 1.0, "m/s|m/sec|mps|ms|m s|metres per second|meters per second|ms-1|m s-1|м/с"),
                ("kt", 1.0, "kt|kts|kn|knot|knots"),
                ("kmh", 1.0, "km/h|kmh|kph|kmph|км/ч"),
                ("mps", 0.44704, "mph|mi/h|miles/h"),
                ("fpm", 1.0, "fpm|ft/min"),
                ("fps", 1.0, "fps|ft/s|ft/sec"),
                ("cmps", 1.0, "cm/s|cms|cmps"),
                ("mmps", 1.0, "mm/s|mms|mmps"),
            ),
            "dps": (
                ("dps", 1.0, "deg/s|deg/sec|dps|°/s|degs|deg s|degrees/s|degree/s"),
                ("radps", 1.0, "rad/s|rad/sec|radps|rads|rad s|radians/s"),
                ("dps", 0.001, "mdps"),
            ),
            "mps2": (
                ("mps2", 1.0, "m/s2|m/s^2|m/s²|m/s/s|mss|ms2|mps2|m s2|m/sec^2"),
                ("g", 1.0, "g|gs|g's"),
                ("g", 0.001, "mg"),
                ("fps2", 1.0, "ft/s2|ft/s^2"),
            ),
            "nt": (
                ("ut", 1.0, "ut|µt|μt|microtesla"),
                ("nt", 1.0, "nt|nanotesla"),
                ("gauss", 1.0, "g|gauss|gs"),
                ("mgauss", 1.0, "mg|mgauss|milligauss"),
            ),
            "a": (("a", 1.0, "a|amp|amps"), ("ma", 1.0, "ma")),
            "s": (
                ("s", 1.0, "s|sec|secs|second|seconds|сек|с"),
                ("ms", 1.0, "ms|msec|millisecond|milliseconds|millis"),
                ("us", 1.0, "us|µs|usec|microsecond|microseconds|micros"),
            ),
        }.items()
    }
)
_OTHER = frozenset(["dop", "%", "rpm", "hz", "v", "mv", "mah", "pa", "hpa", "mbar", "kpa", "inhg"])  # units of no field
TIME_WORDS: Mapping[str, str] = MappingProxyType(
    {
        **{word: unit for word, (unit, _scale) in _UNITS_BY_KIND["s"].items()},
        **dict.fromkeys(["ns", "nsec", "nanosecond", "nanoseconds", "nanos"], "ns"),
        **dict.fromkeys(["min", "minute", "minutes"], "min"),
        **dict.fromkeys(["h", "hour", "hours"], "h"),
    }
)
_ALTITUDE = r"(?:alt|altitude|elevation|elev|ele|height|hgt)"
_SPEED = r"(?:speed|spd|velocity|vel|v)"
_SIGMA = r"(?:acc|accuracy|std|stddev|sigma|sd|uncertainty|precision)"
_HEADING = r"(?:heading|hdg|yaw|hdt|azimuth|psi|azi)"


@dataclass(frozen=True)
class Meaning:
    """Meaning of a name: the topic and field it feeds, and its sign.

    ``topic`` is that of a name which does not say GNSS or INS. ``unit`` and ``scale`` are those that the name tells.
    ``is_variance``: the number is a square. ``is_magnetic``: a direction counts from magnetic north. ``role`` is
    ``time``, ``date``, ``clock``, ``week``, ``tow``, ``variation``, ``key`` or empty for a field.
    """

    topic: str = ""
    field: str = ""
    sign: int = 1
    role: str = ""
    unit: str = ""
    scale: float = 1.0
    is_variance: bool = False
    is_magnetic: bool = False

    @property
    def target(self) -> str:
        """Topic and field as a profile names them."""
        return f"{self.topic}.{self.field}"


_AXES = {"x": "x", "y": "y", "z": "z"}
_BODY = {"x": "forward", "y": "right", "z": "down"}
_BY_ANGLE = {"roll": "x", "pitch": "y", "yaw": "z"}
# (pattern of the words, topic, field, unit kind, sign)
_FIELDS: tuple[tuple[str, str, str, str, int], ...] = (
    (r"(?:lat|latitude)(?: n s)?|широта", "gnss", "latitude_deg", "deg", 1),
    (r"(?:lon|lng|long|longitude|longtitude)(?: e w)?|долгота", "gnss", "longitude_deg", "deg", 1),
    (
        rf"{_ALTITUDE}(?: (?:above )?(?:ellipsoid|ellipsoidal|hae|wgs84|wgs))|hae|h ell|h ellipsoid"
        rf"|(?:ellipsoid|ellipsoidal|wgs84|hae) {_ALTITUDE}",
        *("gnss", "altitude_ellipsoid_m", "m", 1),
    ),
    (
        rf"(?:baro|barometric|pressure|press) ?{_ALTITUDE}|{_ALTITUDE} (?:baro|press|pressure|std)|baroaltitude",
        "baro",
        "pressure_altitude_m",
        "m",
        1,
    ),
    (
        rf"{_ALTITUDE}(?: (?:msl|amsl|sl|asl|geoid|above sea level|above mean sea level))?|h msl|(?:msl|amsl)"
        rf"(?: {_ALTITUDE})?|высота|geoaltitude",
        *("gnss", "altitude_msl_m", "m", 1),
    ),
    (
        r"(?:radar|radio|laser|lidar) ?(?:altimeter|alt|altitude|height)|ra|radalt",
        "radio_altimeter",
        "height_m",
        "m",
        1,
    ),
    (
        r"(?:ground|gnd|h|horizontal|hor|over ground|путевая)? ?(?:speed|spd|velocity|скорость)"
        r"(?: (?:over ground|gnd|ground|2d|2 d|kn|gps|sog))?|groundspeed|gndspd|sog|gs|gspeed|g speed|путевая",
        *("gnss", "ground_speed_mps", "mps", 1),
    ),
    (
        r"(?:true )?(?:track|course|trk|crs|cog|bearing|direction|ground course|ground track|g course)"
        r"(?: (?:angle|true|over ground|made good))?|cog true|truetrack|путевой угол|heading motion|heading of motion",
        *("gnss", "track_deg", "deg", 1),
    ),
    (
        rf"(?:true )?{_HEADING}(?: (?:true|angle))?|hd t|курс|курс истинный|истинный курс",
        "ins",
        "true_heading_deg",
        "deg",
        1,
    ),
    (
        rf"(?:mag|magnetic|compass) ?{_HEADING}|{_HEADING} (?:mag|magnetic|m)|compass|hdm|hd m"
        rf"|(?:курс )?магнитный(?: курс)?",
        *("ins", "magnetic_heading_deg", "deg", 1),
    ),
    (r"(?:roll|bank)(?: angle)?|phi|крен", "ins", "roll_deg", "deg", 1),
    (r"pitch(?: angle)?|theta|тангаж", "ins", "pitch_deg", "deg", 1),
    (
        rf"{_SPEED} ?(?:n|north|northing)|(?:n|north|northward) {_SPEED}|vnorth|veln|vn|v north|ns velocity",
        "gnss",
        "velocity_north_mps",
        "mps",
        1,
    ),
    (
        rf"{_SPEED} ?(?:e|east|easting)|(?:e|east|eastward) {_SPEED}|veast|vele|ve|v east|ew velocity",
        "gnss",
        "velocity_east_mps",
        "mps",
        1,
    ),
    (rf"{_SPEED} ?(?:d|down)|(?:d|down|downward) {_SPEED}|vdown|veld|vd|v down", "gnss", "velocity_down_mps", "mps", 1),
    (
        rf"{_SPEED} ?(?:u|up)|(?:u|up|upward) {_SPEED}|vup|velu|vu|climb|climb rate|climbrate|rate of climb"
        rf"|roc|vario|vvi"
        r"|(?:vertical|vert) ?(?:speed|velocity|rate|spd)|v ?(?:speed|spd)|vsi|vertrate",
        *("gnss", "velocity_down_mps", "mps", -1),
    ),
    (r"h ?dop", "gnss", "hdop", "", 1),
    (r"p ?dop", "gnss", "pdop", "", 1),
    (r"g ?dop", "gnss", "gdop", "", 1),
    (
        r"(?:num|n|nr|number of|no of|used)? ?(?:sats?|satellites?|svs?|satnum)(?: (?:used|num|count|in use|number))?"
        r"|nums?v|nsats?|numsats?|satcount|sat num|(?:osd )?gps num",
        *("gnss", "satellites_used", "", 1),
    ),
    (r"(?:satellites?|sats?) (?:tracked|visible|in view)", "gnss", "satellites_tracked", "", 1),
    (rf"(?:h|hor|horizontal) ?{_SIGMA}|hacc|eph|accuracy", "gnss", "horizontal_sigma_m", "m", 1),
    (rf"(?:v|vert|vertical|alt|altitude) ?{_SIGMA}|vacc|epv", "gnss", "vertical_sigma_m", "m", 1),
    (rf"(?:s|speed|vel|velocity) ?{_SIGMA}|sacc", "gnss", "velocity_sigma_mps", "mps", 1),
    (r"true air ?speed|tas", "air", "true_airspeed_mps", "mps", 1),
    (r"(?:indicated|i|calibrated)? ?air ?speed|ias|cas", "air", "indicated_airspeed_mps", "mps", 1),
    (r"flaps?(?: angle| position| deflection)?", "configuration", "flap_deg", "deg", 1),
    (r"(?:landing )?gear down(?: locked)?|gear down and locked", "configuration", "gear_down", "", 1),
    (r"weight on wheels|wow|on ground|onground", "discrete", "weight_on_wheels", "", 1),
    (r"(?:battery |batt? )?(?:current|curr|amps?)", "electric", "current_a", "a", 1),
)
_SQUARE = r"(?:cov|covariance|var|variance)(?: pos| position)?"
_SIGMAS: tuple[tuple[str, str, str], ...] = (
    ("n|north|lat|latitude|nn|n n", "position_north_sigma_m", "m"),
    ("e|east|lon|longitude|ee|e e", "position_east_sigma_m", "m"),
    ("u|up|d|down|h|height|alt|altitude|uu|u u|dd|d d", "vertical_sigma_m", "m"),
)
# Three axes of one sensor: (pattern with the axis as group, topic, field with the axis in braces, kind)
_TRIADS: tuple[tuple[str, str, str, str], ...] = (
    (
        r"(?:gyro|gyr|gyroscope|angular ?(?:velocity|rate|speed)|ang ?(?:vel|rate)|omega|rotation ?(?:rate)?"
        r"|rate|w|g) ?([xyz])"
        r"|([xyz]) ?(?:gyro|gyr|gyroscope)|(roll|pitch|yaw) ?rate",
        *("imu", "rate_{}_dps", "dps"),
    ),
    (
        r"(?:acc|accel|acceleration|accelerometer|a|f|specific force|g ?force) ?([xyz])"
        r"|([xyz]) ?(?:acc|accel|acceleration)",
        "imu",
        "accel_{}_mps2",
        "mps2",
    ),
    (
        r"(?:mag|magnetometer|magnetic ?field|magn|compass|b|m) ?([xyz])|([xyz]) ?(?:mag|magnetometer)",
        "magnetometer",
        "field_{}_nt",
        "nt",
    ),
)
_ROLES: tuple[tuple[str, str], ...] = (
    (
        r"(?:utc|gps|unix|epoch|device|log|elapsed|system|sys|boot|recorder|sample|monotonic|relative|base"
        r"|update|since)? ?"
        r"(?:time|timestamp|time stamp|date ?time|epoch|t|ts)(?: (?:s|us|usec|utc|boot|unix|stamp|since .*"
        r"|from .*|elapsed"
        r"|of (?:day|fix)|pc|fine))?|unix|utc|seconds|millis|millisecond|timeusec|seconds elapsed|время"
        r"|date time .*|timestamp .*"
        r"|ms|msec|us|usec|isodatetime|iso ?8601|base date time|(?:date ?time|time) ?utc|elapsed",
        "time",
    ),
    (r"(?:gps|utc|local|lcl)? ?date(?: utc| gps)?|дата|day", "date"),
    (r"(?:local|lcl|gps|utc) time|time of day|hms|clock", "clock"),
    (r"(?:gps )?(?:week|wn)(?: number| no)?", "week"),
    (r"(?:gps )?(?:tow|i ?tow|time of week|seconds of week|sow|gps ?sec|gps ?seconds)", "tow"),
    (r"(?:mag|magnetic)? ?(?:var|variation|declination|decl)|magvar|magdec", "variation"),
    (r"icao ?24|mmsi|callsign|tail(?: number)?|vehicle(?: id)?|id|uas id|registration|icao", "key"),
)
_COMPILED = tuple((re.compile(pattern), topic, field, kind, sign) for pattern, topic, field, kind, sign in _FIELDS)
_COMPILED_SIGMAS = tuple(
    (re.compile(f"{what} ?(?:{axes})|(?:{axes}) ?{what}"), field, kind, is_variance)
    for what, is_variance in ((_SIGMA, False), (_SQUARE, True))
    for axes, field, kind in _SIGMAS
)
# The matrix of a position in a robot's message: rows and columns east, north, up.
_COMPILED_SIGMAS += tuple(
    (re.compile(f"(?:position )?cov(?:ariance)? ?{place}"), field, "m", True)
    for place, field in ((0, "position_east_sigma_m"), (4, "position_north_sigma_m"), (8, "vertical_sigma_m"))
)
_COMPILED_TRIADS = tuple((re.compile(pattern), topic, field, kind) for pattern, topic, field, kind in _TRIADS)
_COMPILED_ROLES = tuple((re.compile(pattern), role) for pattern, role in _ROLES)


def words_of(name: str) -> list[str]:
    """Return the words of a name without what stands in brackets.

    Examples
    --------
    >>> words_of("OSD.xSpeed [m/s]"), words_of("GPS_numSat"), words_of("AltMSL")
    (['osd', 'x', 'speed'], ['gps', 'num', 'sat'], ['alt', 'msl'])
    """
    outside = _IN_BRACKETS.sub(" ", name)
    return [word.lower() for part in _PARTING.split(outside) for word in _CAMEL.split(part) if word]


def in_brackets(name: str) -> list[str]:
    """Return what stands in the brackets of a name.

    Examples
    --------
    >>> in_brackets("speed(m/s)"), in_brackets("Lat [deg]"), in_brackets("v")
    (['m/s'], ['deg'], [])
    """
    return [next(filter(None, found), "").strip() for found in _IN_BRACKETS.findall(name)]


def unit_in(texts: Iterable[str], kind: str) -> tuple[str, float] | None:
    """Return unit and scale that a text of a column states, for fields in a unit.

    Examples
    --------
    >>> unit_in(["(m/s)"], "mps"), unit_in(["mph"], "mps"), unit_in(["m"], "mps")
    (('mps', 1.0), ('mps', 0.44704), None)
    """
    known = _UNITS_BY_KIND.get(kind, {})
    for text in texts:
        plain = " ".join(text.lower().strip(" ()[]{}").split())
        for word in (plain, *plain.split()):
            if word in known:
                return known[word]
    return None


@lru_cache(maxsize=20_000)
def meaning_of(name: str, units: tuple[str, ...] = ()) -> Meaning | None:
    """Return the meaning of a column by its name; None where it has none that is known.

    Parameters
    ----------
    name : str
    units : tuple of str
        Cells of the column in rows of units.

    Examples
    --------
    >>> meaning_of("GPS_Speed [kt]").target, meaning_of("GPS_Speed [kt]").unit
    ('gnss.ground_speed_mps', 'kt')
    >>> meaning_of("velN").target, meaning_of("vSpeed").sign, meaning_of("home.latitude")
    ('gnss.velocity_north_mps', -1, None)
    >>> meaning_of("accX").target, meaning_of("timestamp").role
    ('imu.accel_x_mps2', 'time')
    """
    if not name or len(name) > MOST_CHARACTERS:
        return None
    words, said = words_of(name), (*in_brackets(name), *units)
    is_gnss, is_ins = not _GNSS.isdisjoint(words), not _INS.isdisjoint(words)
    for kept in ([word for word in words if word not in _PADDING], words):
        found = _meaning(kept, said) if kept else None
        if found is not None:
            topic = found.topic
            if topic in ("gnss", "ins"):
                topic = "gnss" if is_gnss and not is_ins else "ins" if is_ins and not is_gnss else topic
                topic = topic if _has(topic, found.field) else found.topic
            field = found.field
            if (topic, field) == ("ins", "true_heading_deg") and is_gnss and not is_ins:
                topic, field = "gnss", "track_deg"  # what a receiver calls its heading
            is_magnetic = field in ("true_heading_deg", "track_deg") and any(map(_MAGNETIC.fullmatch, said))
            if is_magnetic and field == "true_heading_deg":
                field = "magnetic_heading_deg"
            return replace(found, topic=topic, field=field, is_magnetic=is_magnetic)
    return None


def _has(topic: str, field: str) -> bool:
    from groundstation.base.signals import field_of

    return field_of(topic, field) is not None


def _meaning(words: list[str], said: tuple[str, ...]) -> Meaning | None:
    """Return the meaning of words; the last of them may be a unit."""
    for taken in range(min(3, len(words))):
        text, tail = " ".join(words[: len(words) - taken]), words[len(words) - taken :]
        for pattern, topic, field, kind, sign in _COMPILED:
            if pattern.fullmatch(text) and (found := _with_unit(kind, said, tail)) is not None:
                return Meaning(topic, field, sign, "", *found)
        for pattern, field, kind, is_variance in _COMPILED_SIGMAS:
            units = tuple(_SQUARED.sub(r"\1", text) for text in said) if is_variance else said
            if pattern.fullmatch(text) and (found := _with_unit(kind, units, tail)) is not None:
                return Meaning("gnss", field, 1, "", *found, is_variance=is_variance)
        for pattern, topic, field, kind in _COMPILED_TRIADS:
            match = pattern.fullmatch(text)
            if match and (found := _with_unit(kind, said, tail)) is not None:
                axis = next(group for group in match.groups() if group)
                axis = _BY_ANGLE.get(axis, axis)
                names = _BODY if topic == "magnetometer" else _AXES
                return Meaning(topic, field.format(names[axis]), 1, "", *found)
        for pattern, role in _COMPILED_ROLES:
            if pattern.fullmatch(text) and (not taken or " ".join(tail) in TIME_WORDS):
                texts = [*(text.lower().strip(" ()[]") for text in said), " ".join(tail), words[-1]]
                return Meaning(role=role, unit=next((TIME_WORDS[one] for one in texts if one in TIME_WORDS), ""))
    return None


def _with_unit(kind: str, said: tuple[str, ...], tail: list[str]) -> tuple[str, float] | None:
    """Return the unit that is told, "" for none; None where the last words are no unit."""
    if tail:
        return unit_in(["/".join(tail), " ".join(tail), "".join(tail)], kind)
    return unit_in(said, kind) or (None if _is_of_another(said, kind) else ("", 1.0))


def _is_of_another(said: tuple[str, ...], kind: str) -> bool:
    """Tell whether the units that are told are those of other quantities."""
    plain = {text.lower().strip(" ()[]{}") for text in said}
    if kind == "deg":
        plain -= {"m", "t"}  # magnetic, true
    return not plain.isdisjoint(_OTHER) or any(not plain.isdisjoint(words) for words in _UNITS_BY_KIND.values())
