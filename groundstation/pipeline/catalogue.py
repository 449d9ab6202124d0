"""``list``: the analyses, what each needs, and whether a log has it."""

import tempfile
from pathlib import Path
from typing import Any

from groundstation.base.errors import NotAssessableError
from groundstation.pipeline.configuration import Configuration

HEADING: dict[str, Any] = {
    "kind": "analysis",
    "name": "heading",
    "title": "INS heading error and correction from GNSS on straight taxi (Markelov et al. 2015)",
    "needs": "ins heading (true or magnetic), gnss velocities, proof of ground contact (weight on wheels, a landed "
    "flag or a standstill to start from), straight taxi above 6 m/s",
}


def catalogue(log: Path | None = None, profile: Path | None = None) -> list[dict[str, Any]]:
    """List analyses, formats, scenarios and studies; with a log, whether each analysis would run on it and why not.

    Raises
    ------
    UsageError, UnreadableLogError
        When the log is missing or cannot be read.
    """
    if log is None:
        return [HEADING, *_formats(), *_scenarios()]
    return [_with_answer(HEADING, log, profile)]


def _with_answer(entry: dict[str, Any], path: Path, profile: Path | None) -> dict[str, Any]:
    from groundstation.base.errors import UsageError
    from groundstation.pipeline.analyse import estimate_heading, user_settings
    from groundstation.pipeline.convert import convert_log
    from groundstation.pipeline.flight import read_flight
    from groundstation.pipeline.log import open_log

    if not path.exists():
        raise UsageError(str(path), "no such file")
    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        mcap = Path(folder) / "flight.mcap"
        flight = read_flight(mcap, convert_log(open_log(path, profile), mcap))
    configuration = Configuration()
    try:
        estimate_heading(flight, configuration, user_settings(configuration))
    except NotAssessableError as error:
        return {**entry, "would_run": False, "reason": str(error)}
    return {**entry, "would_run": True, "reason": ""}


def _formats() -> list[dict[str, Any]]:
    from groundstation.readers import registry

    return [
        {"kind": "format", "name": entry.name, "title": entry.summary, "needs": f"{entry.origin}, found by content"}
        for entry in registry.formats()
    ]


def _scenarios() -> list[dict[str, Any]]:
    from groundstation.simulation.scenario import load_scenario, scenario_names

    return [
        {"kind": "scenario", "name": name, "title": load_scenario(name).title, "needs": "nothing"}
        for name in scenario_names()
    ]
