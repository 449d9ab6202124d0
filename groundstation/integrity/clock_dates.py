"""Dates that a log cannot have, or hardly can: a receiver miscounted its GPS week."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

from groundstation.base.records import Remark
from groundstation.base.timescales import (
    GPS_EPOCH_NS,
    ROLLOVER_NS,
    ROLLOVER_WEEKS,
    WEEK_NS,
    iso_to_utc_ns,
    utc_ns_to_iso,
)
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.ledger import TopicCounts

ROLLED_OVER, FIRST_WEEK = "week_rollover", "date_of_rollover"  # codes of remarks
# Reader -> the year its format came. Others hold what was recorded with a receiver of this century.
_YEARS: Mapping[str, int] = MappingProxyType(
    {"px4-ulog": 2016, "dataflash": 2010, "tlog": 2009, "chapter10": 2004, "csv profile garmin-g1000": 2006}
)
_USUAL_YEAR = 2000
_OF_ANY_YEAR = ("flightdata-hdf5", "sbet")  # recorders without a receiver, and dates of a file's name


def doubtful_dates(
    reader: str, clock: ClockModel, topics: Sequence[TopicCounts], remarks: Sequence[Remark]
) -> Iterator[Remark]:
    """Return the remark on the date of a log by its clock, where there is one."""
    if clock.is_absolute and topics:
        doubt = doubtful_date(reader, min(topic.first_ns for topic in topics), remarks)
        if doubt is not None:
            yield doubt


def doubtful_date(reader: str, utc_ns: int, remarks: Iterable[Remark]) -> Remark | None:
    """Remark on the date on which a log begins; None if it is possible or already remarked on.

    Parameters
    ----------
    reader : str
        Name of the reader, with its profile.
    utc_ns : int
        Corrected time of the first record.
    remarks : iterable of Remark
        Those of the reader.

    Examples
    --------
    >>> doubtful_date("receiver", iso_to_utc_ns("1999-09-13T10:00:00Z")[0], ()).text
    'the log begins on 1999-09-13, before 2000: if the GPS week rolled over, it is of 2019-04-29; the time is kept'
    >>> doubtful_date("receiver", iso_to_utc_ns("2024-05-06T10:00:00Z")[0], ()) is None
    True
    """
    if reader in _OF_ANY_YEAR or any(one.code == ROLLED_OVER for one in remarks):
        return None
    day, year = utc_ns_to_iso(utc_ns, 0)[:10], _YEARS.get(reader, _USUAL_YEAR)
    if utc_ns < iso_to_utc_ns(f"{year}-01-01T00:00:00Z")[0]:
        before = f"before {year}" if year == _USUAL_YEAR else f"and its format came in {year} or later"
        text = (
            f"the log begins on {day}, {before}: if the GPS week rolled over, it is of "
            f"{utc_ns_to_iso(utc_ns + ROLLOVER_NS, 0)[:10]}; the time is kept"
        )
        return Remark(ROLLED_OVER, text)
    week = (utc_ns - GPS_EPOCH_NS) // WEEK_NS
    if week % ROLLOVER_WEEKS == 0:
        text = (
            f"the log begins on {day}, in the week after the GPS week rolled over: a receiver without its week says so"
        )
        return Remark(FIRST_WEEK, text)
    return None
