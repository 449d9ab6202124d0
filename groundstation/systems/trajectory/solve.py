"""Best trajectory of a flight: input, mounting, estimate, honesty gate, answer."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.results.gates import Gate, judged_gate
from groundstation.systems.known import Known
from groundstation.systems.trajectory import checks, figures, fix_residuals, judge, tell
from groundstation.systems.trajectory.aiding import may_roll, row_of_no_slip
from groundstation.systems.trajectory.aids_input import Aids, aids_of
from groundstation.systems.trajectory.answer import BestTrajectory, TrajectoryState
from groundstation.systems.trajectory.checks_answer import HeadingHypothesis, InnovationRow, RaisedSigma
from groundstation.systems.trajectory.estimate import Estimate
from groundstation.systems.trajectory.gather import gather
from groundstation.systems.trajectory.gathered import Gathered
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.mounting import Mounting, find_mounting
from groundstation.systems.trajectory.mounting_logged import logged_mounting
from groundstation.systems.trajectory.onboard import ComparedFilter, compare_onboard
from groundstation.systems.trajectory.onboard_filters import filters_of
from groundstation.systems.trajectory.outages import Outages, replay
from groundstation.systems.trajectory.segments import SUBJECT, Segment, estimate_segments, moving_s
from groundstation.systems.trajectory.settings import TrajectorySettings
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates
from groundstation.systems.trajectory.track import forward_track, joined, smoothed_track

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

COARSE_LAG_S = 0.15  # a coarse latency that is smaller is left to the filter


@dataclass(frozen=True)
class Solved:
    """States of the smoother and of the filter, sigmas raised.

    They are for the analyses behind this one.
    """

    smoothed: TrackOfStates
    forward: TrackOfStates
    state: TrajectoryState


def solve(
    flight: "Flight", known: Known, settings: TrajectorySettings
) -> tuple[BestTrajectory, tuple[Finding, ...], Solved]:
    """Estimate the best trajectory of a flight.

    Raises
    ------
    NotAssessableError
        With the reason: no input, axes that cannot be right, too little motion, samples too slow, innovations far from
        what is expected, a heading that nothing shows.
    """
    gathered = gather(flight, known, settings.input)
    vehicle = known.phases.vehicle.kind
    mounting = mounting_of(flight, known, gathered, settings)
    require_enough(gathered, settings)
    imu = turned(gathered.imu, mounting.body_from_case)
    lag_s = mounting.evidence.lag_s
    segments = estimate_segments(
        imu,
        gathered.gnss,
        gap_s=settings.input.segment_s,
        least_s=settings.segment_min_s,
        may_roll=may_roll(vehicle, settings.aids),
        may_stop=vehicle in ("rolls", "walks"),
        latency_s=lag_s if np.isfinite(lag_s) and abs(lag_s) > COARSE_LAG_S else 0.0,
        aids=aids_beside(flight, known, gathered, mounting, settings),
        aid_settings=settings.aids,
        ambiguous_below=settings.ambiguous_below,
    )
    return _answered(flight, gathered, mounting, segments, settings, vehicle or "")


def aids_beside(
    flight: "Flight", known: Known, gathered: Gathered, mounting: Mounting, settings: TrajectorySettings
) -> Aids:
    """Return the aids of a flight beside GNSS."""
    return aids_of(
        flight,
        known,
        gathered.gnss,
        settings.aids,
        rolls=known.phases.vehicle.kind == "rolls",
        is_mounted=mounting.source not in ("case", "refused"),
    )


def mounting_of(flight: "Flight", known: Known, gathered: Gathered, settings: TrajectorySettings) -> Mounting:
    """Return the mounting of the unit.

    Raises
    ------
    NotAssessableError
        Where no turn of its axes fits the motion.
    """
    mounting = find_mounting(
        gathered.imu,
        gathered.gnss,
        vehicle=known.phases.vehicle.kind,
        stated=known.aircraft.imu_mounting_deg,
        logged=logged_mounting(flight),
        settings=settings.mounting,
    )
    if mounting.refused:
        raise NotAssessableError(SUBJECT, f"{gathered.imu_facts.topic}: {mounting.refused}")
    return mounting


def turned(imu: ImuIncrements, body_from_case: FloatArray) -> ImuIncrements:
    """Return increments along the axes of the body."""
    return replace(
        imu,
        delta_angle_rad=imu.delta_angle_rad @ body_from_case.T,
        delta_velocity_mps=imu.delta_velocity_mps @ body_from_case.T,
    )


def require_enough(gathered: Gathered, settings: TrajectorySettings) -> None:
    """Refuse a log with too little motion, or samples too slow for it.

    Raises
    ------
    NotAssessableError
    """
    start_s, end_s = float(gathered.imu.time_s[0]), float(gathered.imu.time_s[-1])
    motion_s = moving_s(gathered.gnss, start_s, end_s, settings.moving_mps)
    if motion_s < settings.moving_min_s:
        raise NotAssessableError(
            SUBJECT, f"{motion_s:.0f} s of motion, at least {settings.moving_min_s:.0f} s are needed"
        )
    facts = gathered.imu_facts
    if not facts.is_integral and facts.rate_hz < settings.sample_rate_min_hz:
        raise NotAssessableError(
            SUBJECT,
            f"{facts.topic} has point samples of {facts.rate_hz:.0f} Hz: what happens between them is not in the log; "
            f"at least {settings.sample_rate_min_hz:.0f} Hz are needed, or increments",
        )


def _answered(
    flight: "Flight",
    gathered: Gathered,
    mounting: Mounting,
    segments: tuple[Segment, ...],
    settings: TrajectorySettings,
    vehicle: str,
) -> tuple[BestTrajectory, tuple[Finding, ...], Solved]:
    estimates = tuple(one.estimate for one in segments)
    place = max(range(len(segments)), key=lambda one: len(estimates[one].result.plan.epoch_s))
    main = estimates[place]
    innovations = checks.innovations_of(main)
    _fits(innovations, main, settings)
    outages = _joined([replay(one) for one in estimates])
    residuals = [fix_residuals.residuals_of(one) for one in estimates]
    plain = joined([smoothed_track(one.problem.samples, one.result, segment=i) for i, one in enumerate(estimates)])
    own = checks.against_own_track(plain) if main.problem.has_slip else None
    moving = _moving(plain, settings)
    sigma_deg = float(np.median(plain.attitude_sigma_deg[moving, 2]))
    factors, raised = judge.raised(outages, own, sigma_deg, rolls=main.problem.has_slip)
    constant_m = main.constant_sigma_m
    smoothed = judge.with_factors(plain, factors, constant_m)
    forward = judge.with_factors(
        joined([forward_track(one.problem.samples, one.result, segment=i) for i, one in enumerate(estimates)]),
        factors,
        constant_m,
    )
    sigma_deg *= factors.heading
    hypotheses = _hypotheses(main)
    if sigma_deg > settings.heading_sigma_max_deg and not _are_two(hypotheses, settings):
        raise NotAssessableError(
            SUBJECT,
            f"heading to {sigma_deg:.1f} deg (sigma) alone, limit {settings.heading_sigma_max_deg:g}: "
            f"{_why_heading(raised, settings)}",
        )
    gates = _gates(innovations, sigma_deg, factors, settings)
    state, reasons = _state(gathered, mounting, main, hypotheses, gates, outages, raised, settings)
    separation, separation_figure = figures.separation_of(forward, smoothed)
    compared = _onboard(smoothed, flight)
    other = _other_heading(smoothed, hypotheses) if state == "ambiguous" else None
    parameters = tell.parameter_rows(main)
    answer = BestTrajectory(
        state=state,
        reasons=reasons,
        imu=gathered.imu_facts.topic,
        gnss=gathered.gnss_facts.topic,
        is_integral=gathered.imu_facts.is_integral,
        imu_rate_hz=gathered.imu_facts.rate_hz,
        vehicle=vehicle,
        segments=figures.segments_of(smoothed),
        moving_s=moving_s(gathered.gnss, smoothed.time_s[0], smoothed.time_s[-1], settings.moving_mps),
        mounting=tell.mounting_told(mounting, parameters),
        accuracy=figures.accuracy_of(smoothed),
        gates=gates,
        raised=raised,
        noise=tell.noise_rows(main),
        parameters=parameters,
        innovations=innovations,
        held_out=fix_residuals.held_out_rows(residuals[place]),
        own_track=own,
        outages=judge.outage_rows(outages, factors.position, factors.height),
        outage_truth="RTK" if gathered.gnss_facts.precise_share > 0.9 else "undisturbed solution",
        hypotheses=hypotheses,
        aids=(*row_of_no_slip(vehicle, main, settings.aids), *segments[place].aids),
        onboard=compared[0].errors if compared else None,
        other_filters=tuple(one.errors for one in compared[1:]),
        separation=separation,
        settings=asdict(settings),
        figures=(
            figures.track_figure(smoothed, other),
            figures.states_of(smoothed, gathered.gnss_facts.height),
            separation_figure,
            *(one.figure for one in compared[:1]),
            fix_residuals.residuals_figure(residuals),
            tell.biases_of(estimates),
            tell.outages_of(outages, factors.position),
        ),
    )
    return answer, _findings(gathered, answer), Solved(smoothed, forward, state)


def _joined(parts: list[Outages]) -> Outages:
    return Outages(*(np.concatenate([getattr(part, name) for part in parts]) for name in Outages.__dataclass_fields__))


def _moving(track: TrackOfStates, settings: TrajectorySettings) -> FloatArray:
    moving = np.linalg.norm(track.velocity_mps[:, :2], axis=1) > settings.moving_mps
    return moving if moving.any() else np.ones(len(track), dtype=bool)


def _fits(innovations: tuple[InnovationRow, ...], main: Estimate, settings: TrajectorySettings) -> None:
    """Refuse an estimate whose innovations are far larger than any noise explains."""
    for row in innovations:
        if row.ratio > settings.nis_max or not np.isfinite(row.ratio):
            raise NotAssessableError(
                SUBJECT,
                f"innovations of {row.sensor} are {row.ratio:.1f} times what is expected after the noise was fitted, "
                f"limit {settings.nis_max:g}: unit and GNSS do not go together",
            )
    share = checks.used_share(main)
    if share < 0.5:
        raise NotAssessableError(SUBJECT, f"only {share:.0%} of GNSS agrees with the unit: they do not go together")


def _why_heading(raised: tuple[RaisedSigma, ...], settings: TrajectorySettings) -> str:
    """Return why the heading is not known: sigma raised, or nothing in the motion shows it."""
    row = next(one for one in raised if one.name == "heading")
    return row.reason if row.factor > settings.raised_doubt else "the motion does not show it"


def _hypotheses(main: Estimate) -> tuple[HeadingHypothesis, ...]:
    best = main.hypotheses[0].likelihood
    return tuple(
        HeadingHypothesis(one.start_heading_deg, one.end_heading_deg, max(0.0, best - one.likelihood))
        for one in main.hypotheses
    )


def _are_two(hypotheses: tuple[HeadingHypothesis, ...], settings: TrajectorySettings) -> bool:
    """Tell whether a second heading explains the log nearly as well."""
    return len(hypotheses) > 1 and hypotheses[1].below_best < settings.ambiguous_below


def _other_heading(track: TrackOfStates, hypotheses: tuple[HeadingHypothesis, ...]) -> FloatArray:
    """Return the heading of the runner-up: the best one turned by the difference at the end."""
    turn = hypotheses[1].end_heading_deg - hypotheses[0].end_heading_deg
    return wrap_360(track.heading_deg + turn)


def _gates(
    innovations: tuple[InnovationRow, ...], sigma_deg: float, factors: judge.Factors, settings: TrajectorySettings
) -> tuple[Gate, ...]:
    """Return the checks that the state rests on."""
    gates = [
        judged_gate(
            settings.nis_doubt,
            f"nis_{row.sensor.replace(' ', '_').lower()}",
            f"innovations of {row.sensor} over those expected",
            row.ratio,
        )
        for row in innovations
        if row.sensor.startswith("GNSS")
    ]
    gates.append(
        judged_gate(
            (None, settings.heading_sigma_max_deg), "heading_sigma", "sigma of the heading", sigma_deg, unit="deg"
        )
    )
    for name in ("position", "height", "velocity", "tilt", "heading"):
        bound = (None, settings.raised_doubt)
        gates.append(judged_gate(bound, f"raised_{name}", f"factor on sigmas of {name}", getattr(factors, name)))
    return tuple(gates)


def _state(
    gathered: Gathered,
    mounting: Mounting,
    main: Estimate,
    hypotheses: tuple[HeadingHypothesis, ...],
    gates: tuple[Gate, ...],
    outages: Outages,
    raised: tuple[RaisedSigma, ...],
    settings: TrajectorySettings,
) -> tuple[TrajectoryState, tuple[str, ...]]:
    """Return the state, and why it is not accepted."""
    why = {f"raised_{row.name}": f": {row.reason}" for row in raised if row.reason}
    reasons = [
        f"{gate.title} {gate.value:.2g}{' ' + gate.unit if gate.unit else ''}, limit {_limit(gate)}"
        f"{why.get(gate.name, '')}"
        for gate in gates
        if gate.state == "failed" and gate.value is not None
    ]
    facts = gathered.imu_facts
    if not facts.is_integral and facts.rate_hz < settings.sample_rate_doubt_hz:
        reasons.append(
            f"point samples of {facts.rate_hz:.0f} Hz: vibration and motion between them are not in the log, limit "
            f"{settings.sample_rate_doubt_hz:g} Hz"
        )
    reasons += [
        f"{row.name} of the unit is fitted at its bound, {row.fitted:.3g} {row.unit}: the log shakes more than the "
        "model allows"
        for row in tell.noise_rows(main)
        if row.name in tell.DENSITIES and row.is_at_bound and row.fitted > row.prior
    ]
    share = checks.used_share(main)
    if share < settings.used_share_min:
        reasons.append(f"{share:.0%} of GNSS agrees with the unit, limit {settings.used_share_min:.0%}")
    if abs(main.latency_s) > settings.latency_doubt_s:
        reasons.append(f"GNSS latency of {main.latency_s:.2f} s, limit {settings.latency_doubt_s:g} s")
    if len(outages) < judge.FEW:
        reasons.append(f"only {len(outages)} outages could be replayed: nothing shows whether the sigmas hold")
    reasons += [note.text for note in gathered.notes if note.is_doubt]
    if mounting.doubt:
        reasons.append(mounting.doubt)
    if _are_two(hypotheses, settings):
        one, two = hypotheses[:2]
        first = (
            f"a heading of {two.end_heading_deg:.0f} deg at the end is only {two.below_best:.1f} log units below the "
            f"best one of {one.end_heading_deg:.0f} deg, limit {settings.ambiguous_below:g}"
        )
        return "ambiguous", (first, *reasons)
    return ("doubtful" if reasons else "accepted"), tuple(reasons)


def _limit(gate: Gate) -> str:
    return " to ".join(f"{one:g}" for one in np.atleast_1d(gate.limit))


def _onboard(smoothed: TrackOfStates, flight: "Flight") -> tuple[ComparedFilter, ...]:
    """Compare the filters of the log, the one that flew the vehicle first."""
    is_own = logged_mounting(flight) is not None
    every = (compare_onboard(smoothed, flight, one, is_own=is_own) for one in filters_of(flight))
    return tuple(one for one in every if one is not None)


def _findings(gathered: Gathered, answer: BestTrajectory) -> tuple[Finding, ...]:
    """Return what the input showed."""
    return (
        tuple(
            Finding("warn" if note.is_doubt else "info", f"trajectory.{note.code}", note.text, gathered.imu_facts.topic)
            for note in gathered.notes
        )
        + tuple(
            Finding(
                "warn", f"trajectory.{row.name.replace(' ', '_')}", f"{row.topic} does not aid: {row.reason}", row.topic
            )
            for row in answer.aids
            if row.is_wrong
        )
        + tuple(Finding("warn", f"trajectory.{answer.state}", reason, answer.imu) for reason in answer.reasons[:1])
    )
