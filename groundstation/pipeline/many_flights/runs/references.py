"""References for many flights: files, or folders of files.

Each flight takes the one of its time.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.base.errors import UnclaimedLogError, UsageError
from groundstation.pipeline.many_flights.inputs import collect
from groundstation.pipeline.one_flight.configuration import Configuration, References
from groundstation.pipeline.one_flight.log import open_log
from groundstation.systems import systems


def judged_by(configuration: Configuration, references: Sequence[Path], *, is_one_log: bool) -> Configuration:
    """The configuration with references; as it is where there are none.

    Parameters
    ----------
    configuration : Configuration
    references : sequence of Path
        Files and folders; what no reader claims in a folder is passed over.
    is_one_log : bool
        Whether a single log was named: then it is an error when none is of its time.

    Raises
    ------
    UsageError
        When there is no such file, or a folder holds none.
    UnclaimedLogError
        When no reader claims a file that was named.
    """
    if not references:
        return configuration
    found = []
    for one in collect(references):
        try:
            open_log(one.path)
        except UnclaimedLogError:
            if one.is_named:
                raise
            continue
        found.append(one.path)
    if not found:
        raise UsageError(", ".join(map(str, references)), "no reference in it")
    return replace(configuration, references=References(tuple(found), is_one_log, _topic_of(configuration)))


def _topic_of(configuration: Configuration) -> str:
    """Return the topic that the user names in the settings of what judges; empty without."""
    judging = (one.settings_table for one in systems().analyses if one.judges)
    named = (getattr(configuration.settings.analyses[table], "topic", "") for table in judging)
    return next(filter(None, named), "")
