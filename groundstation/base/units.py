"""Factors to SI units and degrees, each exact by definition.

Readers multiply in the line that renames.

Sources: The International System of Units (BIPM, 9th ed. 2019); international foot and nautical mile (1959, 1929).
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

M_PER_FOOT = 0.3048
M_PER_NAUTICAL_MILE = 1852.0
MPS_PER_KNOT = M_PER_NAUTICAL_MILE / 3600.0
MPS_PER_KMH = 1.0 / 3.6
MPS_PER_FOOT_PER_MINUTE = M_PER_FOOT / 60.0
MPS2_PER_G = 9.80665
DEG_PER_RAD = 180.0 / math.pi
ARCMIN_PER_DEG = 60.0
NT_PER_GAUSS = 1e5
NS_PER_S = 1_000_000_000
S_PER_H = 3600.0
DOTS_PER_FULL_SCALE = 2.0  # full scale of a course deviation indicator
LIGHT_MPS = 299_792_458.0

# Unit names a profile may use -> (unit of the canonical field, factor).
CONVERSIONS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "deg": ("deg", 1.0),
        "rad": ("deg", DEG_PER_RAD),
        "arcmin": ("deg", 1.0 / 60.0),
        "arcsec": ("deg", 1.0 / 3600.0),
        "deg1e7": ("deg", 1e-7),
        "semicircle": ("deg", 180.0),
        "m": ("m", 1.0),
        "mm": ("m", 1e-3),
        "cm": ("m", 1e-2),
        "km": ("m", 1e3),
        "ft": ("m", M_PER_FOOT),
        "nmi": ("m", M_PER_NAUTICAL_MILE),
        "mps": ("mps", 1.0),
        "cmps": ("mps", 1e-2),
        "mmps": ("mps", 1e-3),
        "kt": ("mps", MPS_PER_KNOT),
        "kmh": ("mps", MPS_PER_KMH),
        "fpm": ("mps", MPS_PER_FOOT_PER_MINUTE),
        "fps": ("mps", M_PER_FOOT),
        "dps": ("dps", 1.0),
        "radps": ("dps", DEG_PER_RAD),
        "mps2": ("mps2", 1.0),
        "g": ("mps2", MPS2_PER_G),
        "fps2": ("mps2", M_PER_FOOT),
        "nt": ("nt", 1.0),
        "ut": ("nt", 1e3),
        "gauss": ("nt", NT_PER_GAUSS),
        "mgauss": ("nt", NT_PER_GAUSS * 1e-3),
        "a": ("a", 1.0),
        "ma": ("a", 1e-3),
        "dots": ("dots", 1.0),
        "fsd": ("dots", DOTS_PER_FULL_SCALE),
        "mhz": ("mhz", 1.0),
        "dbhz": ("dbhz", 1.0),
        "s": ("s", 1.0),
        "ms": ("s", 1e-3),
        "us": ("s", 1e-6),
        "c": ("c", 1.0),
        "": ("", 1.0),
        "percent": ("", 0.01),
    }
)


def factor_to(unit: str, wanted: str) -> float | None:
    """Return the factor from a unit to that of a field.

    None when it is of another kind, or unknown.

    Examples
    --------
    >>> factor_to("rad", "rad"), factor_to("kt", "mps") == MPS_PER_KNOT, factor_to("m", "deg")
    (1.0, True, None)
    """
    measured, factor = CONVERSIONS.get(unit, (None, 0.0))
    if measured == "deg" and wanted == "rad":
        return 1.0 if unit == "rad" else factor / DEG_PER_RAD
    return factor if measured == wanted else None


def units_of(wanted: str) -> tuple[str, ...]:
    """Return the units that a field may be given in, by name.

    Examples
    --------
    >>> units_of("a"), units_of("c")
    (('a', 'ma'), ('c',))
    """
    return tuple(name for name in CONVERSIONS if name and factor_to(name, wanted) is not None)
