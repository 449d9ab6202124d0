"""Verb ``list``: the analyses, what each needs, and whether a log has it."""

from pathlib import Path
from typing import Any

from groundstation.base.ledger import Ledger
from groundstation.base.signals import without_icd
from groundstation.pipeline.many_flights.inputs import file_in, is_session
from groundstation.results.file_names import SUMMARY
from groundstation.results.files import load_document
from groundstation.results.recorded import unnamed_buses
from groundstation.systems import systems


def catalogue(log: Path | None = None, profile: Path | None = None, icds: tuple[str, ...] = ()) -> list[dict[str, Any]]:
    """List analyses, formats, scenarios and studies.

    With a log, tell whether each analysis would run on it and why not; ``icds`` name the words of its buses.

    Raises
    ------
    UsageError, UnreadableLogError
        When the log is missing or cannot be read.
    """
    if log is None:
        return [
            *_analyses(),
            *_session_analyses(),
            *_formats(),
            *_scenarios(),
            *_approaches(),
            *_inertial_units(),
            *_several_ins(),
            *_sessions(),
            *_plans(),
            *_studies(),
            *_failures(),
        ]
    folder = log.parent if log.name == SUMMARY else log
    return _of_a_session(folder) if is_session(folder) else _with_answers(log, profile, icds)


def _analyses() -> list[dict[str, Any]]:
    return [
        {"kind": "analysis", "name": analysis.name, "title": analysis.title, "needs": analysis.needs}
        for analysis in systems().analyses
    ]


def _session_analyses() -> list[dict[str, Any]]:
    return [
        {"kind": "analysis", "name": analysis.name, "title": analysis.title, "needs": analysis.needs}
        for analysis in systems().session_analyses
    ]


def _of_a_session(folder: Path) -> list[dict[str, Any]]:
    """Return the analyses of a session, each with whether it ran and why not."""
    found = load_document(folder)
    reasons = {entry.analysis: entry.reason for entry in found.not_assessable}
    return [
        {**entry, "would_run": entry["name"] in found.results, "reason": reasons.get(entry["name"], "")}
        for entry in _session_analyses()
    ]


def _with_answers(path: Path, profile: Path | None, icds: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the analyses, each with whether it would run on a log and why not."""
    from groundstation.base.errors import UnreadableLogError, UsageError
    from groundstation.pipeline.one_flight.analyse import answers_of
    from groundstation.pipeline.one_flight.configuration import Configuration
    from groundstation.pipeline.one_flight.convert import why_nothing_is_placed
    from groundstation.pipeline.one_flight.log import open_log
    from groundstation.pipeline.verbs.check import checked_with_flight

    if not path.exists():
        raise UsageError(str(path), "no such file")
    path = file_in(path, ".mcap") if path.is_dir() else path
    configuration = Configuration()
    checked, flight = checked_with_flight(
        open_log(path, profile, icds), configuration.thresholds, "none", with_flight=True
    )
    if flight is None:
        why = why_nothing_is_placed(checked.findings)
        raise UnreadableLogError(path.name, why, "", "`info` shows what the file is")
    found, _known = answers_of(flight, configuration)
    return [
        *_unnamed(checked.ledger),
        *(
            {**entry, "would_run": entry["name"] in found.answers, "reason": found.reasons.get(entry["name"], "")}
            for entry in _analyses()
            if entry["name"] in {*found.answers, *found.reasons}  # what does not apply to such a log is left out
        ),
    ]


def _unnamed(ledger: Ledger) -> list[dict[str, Any]]:
    """Return what to do about bus words that no ICD names; nothing where there are none."""
    count = unnamed_buses(ledger)
    return [{"kind": "note", "name": "buses", "title": without_icd(count), "needs": "nothing"}] if count else []


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


def _approaches() -> list[dict[str, Any]]:
    from groundstation.simulation.approach import approach_names, load_approach

    return [
        {"kind": "scenario", "name": name, "title": load_approach(name).title, "needs": "nothing"}
        for name in approach_names()
    ]


def _inertial_units() -> list[dict[str, Any]]:
    from groundstation.simulation.imu.scenario import imu_scenario_names, load_imu_scenario

    return [
        {"kind": "scenario", "name": name, "title": load_imu_scenario(name).title, "needs": "nothing"}
        for name in imu_scenario_names()
    ]


def _several_ins() -> list[dict[str, Any]]:
    from groundstation.simulation.ins_units.fleet import load_units_fleet, units_fleet_names
    from groundstation.simulation.ins_units.scenario import load_units_scenario, units_scenario_names

    fleets = [
        {"kind": "scenario", "name": name, "title": load_units_fleet(name).title, "needs": "nothing"}
        for name in units_fleet_names()
    ]
    return fleets + [
        {"kind": "scenario", "name": name, "title": load_units_scenario(name).title, "needs": "nothing"}
        for name in units_scenario_names()
    ]


def _sessions() -> list[dict[str, Any]]:
    from groundstation.simulation.session_scenario import load_session, session_names

    return [
        {"kind": "session", "name": name, "title": load_session(name).title, "needs": "nothing"}
        for name in session_names()
    ]


def _plans() -> list[dict[str, Any]]:
    from groundstation.systems import systems
    from groundstation.systems.shipped_plans import load_plan, plan_names

    return [
        {
            "kind": "plan",
            "name": f"{plan.name} {name}",
            "title": load_plan(plan, name).scenario.title,
            "needs": "nothing",
        }
        for plan in systems().plans
        for name in plan_names(plan)
    ]


def _studies() -> list[dict[str, Any]]:
    return [
        {"kind": "study", "name": study.name, "title": f"study: {study.title}", "needs": "nothing"}
        for study in systems().studies
    ]


def _failures() -> list[dict[str, Any]]:
    return [{"kind": "not loaded", "name": "plug-in", "title": line, "needs": ""} for line in systems().failures]
