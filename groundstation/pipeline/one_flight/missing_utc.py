"""Next step where logs have no common clock: what gives UTC to a log that has none."""

from collections.abc import Iterable
from pathlib import Path

from groundstation.pipeline.one_flight.log import Log
from groundstation.systems.joining import NoCommonClockError

TAG = ".tag"
BY_PROFILE, FLAT_CSV = "csv-profile", "flat-csv"


def with_next_step(error: NoCommonClockError, without_utc: Iterable[Log]) -> NoCommonClockError:
    """Return the error with the file or the setting that gives UTC to each log without it."""
    next_step = "; ".join(filter(None, map(_utc_setting, without_utc)))
    return NoCommonClockError(error.where, error.found, error.expected, next_step)


def _utc_setting(log: Log) -> str:
    """Return the file or the setting that gives a table UTC.

    Empty for a log of another format.
    """
    name, reader = log.path.name, log.source.reader
    if reader.startswith(BY_PROFILE):
        profile = "a profile of your own" if log.profile is None else log.profile.name
        tag = Path(f"{log.path}{TAG}")
        if tag.is_file():
            return f"{name} gets UTC by {tag.name} beside it: rtklib_tag = true under [time] of {profile}"
        return f"{name} gets UTC by start_utc under [metadata.set] of {profile}, or by {tag.name} of RTKLIB beside it"
    return f"{name} gets UTC by a line `# start_utc: ...` on top" if reader.startswith(FLAT_CSV) else ""
