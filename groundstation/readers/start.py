"""UTC of a recorder's time zero, from the metadata of a log or a clock that it carries."""

import math
from collections.abc import Mapping

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Int64Array, Remark
from groundstation.base.timescales import iso_to_utc_ns

_FIRST_UTC_NS = iso_to_utc_ns("1678-01-01T00:00:00Z")[0]  # what 64 bits of nanoseconds hold
_LAST_UTC_NS = iso_to_utc_ns("2262-01-01T00:00:00Z")[0]
_REFERENCES = {
    "reference.parking_heading_deg": (-360.0, 720.0, "a heading in degrees"),
    "reference.parking_heading_sigma_deg": (math.ulp(0.0), 360.0, "degrees above 0"),
}


def unusable_references(metadata: Mapping[str, str]) -> list[Remark]:
    """A remark for each reference in the metadata that is no number in its range.

    Examples
    --------
    >>> [remark.text for remark in unusable_references({"reference.parking_heading_deg": "north"})]
    ["reference.parking_heading_deg: 'north' is not a heading in degrees: there is no such reference"]
    """
    remarks = []
    for key, (low, high, what) in _REFERENCES.items():
        text = metadata.get(key, "")
        if text and not low <= _number(text) <= high:
            remarks.append(
                Remark("unreadable_metadata", f"{key}: {text[:40]!r} is not {what}: there is no such reference")
            )
    return remarks


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def utc_of_zero(metadata: Mapping[str, str]) -> tuple[int | None, list[Remark]]:
    """UTC nanoseconds of device time zero by ``start_utc``, None without it, and what was assumed.

    Examples
    --------
    >>> utc_of_zero({"start_utc": "1970-01-01T00:00:02Z"}), utc_of_zero({})
    ((2000000000, []), (None, []))
    """
    text = metadata.get("start_utc", "")
    if not text:
        return None, []
    try:
        utc_ns, named_zone = iso_to_utc_ns(text)
        if not _FIRST_UTC_NS <= utc_ns < _LAST_UTC_NS:
            raise GroundstationError("time", repr(text), "a year from 1678 to 2261")
    except GroundstationError as error:
        return None, [Remark("unreadable_metadata", f"start_utc: {error}; the flight has no absolute time")]
    return utc_ns, [] if named_zone else [Remark("assumed_utc", f"start_utc {text} names no zone: read as UTC")]


def told_at_zero(told: Int64Array, device: Int64Array) -> tuple[int, Int64Array]:
    """What another clock told when the recorder's was at zero: the median, and what each reading says, shape (m,).

    Of readings that repeat a time only the first counts, for the others are older than they say: a clock may tell whole
    seconds. When the log's first time was told first is not known where times repeat.

    Parameters
    ----------
    told, device : ndarray of int64, shape (n,)
        Times by both clocks in the order of the log, in one unit; n at least 1.

    Examples
    --------
    >>> told_at_zero(np.array([70, 70, 80, 80, 80, 90]), np.array([5, 7, 12, 14, 16, 22]))
    (68, array([68, 68]))
    """
    is_first = np.append(True, told[1:] != told[:-1])
    if not is_first.all():
        is_first[0] = not is_first[1:].any()
    zeros = (told - device)[is_first]
    return int(np.sort(zeros)[len(zeros) // 2]), zeros  # a float has no room for microseconds since 1970
