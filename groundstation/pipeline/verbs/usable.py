"""Usability of logs for a named purpose: what an analysis would lack.

Told without running the analysis where it can examine the data; else it is run, with those that it needs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError, SettingsError, UsageError
from groundstation.base.findings import Finding
from groundstation.base.signals import topics_of_kind
from groundstation.pipeline.one_flight.analyse import known_of, run_analyses, seen_by_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.systems import systems, systems_for
from groundstation.systems.analysis import Analysis, Shortfall
from groundstation.systems.known import Known, SessionKnown
from groundstation.tables.table import Flight

if TYPE_CHECKING:
    from groundstation.systems.system import Systems
    from groundstation.tables.session_settings import Stations

LISTED = 3  # spans listed for a shortfall


def flight_purposes(among: "Systems | None" = None) -> Mapping[str, Analysis]:
    """Return the analyses of a flight by name: those of some systems, of all by default."""
    return {one.name: one for one in (among or systems()).analyses}


def session_purposes(among: "Systems | None" = None) -> Mapping[str, Analysis]:
    """Return the analyses of a session that can be asked for, by name."""
    return {one.name: one for one in (among or systems()).session_analyses if one.examine}


@dataclass(frozen=True)
class Usability:
    """Judgement whether data serve a purpose.

    Parameters
    ----------
    purpose : str
        Name of an analysis.
    state : str
        ``no``: the analysis would give no answer; ``in part``: the answer would fall short by what is listed.
    shortfalls : tuple of Shortfall
    gives : tuple of str
        What the data give beside the answer itself.
    """

    purpose: str
    state: Literal["yes", "in part", "no"]
    shortfalls: tuple[Shortfall, ...] = ()
    gives: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """Judgement in one line: state, what is missing, and where, what is given besides.

        Examples
        --------
        >>> Usability("heading", "in part", (Shortfall("12 s of straight taxi, 20 s needed", ((3.0, 15.0),)),)).text
        'usable for heading: in part: 12 s of straight taxi, 20 s needed (at 3 to 15 s)'
        >>> Usability("inertial", "yes", (), ("several units (ins and ins.1)",)).text
        'usable for inertial: yes; gives: several units (ins and ins.1)'
        """
        lacking = "; ".join(f"{one.text}{_where(one.spans_s)}" for one in self.shortfalls)
        besides = f"; gives: {'; '.join(self.gives)}" if self.gives else ""
        return f"usable for {self.purpose}: {self.state}{f': {lacking}' if lacking else ''}{besides}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        lacking = [{"text": one.text, "spans_s": [list(span) for span in one.spans_s]} for one in self.shortfalls]
        besides = {"gives": list(self.gives)} if self.gives else {}
        return {"purpose": self.purpose, "state": self.state, "lacking": lacking, **besides}


def usability_from(told: Mapping[str, Any]) -> Usability:
    """Return the usability that :meth:`Usability.to_dict` was made of."""
    lacking = (
        Shortfall(one["text"], tuple((float(a), float(b)) for a, b in one["spans_s"])) for one in told["lacking"]
    )
    return Usability(told["purpose"], told["state"], tuple(lacking), tuple(told.get("gives", ())))


def require_purpose(name: str) -> None:
    """Refuse a purpose that no analysis serves.

    Raises
    ------
    UsageError
    """
    among = _asked(name)
    names = (*flight_purposes(among), *session_purposes(among))
    if name not in names:
        raise UsageError(f"--for {name}", "no such purpose", f"one of {', '.join(names)}")


def is_of_session(purpose: str) -> bool:
    """Tell whether a purpose is an analysis of several logs together."""
    return purpose in session_purposes(_asked(purpose))


def _asked(purpose: str) -> "Systems":
    """Return the one system of ours that has an analysis of its own name, else all."""
    among = systems_for(purpose)
    return among if {purpose} & {*flight_purposes(among), *session_purposes(among)} else systems()


def usability_of_flight(purpose: str, flight: Flight, configuration: Configuration) -> Usability:
    """Tell whether a flight serves an analysis of flights.

    An analysis that examines the data needs no other system; one that is run may.
    """
    seen = seen_by_analyses(flight, configuration)
    among = _asked(purpose)
    analysis = flight_purposes(among)[purpose]
    if analysis.examine is not None:
        return _examined(analysis, seen, known_of(seen, configuration, among))
    known = known_of(seen, configuration)
    return _run(analysis, flight if analysis.judges else seen, seen, known)


def _run(analysis: Analysis, data: Flight, seen: Flight, known: Known) -> Usability:
    """Run an analysis that examines nothing, and tell whether it answers.

    Those that it needs are run before it.
    """
    before = run_analyses(tuple(one for one in _needed(analysis) if not one.judges), seen, known)
    found = run_analyses((analysis,), data, replace(known, answers=before.answers, workings=before.workings))
    gives = analysis.gives(data, known, known.settings[analysis.settings_table])
    if analysis.name in found.answers:
        return Usability(analysis.name, "yes", (), gives)
    missing = (before.reasons[name] for name in analysis.requires if name in before.reasons)
    reason = next(missing, found.reasons.get(analysis.name, f"it is not for such a log; needs: {analysis.needs}"))
    return Usability(analysis.name, "no", (Shortfall(reason),), gives)


def _needed(analysis: Analysis) -> tuple[Analysis, ...]:
    """Return the analyses that one builds on, and that these build on."""
    every, wanted, waiting = flight_purposes(), set[str](), [*analysis.builds_on, *analysis.requires]
    while waiting:
        name = waiting.pop()
        if name in every and name not in wanted:
            wanted.add(name)
            waiting += [*every[name].builds_on, *every[name].requires]
    return tuple(one for one in every.values() if one.name in wanted)


def usability_of_session(
    purpose: str, flights: Sequence[Flight], configuration: Configuration, stations: "Stations"
) -> Usability:
    """Tell whether flights together serve an analysis of sessions.

    As in ``run``, some of them must range to others.
    """
    from groundstation.tables.session_assemble import session_from_flights

    analysis = session_purposes()[purpose]
    heard = {topic.partition(".")[2] for flight in flights for topic in topics_of_kind("link", flight.topics())}
    if not heard:
        return Usability(purpose, "no", (Shortfall("no ranges to another aircraft in the log (link.<peer>)"),))
    assembled = session_from_flights(flights, stations, settings=configuration.settings.session)
    known = SessionKnown(assembled.truth, configuration.settings.analyses)
    told = _shortfalls(assembled.findings)
    absent = sorted(heard - {*assembled.session.names, *(point.name for point in assembled.session.points)})
    if absent:
        shown = ", ".join(absent)
        told = (Shortfall(f"ranges to {shown}, but no log of them is named: add theirs"), *told)
    if len(assembled.session.vehicles) == 1 and absent:
        return Usability(purpose, "in part", told)
    found = _examined(analysis, assembled.session, known)
    shortfalls = (*found.shortfalls, *told)
    state = "in part" if found.state == "yes" and shortfalls else found.state
    return Usability(purpose, state, shortfalls, found.gives)


def _examined(analysis: Analysis, data: Any, known: Any) -> Usability:
    assert analysis.examine is not None
    settings = known.settings[analysis.settings_table]
    gives = analysis.gives(data, known, settings)
    try:
        found = analysis.examine(data, known, settings)
    except (NotAssessableError, SettingsError) as error:
        reason = str(error).removeprefix(f"{analysis.name}: ")
        return Usability(analysis.name, "no", (Shortfall(reason),), gives)
    return Usability(analysis.name, "in part" if found else "yes", found, gives)


def _shortfalls(findings: Sequence[Finding]) -> tuple[Shortfall, ...]:
    return tuple(Shortfall(finding.text) for finding in findings if finding.severity != "info")


def _where(spans_s: tuple[tuple[float, float], ...]) -> str:
    if not spans_s:
        return ""
    shown = [f"{start:.0f} to {end:.0f} s" if end > start else f"{start:.0f} s" for start, end in spans_s[:LISTED]]
    more = f" and {len(spans_s) - LISTED} more" if len(spans_s) > LISTED else ""
    return f" (at {', '.join(shown)}{more})"
