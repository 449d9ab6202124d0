"""Magnetic estimator: from the tables of a flight to a deviation, a verdict and a card."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.base.units import S_PER_H
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import AzimuthByTurns, Delays, HeadingByTrack, StatesAlongTheFlight
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.alignment import align, refused
from groundstation.systems.magnetic.answer import (
    Alignment,
    BankBias,
    Coverage,
    MagneticResult,
    Method,
    PoissonParameters,
    Residual,
    SigmaPart,
)
from groundstation.systems.magnetic.apply import corrected_by_table
from groundstation.systems.magnetic.before_lift_off import find_ground_runs, gyros_at_standstill
from groundstation.systems.magnetic.by_states import StatesReference, aligned_by_states, not_taken, reference_of
from groundstation.systems.magnetic.compass_table import CompassTable, build_table
from groundstation.systems.magnetic.earth import earth_field
from groundstation.systems.magnetic.figures import draw, parts_of
from groundstation.systems.magnetic.flown import FlownTurns, find_flown
from groundstation.systems.magnetic.held_out import Unseen, advantage, hold_out, is_level
from groundstation.systems.magnetic.iron import bank_bias, curve_rms, heading_errors, parameters_of
from groundstation.systems.magnetic.manoeuvre import FoundTurn, OppositeTurns, widest_gap_deg
from groundstation.systems.magnetic.other_conditions import FlownConditions, other_conditions
from groundstation.systems.magnetic.poisson import IronFit, corrected_heading_deg
from groundstation.systems.magnetic.readings import Readings, choose_topics
from groundstation.systems.magnetic.remarks import remarks_on
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.systems.magnetic.swings import compare_swings, steer_card
from groundstation.systems.magnetic.three_methods import (
    FORECAST_BANKS_DEG,
    Fits,
    bias_coefficients,
    fit_all,
    method_rows,
    recommend,
)
from groundstation.systems.magnetic.verdict import JudgedValues, build_gates, decide
from groundstation.tables.phases import Phases, flight_phases
from groundstation.tables.table import Flight


def estimate_deviation(
    flight: Flight,
    *,
    settings: MagneticSettings | None = None,
    heading: HeadingByTrack | None = None,
    on_ground: HeadingOnGround | None = None,
    by_turns: AzimuthByTurns | None = None,
    latencies: Delays | None = None,
    kinds: Mapping[str, str] | None = None,
    aircraft: AircraftData | None = None,
    phases: Phases | None = None,
    states: StatesAlongTheFlight | None = None,
    ins_topic: str = "",
    magnetometer_topic: str = "",
) -> MagneticResult:
    """Find the deviation of the magnetic heading from opposite turns of steady bank.

    Parameters
    ----------
    flight : Flight
        Topics ``ins`` (roll, pitch, true heading) and ``magnetometer``; ``electric`` where there is one.
    settings : MagneticSettings, optional
    heading : HeadingByTrack, optional
        Answer of the heading analysis: aligns the INS heading with its whole interval.
    on_ground : HeadingOnGround, optional
        Looks at the ground run up to lift-off, where the answer of the heading analysis does not align.
    by_turns : AzimuthByTurns, optional
        Answer of the inertial analysis: its azimuth by turns aligns too.
    latencies : Delays, optional
        Where that of the magnetometer is observed, its times are put back by it.
    kinds : mapping of INS topic to kind, optional
        ``gnss_aided`` where the inertial analysis found that other sensors correct the INS.
    aircraft : AircraftData, optional
        Its mounting angle is taken off the INS heading, apart from the alignment.
    phases : Phases, optional
        Default: found here.
    states : StatesAlongTheFlight, optional
        Where their checks hold, their attitude and heading stand in place of those of an INS that is no independent
        reference, or whose aligned heading is less sure.
    ins_topic, magnetometer_topic : str
        Default: the first that have what is needed.

    Raises
    ------
    NotAssessableError
        With the reason: no magnetometer, no independent heading, no figure, no declination.

    Notes
    -----
    Error = magnetic heading (levelled by the attitude) - true heading of the aligned INS. Opposite banks are averaged
    at equal magnetic headings in bins of 1 deg; beside that table hard and soft iron are fitted with the attitude, and
    from the modulus alone. Level flight outside the figures judges all three.

    Source: Russian patent on the deviation of magnetometric sensors determined in flight; prior art RU 2550774.
    """
    settings = settings or MagneticSettings()
    topics = choose_topics(flight, ins_topic, magnetometer_topic)
    phases = phases or flight_phases(flight)
    given = _Given(flight, topics, phases, kinds or {}, latencies, settings, aircraft or AircraftData())
    flown, alignment = _referred(
        given, reference_of(states, settings), lambda found: _by_ins(given, found, heading, on_ground, by_turns)
    )
    by = alignment.source("states")
    mounting_deg = 0.0 if by is not None and by.is_used else given.aircraft.mounting_deg
    readings = _aligned(flown.readings, alignment, mounting_deg)
    result = _answer(flight, topics, readings, flown.is_airborne, (flown.figures, flown.turns), alignment, settings)
    return replace(result, remarks=remarks_on(flight, result, flown.latency_s, kinds or {}, settings))


class _Given(NamedTuple):
    """Flight and what is known of it."""

    flight: Flight
    topics: tuple[str, str]
    phases: Phases
    kinds: Mapping[str, str]
    latencies: Delays | None
    settings: MagneticSettings
    aircraft: AircraftData

    def flown(self, states: BodyStates | None = None) -> FlownTurns:
        """Find the turns, with the attitude of the INS or of states."""
        return find_flown(self.flight, self.topics, self.phases, self.kinds, self.latencies, self.settings, states)


def _referred(
    given: _Given, reference: StatesReference | None, by_ins: Callable[[FlownTurns], Alignment]
) -> tuple[FlownTurns, Alignment]:
    """Return the turns by the surer reference, INS or states, and what aligns it."""
    try:
        flown = given.flown()
        alignment = by_ins(flown)
    except NotAssessableError:
        if reference is None:
            raise
        return _by_states(given, reference)
    if reference is None:
        return flown, alignment
    try:
        other, by_states = _by_states(given, reference)
    except NotAssessableError:
        return flown, alignment
    if by_states.sigma_deg < alignment.sigma_deg:
        return other, by_states
    source = not_taken(by_states.sigma_deg, by_states.figure_at_s)
    return flown, replace(alignment, sources=(*alignment.sources, source))


def _by_states(given: _Given, reference: StatesReference) -> tuple[FlownTurns, Alignment]:
    flown = given.flown(reference.states)
    rows = np.concatenate([figure.rows(right) for figure in flown.figures for right in (True, False)])
    times_s = flown.readings.time_s[rows]
    return flown, aligned_by_states(
        reference, given.topics[0], times_s, _figure_at_s(flown), given.settings, given.aircraft
    )


def _by_ins(
    given: _Given,
    flown: FlownTurns,
    heading: HeadingByTrack | None,
    on_ground: HeadingOnGround | None,
    by_turns: AzimuthByTurns | None,
) -> Alignment:
    flight, ins_topic, settings = given.flight, given.topics[0], given.settings
    runs = find_ground_runs(
        flight, ins_topic, heading, given.phases, on_ground, settings, is_enough=lambda one: not refused(one)
    )
    gyros = gyros_at_standstill(flight, ins_topic, given.phases, settings)
    return align(
        heading, ins_topic, _figure_at_s(flown), settings, runs, gyros, by_turns=by_turns, aircraft=given.aircraft
    )


def _figure_at_s(flown: FlownTurns) -> float:
    return float(np.mean([0.5 * (figure.start_s + figure.end_s) for figure in flown.figures]))


def _answer(
    flight: Flight,
    topics: tuple[str, str],
    readings: Readings,
    is_airborne: BoolArray,
    found: tuple[list[OppositeTurns], list[FoundTurn]],
    alignment: Alignment,
    settings: MagneticSettings,
) -> MagneticResult:
    figures, turns = found
    branches = [np.concatenate([figure.rows(right) for figure in figures]) for right in (True, False)]
    rows = np.sort(np.concatenate(branches))
    along, declination, earth = earth_field(flight, readings, rows, settings)
    table = build_table(readings.magnetic_heading_deg, readings.compass_error_deg, branches[0], branches[1])
    nothing: tuple[None, None, NDArray[np.intp]] = (None, None, np.zeros(0, dtype=np.intp))
    unseen, held_out, judged = hold_out(readings, along, is_airborne, figures, alignment, settings) or nothing
    fits = fit_all(readings.take(rows), table, earth, unseen, settings)
    deviation = -wrap_180(table.average_deg + declination.value_deg)
    part = parts_of(is_airborne, np.isin(np.arange(len(readings)), judged), figures)
    a_sigma = math.hypot(alignment.sigma_deg, declination.sigma_deg)
    methods = method_rows(fits, unseen, deviation, declination.value_deg, a_sigma)
    biases = _biases(fits)
    flown = next((bias for bias in biases if bias.is_flown), None)
    gain, bias_rms = _gain_of_iron(unseen, fits, deviation), flown.rms_deg if flown else 0.0
    method, recommendation = recommend(methods, gain, bias_rms, fits.bank_deg, settings)
    chosen = next(row for row in methods if row.name == method)
    residual = _residual(chosen)
    coverage = _coverage(figures, table)
    swings = compare_swings(readings, declination.value_deg, figures)
    used = [one.turn for one in turns if one.turn.state == "used"]
    shift = fits.attitude.dip_shift if not fits.attitude.reason else None
    judged_values = JudgedValues(
        turns=used,
        swings=swings,
        coverage=coverage,
        alignment=alignment,
        residual=residual,
        bank_bias=flown,
        method=method,
        dip_sigmas=shift.sigmas if shift else None,
    )
    gates = build_gates(judged_values, settings)
    verdict, reason = decide(gates)
    conditions = FlownConditions(
        readings,
        is_airborne,
        np.isin(np.arange(len(readings)), rows),
        is_airborne & is_level(readings, settings),
        fits.pitch_deg,
    )
    card = deviation if method == "compass_table" else -_level_errors(fits)
    return MagneticResult(
        ins_topic=topics[0],
        magnetometer_topic=topics[1],
        verdict=verdict,
        verdict_reason=reason,
        recommended_method=method,
        recommendation=recommendation,
        coefficients_deg=methods[0].coefficients_deg,
        coefficients_sigma_deg=methods[0].coefficients_sigma_deg,
        a_parts=_a_parts(fits, alignment, declination.sigma_deg),
        compass_error_deg=tuple(map(float, table.average_deg)),
        deviation_deg=tuple(map(float, deviation)),
        coverage=coverage,
        residual_rms_deg=residual,
        alignment=alignment,
        declination=declination,
        gates=gates,
        methods=methods,
        turns=tuple(one.turn for one in turns),
        swings=tuple(swings),
        bank_bias=biases,
        card=steer_card(card, chosen.coefficients_sigma_deg, table.is_measured, settings.card_step_deg),
        held_out=held_out,
        poisson=_parameters(fits.attitude, a_sigma),
        modulus=_parameters(fits.modulus, a_sigma),
        table_fit_rms_deg=table.fit_rms_deg,
        attitude_wander_deg=fits.attitude_wander_deg,
        other_conditions=other_conditions(
            flight, conditions, fits.attitude, method, wander_deg=settings.attitude_wander_deg
        ),
        settings={name: value for name, value in asdict(settings).items() if value is not None},
        figures=draw(readings, along, part, figures, fits, deviation, methods, (method, card)),
    )


def _gain_of_iron(unseen: Unseen | None, fits: Fits, deviation_deg: FloatArray) -> float:
    """Return by how many sigma the iron leaves less than the table on level flight.

    0 where that cannot be told.
    """
    if unseen is None or fits.attitude.reason:
        return 0.0
    by_table = corrected_by_table(unseen.readings.magnetic_heading_deg, deviation_deg)
    by_iron = corrected_heading_deg(fits.attitude.iron, unseen.readings)
    return advantage(unseen, unseen.error_deg(by_table), unseen.error_deg(by_iron))


def _residual(row: Method) -> Residual | None:
    if row.held_out_before_deg is None or row.held_out_after_deg is None:
        return None
    return Residual(row.held_out_before_deg, row.held_out_after_deg)


def _parameters(fit: IronFit, azimuth_sigma_deg: float) -> PoissonParameters | None:
    """The iron of a fit, None where it is refused."""
    return None if fit.reason else parameters_of(fit.iron, fit.stated_covariance(azimuth_sigma_deg))


def _aligned(readings: Readings, alignment: Alignment, mounting_deg: float) -> Readings:
    """Return readings with the INS heading corrected, drift included.

    corrected = reading - estimated error.
    """
    hours = (readings.time_s - alignment.figure_at_s) / S_PER_H
    error = alignment.error_deg + alignment.drift_deg_per_h * hours
    return replace(readings, true_heading_deg=wrap_360(readings.true_heading_deg - mounting_deg - error))


def _coverage(figures: list[OppositeTurns], table: CompassTable) -> Coverage:
    measured = int(np.count_nonzero(table.is_measured))
    share = max(figure.covered_share for figure in figures)
    return Coverage(share, measured, len(table.is_measured) - measured, widest_gap_deg(table.is_measured))


def _biases(fits: Fits) -> tuple[BankBias, ...]:
    """Forecast at round banks and at the bank flown."""
    if fits.forecast is None:
        return ()
    iron, earth = fits.forecast.iron, fits.forecast.earth
    banks = [(bank, False) for bank in FORECAST_BANKS_DEG] + [(fits.bank_deg, True)]
    return tuple(
        BankBias(bank, curve_rms(bank_bias(iron, earth.horizontal_nt, earth.down_nt, bank, fits.pitch_deg)), is_flown)
        for bank, is_flown in sorted(banks)
    )


def _level_errors(fits: Fits) -> FloatArray:
    earth = fits.attitude.earth
    return heading_errors(fits.attitude.iron, earth.horizontal_nt, earth.down_nt, 0.0, fits.pitch_deg)


def _a_parts(fits: Fits, alignment: Alignment, declination_sigma_deg: float) -> tuple[SigmaPart, ...]:
    aligned = min(alignment.aligned_sigma_deg, alignment.sigma_deg)
    bias, bias_covariance = bias_coefficients(fits, math.hypot(alignment.sigma_deg, declination_sigma_deg))
    return (
        SigmaPart("readings", float(np.sqrt(fits.table.covariance[0, 0]))),
        SigmaPart("alignment", aligned),
        SigmaPart("INS drift until the figure", math.sqrt(alignment.sigma_deg**2 - aligned**2)),
        SigmaPart("declination", declination_sigma_deg),
        SigmaPart("wander of roll and pitch", math.sqrt(float(fits.wander[0, 0]))),
        SigmaPart("bank bias", math.hypot(float(bias[0]), math.sqrt(float(bias_covariance[0, 0])))),
    )
