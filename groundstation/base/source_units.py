"""Units of fields that are not canonical, as the log itself states them.

They are kept with the flight's metadata, topic by topic. ``units.raw.IMU`` = ``"GyrX rad/s, MagX Gauss x 0.001"``:
field, unit, and the factor that is left in the values.
"""

from collections.abc import Iterable, Mapping

PREFIX = "units."


def units_entry(units: Mapping[str, str]) -> str:
    """Return the text for the metadata: each field with its unit, fields without one left out.

    Examples
    --------
    >>> units_entry({"AltInd": "ft", "Lcl Time": "", "OAT": "deg C"})
    'AltInd ft, OAT deg C'
    """
    return ", ".join(f"{field} {unit}" for field, unit in units.items() if unit and "," not in field + unit)


def source_units(metadata: Mapping[str, str], topic: str, fields: Iterable[str]) -> dict[str, str]:
    """Return the units that the log states for fields of a topic.

    An instance (``raw.IMU.1``) has the units of its type.

    Examples
    --------
    >>> found = {"units.raw.IMU": "GyrX rad/s, MagX Gauss x 0.001"}
    >>> source_units(found, "raw.IMU.1", ("GyrX", "Gyr", "MagX"))
    {'GyrX': 'rad/s', 'MagX': 'Gauss x 0.001'}
    """
    text = metadata.get(PREFIX + topic) or metadata.get(PREFIX + topic.rpartition(".")[0], "")
    entries = text.split(", ") if text else []
    units = {}
    for field in fields:
        told = next((entry for entry in entries if entry.startswith(f"{field} ")), "")
        if told:
            units[field] = told[len(field) + 1 :]
    return units
