"""Verb ``check --together``: logs of one flight checked as one.

They are joined as ``run --together`` joins them.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from groundstation.base.errors import UsageError
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.join import join_files
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.outcome import reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.verbs.check import CheckedLog, checked_with_flight, require_purpose_of, unread, with_purpose


def check_together(
    paths: Sequence[Path],
    configuration: Configuration,
    *,
    purpose: str = "",
    fail_on: str = "none",
    listen: Listener = silent,
) -> tuple[CheckedLog, ...]:
    """Check logs of one flight as one: put them on one clock, and judge what all of them give.

    Parameters
    ----------
    purpose : str
        Name of an analysis of flights: say whether the logs together can be used for it.

    Raises
    ------
    UsageError
        When a log is missing or given twice, there is but one, or the purpose is that of a session.
    """
    if require_purpose_of(purpose):
        raise UsageError("--together", f"--for {purpose}, of several aircraft", "an analysis of one flight")
    name = " + ".join(path.name for path in paths)
    listen(Event("begin", total=1))
    with TemporaryDirectory(prefix="groundstation-") as folder:
        target = Path(folder) / "together.mcap"
        try:
            converted = join_files(paths, target, configuration, listen)
            log = open_log(target, None, configuration.icds)
            checked, flight = checked_with_flight(log, configuration.thresholds, fail_on, with_flight=bool(purpose))
        except UsageError:
            raise
        except Exception as error:
            reason, trace = reason_of(name, error)
            checked = unread(Path(name), reason, trace)
        else:
            size = sum(path.stat().st_size for path in paths)
            facts = {**checked.facts, "file": converted.info.source_name, "size": f"{size} bytes"}
            checked = replace(checked, outcome=replace(checked.outcome, source=name), facts=facts)
            if flight is not None:
                checked = with_purpose(checked, purpose, flight, configuration, fail_on)
    listen(Event("end", name, checked.outcome.text))
    return (checked,)
