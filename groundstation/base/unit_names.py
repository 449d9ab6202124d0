"""Table of units: suffix in names, sign in text, spelling in plain letters, decimals."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple


class UnitName(NamedTuple):
    """Unit as text prints it (``sign``), its spelling without special signs, and its decimals."""

    sign: str
    plain: str = ""
    decimals: int | None = None

    @property
    def spelled(self) -> str:
        """Spelling in plain letters."""
        return self.plain or self.sign


# By suffix of a name. A suffix that ends like a shorter one stands before it.
UNITS: Mapping[str, UnitName] = MappingProxyType(
    {
        "mps_per_sqrt_s": UnitName("m/s/√s"),
        "m_per_sqrt_s": UnitName("m/√s"),
        "m_per_sqrt_m": UnitName("m/√m"),
        "deg_per_sqrt_s": UnitName("°/√s", "deg/√s"),
        "deg_per_sqrt_h": UnitName("°/√h", "deg/√h"),
        "dphph_per_sqrt_h": UnitName("°/h²/√h", "deg/h²/√h"),
        "dph_per_sqrt_h": UnitName("°/h/√h", "deg/h/√h"),
        "deg_per_h": UnitName("°/h", "deg/h"),
        "deg_per_s": UnitName("°/s", "deg/s"),
        "nt_per_a": UnitName("nT/A"),
        "per_deg": UnitName("1/°", "1/deg"),
        "per_h": UnitName("/h"),
        "per_s": UnitName("/s"),
        "deg": UnitName("°", "deg", 4),
        "rad": UnitName("rad"),
        "arcmin": UnitName("′", "arcmin", 2),
        "arcsec": UnitName("arcsec", decimals=3),
        "dphph": UnitName("°/h²", "deg/h per h", 6),
        "dph": UnitName("°/h", "deg/h", 6),
        "nmiph": UnitName("nmi/h", decimals=4),
        "mps2": UnitName("m/s²"),
        "mps": UnitName("m/s", decimals=4),
        "dps": UnitName("°/s", "deg/s"),
        "mhz": UnitName("MHz"),
        "dbhz": UnitName("dB-Hz", decimals=1),
        "hz": UnitName("Hz", decimals=4),
        "dots": UnitName("dots"),
        "ppm": UnitName("ppm"),
        "percent": UnitName("%"),
        "nt": UnitName("nT", decimals=2),
        "m2": UnitName("m²"),
        "ms": UnitName("ms"),
        "us": UnitName("µs"),
        "ns": UnitName("ns"),
        "s": UnitName("s", decimals=3),
        "m": UnitName("m", decimals=3),
        "a": UnitName("A"),
        "c": UnitName("°C", "C", 2),
    }
)


def split_unit(name: str) -> tuple[str, UnitName | None]:
    """Split a name into the name without its unit, and the unit; None where it has none.

    Examples
    --------
    >>> split_unit("velocity_north_mps"), split_unit("gdop")
    (('velocity_north', UnitName(sign='m/s', plain='', decimals=4)), ('gdop', None))
    """
    for suffix, unit in UNITS.items():
        if name.endswith("_" + suffix):
            return name[: -len(suffix) - 1], unit
    return name, None


def units_of(names: Iterable[str]) -> dict[str, str]:
    """Return units in plain letters by name, for the names that have one.

    Examples
    --------
    >>> units_of(("true_heading_deg", "at.time_s", "gdop"))
    {'true_heading_deg': 'deg', 'at.time_s': 's'}
    """
    found = ((str(name), split_unit(str(name))[1]) for name in names)
    return {name: unit.spelled for name, unit in found if unit is not None}
