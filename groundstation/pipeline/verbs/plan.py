"""Run of a plan into a folder of its own: scenario to answers, recording and report."""

import hashlib
import platform
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.failures import attempt, failures, gathered_failures, is_incomplete, with_failures
from groundstation.base.findings import worst
from groundstation.pipeline.many_flights.inputs import FLIGHT_FOLDER_MARK, PLAN_MARK
from groundstation.pipeline.many_flights.runs.out_folder import alone_in, prepare, refuse_foreign
from groundstation.pipeline.one_flight.flight import (
    OF_THE_WORLD,
    Stopwatch,
    partial_folder,
    place,
    report_finished,
    state_of,
)
from groundstation.pipeline.one_flight.identity import safe_part
from groundstation.pipeline.one_flight.manifest import manifest_of
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import digest_of_parts, versions
from groundstation.pipeline.one_flight.sealing import seal, spoiled_files
from groundstation.reports.flight_report import PDF, write_flight_report
from groundstation.results.files import load_document, load_manifest, put_failures, save, write_text
from groundstation.results.flight import FlightResults, Source
from groundstation.results.manifest import Keys, Resume
from groundstation.systems import systems
from groundstation.systems.plan import Plan, Planned
from groundstation.systems.shipped_plans import LoadedPlan, load_plan, plan_names


@dataclass(frozen=True)
class ShippedScenario:
    """A scenario that comes with the package: its name and its title."""

    name: str
    title: str


def plan_of(name: str) -> Plan[Any]:
    """The kind of plan of that name."""
    return next(plan for plan in systems().plans if plan.name == name)


def shipped_scenarios(name: str) -> tuple[ShippedScenario, ...]:
    """Return the scenarios of a kind of plan that come with the package."""
    plan = plan_of(name)
    return tuple(ShippedScenario(one, load_plan(plan, one).scenario.title) for one in plan_names(plan))


def run_plan(
    name: str,
    scenario: str | Path,
    out: Path,
    *,
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = False,
    listen: Listener = silent,
) -> Outcome:
    """Make a plan into ``<out>/<name of the scenario>/``.

    For a finished plan, only a PDF that is asked for is made.

    Parameters
    ----------
    name : str
        Kind of plan: ``session``.
    scenario : str or Path
        Name of a shipped scenario, or a TOML file.
    out : Path
    force : bool
        Use a folder that is something else's, and make a finished plan again.

    Raises
    ------
    UsageError
        When the scenario is wrong, or ``out`` or its folder is something else's.
    """
    plan = plan_of(name)
    loaded = load_plan(plan, scenario)
    identity = safe_part(loaded.name) or "plan"
    refuse_foreign(out, force)
    target = out / identity
    if (target / FLIGHT_FOLDER_MARK).is_file() and not (target / PLAN_MARK).is_file():
        raise UsageError(str(target), "results that are no plan", "a folder for the plan", "name another -o")
    listen(Event("begin", total=1))
    with alone_in(out):
        prepare(out)
        outcome = _run(plan, loaded, target, force, fail_on, with_pdf, Stopwatch(listen, loaded.name))
    listen(Event("end", loaded.name, outcome.text))
    return outcome


def _keys(plan: Plan[Any], loaded: LoadedPlan[Any]) -> Keys:
    """Return the keys of a plan, made of the scenario and the versions.

    Equal keys give equal results.
    """
    key = digest_of_parts(plan.name, loaded.name, loaded.text, dict(versions()), platform.python_version())
    return Keys(key, key)


def _kept(target: Path, keys: Keys) -> tuple[Resume, bool] | None:
    """Return the saved outcome of a finished plan of these keys, and whether it has its PDF.

    None where anything else is amiss.
    """
    try:
        manifest, findings = load_manifest(target), load_document(target).findings
    except GroundstationError:
        return None
    spoiled = spoiled_files(target, manifest)
    if manifest.resume is None or manifest.resume.keys != keys or is_incomplete(findings) or not spoiled <= {PDF}:
        return None
    return manifest.resume, PDF in manifest.files and not spoiled


