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
INERTIAL: dict[str, Any] = {
    "kind": "analysis",
    "name": "inertial",
    "title": "INS errors estimated against GNSS, two channels of six states (Neusypin et al. 2003)",
    "needs": "ins and gnss positions (velocities too where there are any), five minutes of both together",
}
FORECAST: dict[str, Any] = {
    "kind": "analysis",
    "name": "forecast",
    "title": "forecast of the INS errors without GNSS, replayed all over the flight",
    "needs": "what inertial needs, of an INS that GNSS does not correct; a calibration needs one Schuler period",
}
LATENCY: dict[str, Any] = {
    "kind": "analysis",
    "name": "latency",
    "title": "latency of GNSS, barometer, magnetometer and further INS behind the INS, from ordinary motion",
    "needs": "ins velocity with gnss velocities, vertical speed with baro, or attitude with a magnetometer; turns and "
    "climbs",
}
MAGNETIC: dict[str, Any] = {
    "kind": "analysis",
    "name": "magnetic",
    "title": "magnetic deviation from opposite turns in flight, with its coefficients A to E",
    "needs": "magnetometer on three axes, ins roll, pitch and a true heading that no magnetometer corrects, a turn "
    "each way at one steady bank that together cover the circle, level flight to judge by",
}
MAGNETIC_GROUND: dict[str, Any] = {
    "kind": "analysis",
    "name": "magnetic_ground",
    "title": "errors of the installed heading sensor on straight ground runs",
    "needs": "ins magnetic heading, gnss velocities and positions, a date, proof of ground contact, straight runs "
    "above 3 m/s",
}
ANALYSES = (HEADING, INERTIAL, FORECAST, LATENCY, MAGNETIC, MAGNETIC_GROUND)


def catalogue(log: Path | None = None, profile: Path | None = None) -> list[dict[str, Any]]:
    """List analyses, formats, scenarios and studies; with a log, whether each analysis would run on it and why not.

    Raises
    ------
    UsageError, UnreadableLogError
        When the log is missing or cannot be read.
    """
    if log is None:
        return [*ANALYSES, *_formats(), *_scenarios(), *_studies()]
    return _with_answers(log, profile)


def _with_answers(path: Path, profile: Path | None) -> list[dict[str, Any]]:
    """The analyses, each with whether it would run on a log and the reason why not."""
    from groundstation.base.errors import UsageError
    from groundstation.pipeline.analyse import estimate_heading, user_settings
    from groundstation.pipeline.convert import convert_log
    from groundstation.pipeline.flight import read_flight
    from groundstation.pipeline.inertial import analyse_inertial
    from groundstation.pipeline.latency import analyse_latency
    from groundstation.pipeline.log import open_log
    from groundstation.pipeline.magnetic import analyse_magnetic
    from groundstation.pipeline.magnetic_ground import analyse_ground_deviation
    from groundstation.tables.phases import flight_phases

    if not path.exists():
        raise UsageError(str(path), "no such file")
    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        mcap = Path(folder) / "flight.mcap"
        flight = read_flight(mcap, convert_log(open_log(path, profile), mcap))
    configuration = Configuration()
    settings, reasons = user_settings(configuration), {}
    try:
        estimate_heading(flight, configuration, settings)
    except NotAssessableError as error:
        reasons["heading"] = str(error).removeprefix("heading: ")
    phases = flight_phases(flight)
    answers = analyse_inertial(flight, phases, settings.inertial)
    latency = analyse_latency(flight, settings.latency, answers.inertial)
    magnetic = analyse_magnetic(flight, phases, settings.magnetic, inertial=answers.inertial, latencies=latency.latency)
    ground = analyse_ground_deviation(flight, phases, settings.magnetic_ground, latencies=latency.latency)
    lacking = (
        *answers.not_assessable,
        *latency.not_assessable,
        *magnetic.not_assessable,
        *ground.not_assessable,
    )
    reasons |= {entry.analysis: entry.reason for entry in lacking}
    if "inertial" in reasons:
        reasons["forecast"] = reasons["inertial"]
    return [
        {**entry, "would_run": entry["name"] not in reasons, "reason": reasons.get(entry["name"], "")}
        for entry in ANALYSES
    ]


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


def _studies() -> list[dict[str, Any]]:
    from groundstation.pipeline.synthesis import STUDIES

    return [
        {"kind": "study", "name": name, "title": f"study: {title}", "needs": "nothing"}
        for name, title in STUDIES.items()
    ]
