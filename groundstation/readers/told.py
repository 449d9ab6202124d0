"""Unit, north and height of a column, as far as its header states them.

``GPS Ground Track (deg true)``, ``GPS Altitude (WGS84 ft)``; or in a row of its own, ``degrees``, ``ft msl``.
"""

import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import CONVERSIONS

HPA_PER_INHG = 33.8638866667
_MPS_PER_MPH = 0.44704
_SPELLED: Mapping[str, str] = MappingProxyType(
    {
        "deg": "deg degs degree degrees degt degm ° @",  # @: the sign of OpenTX
        "rad": "rad radian radians",
        "ft": "ft feet foot",
        "m": "m mt meter meters metre metres",
        "km": "km",
        "nmi": "nm nmi",
        "kt": "kt kts knot knots",
        "mps": "m/s m/sec mps",
        "kmh": "km/h kph kmh",
        "mph": "mph",
        "fpm": "fpm ft/min",
        "fps": "fps ft/s ft/sec f/s",
        "dps": "deg/s deg/sec dps",
        "radps": "rad/s rad/sec",
        "mps2": "m/s2 m/s^2 m/s/s",
        "g": "g",
        "inhg": "inch inhg hg",
        "hpa": "hpa mb mbar",
        "fsd": "fsd",
        "mhz": "mhz",
        "a": "a amp amps",
        "ma": "ma",
    }
)
_UNITS = {**CONVERSIONS, "mph": ("mps", _MPS_PER_MPH), "inhg": ("inhg", 1.0), "hpa": ("inhg", 1.0 / HPA_PER_INHG)}
_BY_WORD = {word: _UNITS[unit] for unit, words in _SPELLED.items() for word in words.split()}
_IN_PARENTHESES = re.compile(r"\(([^()]*)\)")
_TRUE = re.compile(r"\btrue\b|\bdegt\b|\bdeg t\b|^°? ?t$", re.IGNORECASE)
_MAGNETIC = re.compile(r"\bmag(?:netic)?\b|\bdegm\b|\bdeg m\b|^°? ?m$", re.IGNORECASE)
_ELLIPSOID = re.compile(r"\bwgs(?:[ -]?84)?\b|\bellipsoid(?:al)?\b|\bhae\b", re.IGNORECASE)
_SEA = re.compile(r"\ba?msl\b|\bgeoid\b|\begm(?:96|08|2008)?\b", re.IGNORECASE)


@dataclass(frozen=True)
class ColumnFacts:
    """Facts that a header states of one column; empty where it states none.

    Parameters
    ----------
    unit : (str, float), optional
        Unit of fields of that dimension, and the factor to it: ``("m", 0.3048)``.
    north : {'', 'true', 'magnetic'}
    height : {'', 'ellipsoid', 'msl'}
    """

    unit: tuple[str, float] | None = None
    north: str = ""
    height: str = ""


def bare(name: str) -> str:
    """Return the name of a column without parentheses and their content.

    Examples
    --------
    >>> bare("GPS Velocity E (m/sec)"), bare("TRK")
    ('GPS Velocity E', 'TRK')
    """
    return " ".join(_IN_PARENTHESES.sub(" ", name).split())


def told(names: Iterable[str], units: Iterable[str] = ()) -> ColumnFacts:
    """Read the names of a column and its cells in rows of units; the first one counts.

    Examples
    --------
    >>> told(["GPS Ground Track (deg true)"])
    ColumnFacts(unit=('deg', 1.0), north='true', height='')
    >>> told(["AltMSL"], ["ft msl"]).height, told(["HDG", "Magnetic Heading (deg)"]).north
    ('msl', 'magnetic')
    """
    names = list(names)
    inside = [*(text for name in names for text in _IN_PARENTHESES.findall(name)), *units]
    said = [*inside, *map(bare, names)]
    return ColumnFacts(
        next((found for text in inside if (found := _unit(text)) is not None), None),
        _word(said, {"true": _TRUE, "magnetic": _MAGNETIC}),
        _word(said, {"ellipsoid": _ELLIPSOID, "msl": _SEA}),
    )


def _unit(text: str) -> tuple[str, float] | None:
    words = (text.strip().lower(), *text.lower().split())
    return next((_BY_WORD[word] for word in words if word in _BY_WORD), None)


def _word(texts: Iterable[str], words: Mapping[str, re.Pattern[str]]) -> str:
    """Return the meaning whose words a text has, if it has those of no other."""
    for text in texts:
        found = [meaning for meaning, pattern in words.items() if pattern.search(text.strip())]
        if len(found) == 1:
            return found[0]
    return ""
