"""Magnetic deviation as analyses: by opposite turns, and heading sensor on ground runs."""

from typing import TYPE_CHECKING

from groundstation.base.findings import Finding, Severity
from groundstation.base.signals import topics_of_kind
from groundstation.base.words import counted
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.answer import Answers, answer_of
from groundstation.results.roles import AzimuthByTurns, Delays, HeadingByTrack, KindOfIns, StatesAlongTheFlight
from groundstation.results.rules import Rejudged
from groundstation.systems.analysis import Analysis, Found, Rules, Shortfall, main_numbers
from groundstation.systems.known import Known
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.columns import COLUMNS, FLUX_COLUMNS
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.flux_settings import FLUX_LIMITS, MagneticFluxSettings
from groundstation.systems.magnetic.ground_answer import GroundDeviation
from groundstation.systems.magnetic.ground_settings import MagneticGroundSettings
from groundstation.systems.magnetic.settings import LIMITS, MagneticSettings

if TYPE_CHECKING:
    from groundstation.systems.magnetic.flux_reference import OtherAnswers
    from groundstation.tables.table import Flight

SURE_SIGMAS = 2.0


def _run(flight: "Flight", known: Known, settings: MagneticSettings) -> Found[MagneticResult]:
    from groundstation.systems.magnetic.estimate import estimate_deviation

    known_ins = known.answer_meeting(KindOfIns)
    found = estimate_deviation(
        flight,
        settings=settings,
        heading=known.answer_meeting(HeadingByTrack),
        on_ground=known.role(HeadingOnGround),
        by_turns=known.answer_meeting(AzimuthByTurns),
        latencies=known.answer_meeting(Delays),
        kinds=known_ins.kinds if known_ins else {},
        states=known.answer_meeting(StatesAlongTheFlight),
        aircraft=known.aircraft,
        phases=known.phases,
    )
    return Found(found, (_verdict(found),))