def _finished(
    loaded: LoadedPlan[Any], target: Path, kept: tuple[Resume, bool], fail_on: str, with_pdf: bool, watch: Stopwatch
) -> Outcome:
    """Return the outcome of a finished plan; add its PDF where asked for and missing."""
    resume, has_pdf = kept
    problem = ""
    if with_pdf and not has_pdf:
        with watch.stage("reporting"):
            problem = report_finished(target, with_page=False, with_pdf=True)
    told = "; ".join(filter(None, (resume.text, problem)))
    state = state_of(load_document(target).findings, False, fail_on)
    done = Outcome(loaded.name, state, told, target.name, str(target), _digest(loaded), watch.times_s)
    return replace(done, was_finished=has_pdf or not with_pdf, failures=failures())


def _run(
    plan: Plan[Any],
    loaded: LoadedPlan[Any],
    target: Path,
    force: bool,
    fail_on: str,
    with_pdf: bool,
    watch: Stopwatch,
) -> Outcome:
    partial: Path | None = None
    try:
        with gathered_failures():
            kept = None if force else _kept(target, _keys(plan, loaded))
            if kept is not None:
                return _finished(loaded, target, kept, fail_on, with_pdf, watch)
            partial = partial_folder(target.parent)
            return _run_into(partial, plan, loaded, target, fail_on, with_pdf, watch)
    except Exception as error:
        reason, trace = reason_of(loaded.name, error)
        return Outcome(loaded.name, "failed", reason, sha256=_digest(loaded), times_s=watch.times_s, trace=trace)
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)


def _run_into(
    partial: Path,
    plan: Plan[Any],
    loaded: LoadedPlan[Any],
    target: Path,
    fail_on: str,
    with_pdf: bool,
    watch: Stopwatch,
) -> Outcome:
    from groundstation.viewer.plan import write_plan_recording

    with watch.stage("planning"):
        planned = plan.run(loaded.scenario)
    results = _results(plan, loaded, planned, target.name)
    warned = (f"warning: {finding.text}" for finding in results.findings if finding.severity != "info")
    sentence = attempt("line", plan.name, plan.sentence, results.answers) or ""
    text = "; ".join(filter(None, (sentence, *warned)))
    with watch.stage("saving"):
        resume = Resume(_keys(plan, loaded), text, False)
        manifest = manifest_of(results, {"scenario": asdict(loaded.scenario)}, resume=resume)
        save(partial, results, manifest)
        write_text(partial / PLAN_MARK, loaded.text)
    with watch.stage("recording"):
        path = partial / f"{results.flight_id}.rrd"
        attempt("recording", "plan", write_plan_recording, path, results, systems(), unless=OF_THE_WORLD)
    with watch.stage("reporting"):
        problem = write_flight_report(partial, systems(), with_pdf=with_pdf).problem
    put_failures(partial, failures())
    seal(partial, manifest)
    place(partial, target)
    state = state_of(with_failures(results.findings, failures()), False, fail_on)
    told = "; ".join(filter(None, (text, problem)))
    done = Outcome(loaded.name, state, told, results.flight_id, str(target), _digest(loaded), watch.times_s)
    return replace(done, failures=failures())


def _digest(loaded: LoadedPlan[Any]) -> str:
    return hashlib.sha256(loaded.text.encode()).hexdigest()


def _results(plan: Plan[Any], loaded: LoadedPlan[Any], planned: Planned, identity: str) -> FlightResults:
    source = Source(
        f"{loaded.name}.toml", _digest(loaded), len(loaded.text.encode()), f"groundstation plan {plan.name}"
    )
    owned = tuple(figure for answer in planned.answers.values() for figure in answer.figures)
    return FlightResults(
        flight_id=identity,
        source=source,
        metadata={"plan": plan.name, "title": loaded.scenario.title},
        start_utc_ns=None,
        duration_s=planned.duration_s,
        status="degraded" if worst(planned.findings) == "fail" else "ok",
        findings=planned.findings,
        answers=planned.answers,
        figures=(*planned.figures, *owned),
    )
