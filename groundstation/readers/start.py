"""UTC of a recorder's time zero, from the metadata of a log."""

from collections.abc import Mapping

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Remark
from groundstation.base.timescales import iso_to_utc_ns


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
    except GroundstationError as error:
        return None, [Remark("unreadable_metadata", f"start_utc: {error}; the flight has no absolute time")]
    return utc_ns, [] if named_zone else [Remark("assumed_utc", f"start_utc {text} names no zone: read as UTC")]