def _examine(flight: "Flight", known: Known, settings: MagneticSettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.magnetic.examine import examine_magnetic

    return examine_magnetic(flight, known, settings)


def _verdict(found: MagneticResult) -> Finding:
    """The verdict: a rejected one is a warning."""
    text = f"magnetic deviation: {found.verdict}: {found.verdict_reason}"
    topic = found.magnetometer_topic
    return Finding("warn" if found.verdict == "reject" else "info", f"magnetic.{found.verdict}", text, topic)


def _has_readings(flight: "Flight", _known: Known) -> bool:
    return any(topics_of_kind("magnetometer", flight.topics()))


def _sentence(answers: Answers) -> str:
    magnetic = answer_of(answers, MagneticResult)
    if magnetic is None:
        return ""
    if magnetic.verdict == "reject" or magnetic.residual_rms_deg is None:
        return f"magnetic deviation {magnetic.verdict} ({magnetic.verdict_reason})"
    residual = magnetic.residual_rms_deg
    return f"magnetic deviation {magnetic.verdict}: {residual.before:.2f} deg RMS before, {residual.after:.2f} after"


def _run_on_ground(flight: "Flight", known: Known, settings: MagneticGroundSettings) -> Found[GroundDeviation]:
    from groundstation.systems.magnetic.ground_runs import estimate_ground_deviation

    found = estimate_ground_deviation(
        flight,
        settings=settings,
        phases=known.phases,
        aircraft=known.aircraft,
        latencies=known.answer_meeting(Delays),
        excluded_s=known.excluded_s,
    )
    text = _ground_text(found)
    return Found(found, (Finding("info", "magnetic_ground.found", text, found.ins_topic), *_too_wrong(found, settings)))


def _ground_text(found: GroundDeviation) -> str:
    errors = [run.error_deg for run in found.used if run.error_deg is not None]
    spanned = " to ".join(f"{round(error, 1) + 0.0:+.1f}" for error in sorted({min(errors), max(errors)}))
    runs = f"{counted(len(errors), 'straight ground run')} in {counted(found.directions, 'direction')}"
    return f"heading sensor on {runs}: error {spanned} deg"


def _too_wrong(found: GroundDeviation, settings: MagneticGroundSettings) -> tuple[Finding, ...]:
    """A warning for the run that is surely beyond the limit by most."""
    rows = [(run, run.error_deg, run.sigma_deg) for run in found.used]
    known = [(run, error, sigma) for run, error, sigma in rows if error is not None and sigma is not None]
    run, error, sigma = max(known, key=lambda row: abs(row[1]) - SURE_SIGMAS * row[2])
    if abs(error) - SURE_SIGMAS * sigma <= settings.error_max_deg:
        return ()
    text = (
        f"heading sensor reads {error:+.1f} deg wrong at {run.magnetic_heading_deg:.0f} deg on the ground run at "
        f"{run.start_s:.0f} s (sigma {sigma:.1f}), more than {settings.error_max_deg:g} deg"
    )
    return (Finding("warn", "magnetic_ground.error", text, found.ins_topic),)


def _has_magnetic_heading(flight: "Flight", _known: Known) -> bool:
    return any(flight[topic].has("magnetic_heading_deg") for topic in topics_of_kind("ins", flight.topics()))


def _run_flux(flight: "Flight", known: Known, settings: MagneticFluxSettings) -> Found[FluxDeviation]:
    from groundstation.systems.magnetic.flux_estimate import estimate_flux_deviation

    found = estimate_flux_deviation(
        flight,
        settings=settings,
        magnetic=known.settings_of(MagneticSettings),
        phases=known.phases,
        others=_others(known),
    )
    severity: Severity = "warn" if found.verdict == "reject" else "info"
    text = f"flux valve in flight: {found.verdict}: {found.verdict_reason}"
    return Found(found, (Finding(severity, f"magnetic_flux.{found.verdict}", text, found.ins_topic),))


def _others(known: Known) -> "OtherAnswers":
    from groundstation.systems.magnetic.flux_reference import OtherAnswers

    known_ins = known.answer_meeting(KindOfIns)
    return OtherAnswers(
        states=known.answer_meeting(StatesAlongTheFlight),
        heading=known.answer_meeting(HeadingByTrack),
        by_turns=known.answer_meeting(AzimuthByTurns),
        kinds=known_ins.kinds if known_ins else {},
        aircraft=known.aircraft,
    )


def _examine_flux(flight: "Flight", known: Known, settings: MagneticFluxSettings) -> tuple[Shortfall, ...]:
    from groundstation.systems.magnetic.examine_flux import examine_flux

    return examine_flux(flight, known, settings)


def _rejudge_flux(answer: FluxDeviation, settings: MagneticFluxSettings) -> tuple[Rejudged, ...]:
    from groundstation.systems.magnetic.flux_verdict import flux_rejudge

    return flux_rejudge(answer, settings)


def _flux_sentence(answers: Answers) -> str:
    found = answer_of(answers, FluxDeviation)
    if found is None:
        return ""
    given = [row.letter for row in found.coefficients if row.value_deg is not None]
    legs = counted(len(found.used), "straight leg")
    text = f"flux valve {found.verdict}: {', '.join(given) or 'no coefficient'} of A to E by {legs}"
    residual = found.residual_rms_deg
    return text if residual is None else f"{text}, {residual.before:.2f} deg RMS before, {residual.after:.2f} after"


def _ground_sentence(answers: Answers) -> str:
    found = answer_of(answers, GroundDeviation)
    return "" if found is None else _ground_text(found)


def _rejudge(answer: MagneticResult, settings: MagneticSettings) -> tuple[Rejudged, ...]:
    from groundstation.systems.magnetic.verdict import rejudge

    return rejudge(answer, settings)


MAGNETIC = Analysis(
    name="magnetic",
    title="magnetic deviation from opposite turns in flight, with its coefficients A to E",
    subject="magnetic deviation",
    needs="magnetometer on three axes, ins roll, pitch and a true heading that no magnetometer corrects, a turn "
    "each way at one steady bank that together cover the circle, level flight to judge by",
    settings=MagneticSettings,
    answer=MagneticResult,
    run=_run,
    builds_on=("heading", "inertial", "latency", "trajectory"),
    is_expected=_has_readings,
    sentence=_sentence,
    columns=COLUMNS,
    examine=_examine,
    rules=Rules(LIMITS, _rejudge),
    is_main=main_numbers("verdict"),
)
MAGNETIC_GROUND = Analysis(
    name="magnetic_ground",
    title="errors of the installed heading sensor on straight ground runs",
    subject="heading sensor on ground runs",
    page_title="Heading sensor on the ground",
    needs="ins magnetic heading, gnss velocities and positions, a date, proof of ground contact, straight runs "
    "above 3 m/s",
    settings=MagneticGroundSettings,
    answer=GroundDeviation,
    run=_run_on_ground,
    builds_on=("latency",),
    is_expected=_has_magnetic_heading,
    sentence=_ground_sentence,
)
MAGNETIC_FLUX = Analysis(
    name="magnetic_flux",
    title="deviation of a flux valve (heading alone) from straight legs and turns in flight",
    subject="flux valve in flight",
    page_title="Flux valve in flight",
    needs="ins magnetic heading of a compass, a date and positions; a true heading with no compass in it, or GNSS "
    "velocities and air true_airspeed on several headings",
    settings=MagneticFluxSettings,
    answer=FluxDeviation,
    run=_run_flux,
    builds_on=("heading", "inertial", "trajectory"),
    applies=_has_magnetic_heading,
    is_expected=_has_magnetic_heading,
    sentence=_flux_sentence,
    columns=FLUX_COLUMNS,
    examine=_examine_flux,
    rules=Rules(FLUX_LIMITS, _rejudge_flux),
    is_main=main_numbers("verdict"),
)
