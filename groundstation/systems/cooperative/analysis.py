"""Navigation between aircraft as an analysis of a session."""

from typing import TYPE_CHECKING

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.analysis import Analysis, Found, Shortfall, main_numbers
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.known import SessionKnown

if TYPE_CHECKING:
    from groundstation.tables.session import Session

NIS_MAX = 1.5  # white innovations of LEAST_RANGES rows stay below it in all but one of 10 000 sessions
LEAST_RANGES = 150
LEAST_OF_A_STATION, GATED_SHARE, OTHERS_SHARE = 10, 0.2, 0.05


def _run(session: "Session", known: SessionKnown, settings: CooperativeSettings) -> Found[CooperativeResult]:
    from groundstation.systems.cooperative.estimate import estimate_session

    answer, findings = estimate_session(session, settings=settings, truth=dict(known.truth))
    return Found(answer, (*findings, *_misplaced(answer), *_too_sure(answer)))


def _examine(session: "Session", _known: SessionKnown, settings: CooperativeSettings) -> tuple[Shortfall, ...]:
    """Report if no usable ranges between vehicles or to ground points are left.

    Those that cannot be used are left out first.
    """
    from groundstation.systems.cooperative.events import prepare, require_vehicles
    from groundstation.systems.cooperative.loop_types import PEER, POINT

    prepared = prepare(session, settings)
    require_vehicles(prepared)
    if not any(kind in (PEER, POINT) for kind in prepared.events.kind):
        raise NotAssessableError("cooperative", "no range over the data link that can be used")
    return tuple(Shortfall(finding.text) for finding in prepared.findings if finding.severity != "info")


def innovations_of(answer: CooperativeResult) -> dict[str, float]:
    """Return the mean normalised innovation squared by kind of range; 1 is right.

    It is that of the centralised filter, which predicts a range before it uses it.
    """
    kinds = dict.fromkeys(link.kind for link in answer.links)
    found: dict[str, float] = {}
    for kind in kinds:
        rows = [(link.used, link.nis) for link in answer.links if link.kind == kind and link.nis is not None]
        used = sum(count for count, _nis in rows)
        if used >= LEAST_RANGES:
            found[kind] = sum(count * nis for count, nis in rows) / used
    return found


def _too_sure(answer: CooperativeResult) -> tuple[Finding, ...]:
    """Warn where ranges contradict the sigmas given to the filter; this needs no truth."""
    return tuple(
        Finding(
            "warn",
            "cooperative.too_sure",
            f"ranges of kind {kind} miss their prediction by more than the stated sigmas allow: NIS {nis:.1f} "
            "instead of 1; the computed sigma is too small: state the errors of these INS and ranges in "
            "[cooperative.ins] and [session]",
        )
        for kind, nis in innovations_of(answer).items()
        if nis > NIS_MAX
    )


def _misplaced(answer: CooperativeResult) -> tuple[Finding, ...]:
    """Warn of a station whose ranges the centralised filter gates while it uses the others.

    With honest sigmas one range in 10^8 or fewer is beyond a gate of 6 sigma.
    """
    found = []
    stations = answer.stations
    told = {row.station for row in stations.in_doubt} if stations else set()
    for name in (name for name in answer.point_names if name not in told):
        mine = [link for link in answer.links if link.kind == "point" and link.source == name]
        rest = [link for link in answer.links if link not in mine]
        ranges, gated = sum(link.ranges for link in mine), sum(link.gated for link in mine)
        others, others_gated = sum(link.ranges for link in rest), sum(link.gated for link in rest)
        if ranges >= LEAST_OF_A_STATION and gated > GATED_SHARE * ranges and others_gated < OTHERS_SHARE * others:
            text = (
                f"{answer.links_algorithm} rejected {gated} of {ranges} ranges to station {name} and hardly any "
                "other: its place in the stations file contradicts the ranges"
            )
            found.append(Finding("warn", "cooperative.misplaced_station", text, f"link.{name}", name, gated))
    return tuple(found)


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, CooperativeResult)
    if answer is None:
        return ""
    rows = [row for row in answer.algorithms if row.algorithm == answer.default_algorithm]
    if not rows or rows[0].two_sigma_r_session_m is None:
        return ""
    against = "" if rows[0].rms_m is None else f", {rows[0].rms_m:.1f} m RMS against the truth"
    who = f"{len(answer.vehicle_names)} aircraft" if len(answer.vehicle_names) > 1 else answer.vehicle_names[0]
    doubt = ", sigma too small: the ranges contradict it" if _too_sure(answer) else ""
    if answer.stations is not None:
        doubted = [row.station for row in answer.stations.in_doubt]
        doubt += f"; station{'s' if len(doubted) > 1 else ''} in doubt: {', '.join(doubted)}" if doubted else ""
    sigma = f"2 sigma_r {rows[0].two_sigma_r_session_m:.1f} m over the session"
    return f"{who}, {answer.default_algorithm}: {sigma}{against}{doubt}"


COOPERATIVE = Analysis(
    name="cooperative",
    title="navigation between aircraft: positions from ranges over the data link, by every algorithm",
    subject="navigation between aircraft",
    needs="a session: for each aircraft ins latitude, longitude, height and velocities; link.<peer> pseudorange_m "
    "with transmission_time_s, satellite.<id> if any; ground stations in a file",
    settings=CooperativeSettings,
    answer=CooperativeResult,
    run=_run,
    sentence=_sentence,
    examine=_examine,
    assumes="sigmas of the INS",
    is_main=main_numbers(r"default_algorithm|algorithms\.[^.]+\.(two_sigma_r_m|rms_m|nees|is_consistent|diverges)"),
)
