"""Deviation of a flux valve in flight: straight legs and turns against a true heading."""

import math
from dataclasses import asdict, replace

import numpy as np

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.base.words import counted, listed
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import Residual, SigmaPart
from groundstation.systems.magnetic.arrays import FluxCurve, FluxEpochRows
from groundstation.systems.magnetic.compass_table import CENTRES_DEG
from groundstation.systems.magnetic.flux_answer import (
    BankError,
    FluxDeviation,
    FluxLeg,
    FluxMethod,
    FluxMethodName,
    ReferenceName,
    WindSolved,
)
from groundstation.systems.magnetic.flux_bank import LagCell, fit_bank
from groundstation.systems.magnetic.flux_epochs import (
    ANALYSIS,
    FluxEpochs,
    find_legs,
    gather_epochs,
    heading_topic,
    is_computed_from,
)
from groundstation.systems.magnetic.flux_fit import LegValues, fit_legs, left_by_turns, left_over, leg_values
from groundstation.systems.magnetic.flux_reference import OtherAnswers, Rows, TrueHeadings, true_headings
from groundstation.systems.magnetic.flux_remarks import flux_remarks
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.flux_turns import OppositeMethod, by_opposite_turns
from groundstation.systems.magnetic.flux_verdict import flux_gates
from groundstation.systems.magnetic.ground_answer import GroundCoefficient
from groundstation.systems.magnetic.ground_epochs import logged_variation_deg, step_of
from groundstation.systems.magnetic.ground_fit import (
    CurveFit,
    along_axis,
    coefficients_of,
    directions_of,
    whole_curve,
    widest_gap_deg,
    with_declination,
)
from groundstation.systems.magnetic.manoeuvre import covered_bins
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.systems.magnetic.swings import steer_card
from groundstation.systems.magnetic.verdict import decide
from groundstation.tables.phases import Phases, flight_phases
from groundstation.tables.table import Flight

LEAST_LEGS = 2
MOST_DIRECTIONS = 4  # told
NEEDED = "straight legs on four headings round the circle"
SLOW_SIGMA_DEG: dict[ReferenceName, float] = {"states": 0.2, "ins": 0.2, "wind": 1.0}  # of a true heading, over minutes
NEAR_DEG = 45.0  # a heading no farther from its neighbours counts as flown
MOST_DRAWN = 4000


@dataclass(frozen=True)
class _Chosen:
    """Method that is recommended: its fit, A to E, and the part of the circle it rests on.

    ``legs_row`` is that of the legs, taken or not; ``covered`` (360,) are the degrees near a heading flown.
    """

    name: FluxMethodName
    fit: CurveFit
    coefficients: tuple[GroundCoefficient, ...]
    legs_row: FluxMethod
    covered: BoolArray
    gap_deg: float
    residual: Residual | None


def estimate_flux_deviation(
    flight: Flight,
    *,
    settings: MagneticFluxSettings | None = None,
    magnetic: MagneticSettings | None = None,
    phases: Phases | None = None,
    others: OtherAnswers | None = None,
    ins_topic: str = "",
) -> FluxDeviation:
    """Find the deviation of a compass that gives heading alone, in flight.

    Parameters
    ----------
    flight : Flight
        ``ins.magnetic_heading_deg``; a true heading with no compass in it, or GNSS velocity and true airspeed.
    settings : MagneticFluxSettings, optional
    magnetic : MagneticSettings, optional
        Limits of turns and of the alignment of the INS.
    phases : Phases, optional
    others : OtherAnswers, optional
        Best trajectory, heading error, azimuth by turns, kinds of INS.
    ins_topic : str
        Default: the first with a magnetic heading.

    Raises
    ------
    NotAssessableError
        With the reason: no heading, a heading that is computed, no reference, hardly a leg.

    Notes
    -----
    error = magnetic heading as read + declination - true heading. Straight legs, settled after a turn, give A to E
    with what each leg has of its own (``ground_fit.py``). The turns show how far the sensing element leans and how
    slowly the display follows it (``flux_bank.py``); with a lag the harmonics of the legs are those that the display
    had followed. Opposite turns are averaged beside that, and refused where bank and lag leave too much.

    What it ignores: a slaving that is cut out in turns or limited in rate; a lean that lags behind the bank; currents
    that hang on the heading.
    """
    settings, magnetic = settings or MagneticFluxSettings(), magnetic or MagneticSettings()
    phases, others = phases or flight_phases(flight), others or OtherAnswers()
    topic = heading_topic(flight, ins_topic)
    epochs = gather_epochs(flight, topic, phases, settings)
    if is_computed_from(flight, topic, epochs):
        text = f"the magnetic heading of {topic} is its true heading less a stored variation: no compass is in it"
        raise NotAssessableError(ANALYSIS, text)
    legs = find_legs(epochs, settings)
    known = true_headings(flight, topic, epochs, legs, settings, magnetic, others)
    level = math.hypot(epochs.used.sigma_deg, known.common_sigma_deg)  # that all errors share
    error = wrap_180(epochs.heading_deg + epochs.declination_deg - known.true_deg)
    name = known.references[0].name
    bank, cells = fit_bank(epochs, error, SLOW_SIGMA_DEG[name], settings)
    step = step_of(flight[topic], "magnetic_heading_deg")
    values = leg_values(epochs, legs, known, error, step, settings)
    turns = by_opposite_turns(epochs, known.true_deg, bank, cells, level, settings, magnetic)
    if len(values.rows) < LEAST_LEGS and turns.fit is None:
        raise NotAssessableError(ANALYSIS, _why_no_leg(legs, values, settings), NEEDED)
    chosen = _choose(values, cells, turns, level, settings)
    found = replace(
        _answer(epochs, topic, legs, values, known, bank, chosen, turns, level, settings),
        logged_variation_deg=logged_variation_deg(flight, topic, epochs.time_ns),
        heading_step_deg=step,
        figures=_figures(epochs, error, values, cells, chosen, level),
    )
    return replace(found, remarks=flux_remarks(found, _is_levelled(flight, topic), settings))


def _answer(
    epochs: FluxEpochs,
    topic: str,
    legs: list[Rows],
    values: LegValues,
    known: TrueHeadings,
    bank: BankError,
    chosen: _Chosen,
    turns: OppositeMethod,
    level_deg: float,
    settings: MagneticFluxSettings,
) -> FluxDeviation:
    fit, is_by_legs = chosen.fit, chosen.name == "straight_legs"
    sigma = np.sqrt(np.diag(with_declination(fit.covariance, level_deg)))
    gates = flux_gates(
        {
            "gap": chosen.gap_deg,
            "curve": float(np.sqrt(0.5 * np.sum(sigma[1:] ** 2))),
            "level": float(sigma[0]),
            "left": chosen.residual.after if chosen.residual else None,
            "dip": None if epochs.dip_deg is None else abs(epochs.dip_deg),
        },
        bank,
        settings,
    )
    verdict, reason = decide(gates)
    deviation = -whole_curve(fit, CENTRES_DEG, level_deg)[0]
    by_letter = dict(zip(LETTERS, map(float, sigma), strict=True))
    return FluxDeviation(
        ins_topic=topic,
        verdict=verdict,
        verdict_reason=reason,
        recommended_method=chosen.name,
        references=known.references,
        declination=epochs.used,
        legs=_told_legs(epochs, legs, values, level_deg),
        methods=(chosen.legs_row, turns.row),
        coefficients=chosen.coefficients,
        a_parts=_a_parts(fit, epochs, known),
        bank_error=bank,
        directions=len(directions_of(values.heading_deg, settings.repeat_within_deg)),
        widest_gap_deg=chosen.gap_deg,
        settle_s=settings.settle_s,
        place_sigma_deg=fit.place_sigma_deg,
        gates=gates,
        card=steer_card(deviation, by_letter, chosen.covered, settings.card_step_deg),
        deviation_deg=tuple(map(float, deviation)),
        wind=_wind_told(epochs, known),
        along=along_axis(fit, chosen.coefficients, settings) if is_by_legs else None,
        residual_rms_deg=chosen.residual,
        dip_deg=epochs.dip_deg,
        settings={name: value for name, value in asdict(settings).items() if value is not None},
    )


def _choose(
    values: LegValues,
    cells: tuple[LagCell, ...],
    turns: OppositeMethod,
    level_deg: float,
    settings: MagneticFluxSettings,
) -> _Chosen:
    """Fit the legs, and take that or the opposite turns.

    Raises
    ------
    NotAssessableError
        When what is taken does not show A, B and C.
    """
    by_legs = fit_legs(values, cells, settings) if len(values.rows) >= LEAST_LEGS else None
    shown = coefficients_of(by_legs, level_deg, settings) if by_legs is not None else ()
    row = _legs_row(shown, values)
    if turns.fit is not None and (by_legs is None or _tell_turns_more(shown, turns.row)):
        told = tuple(
            GroundCoefficient(letter, turns.row.coefficients_deg[letter], sigma, "found")
            for letter, sigma in turns.row.coefficients_sigma_deg.items()
        )
        residual = left_by_turns(values, turns.fit.values_deg)
        return _Chosen("opposite_turns", turns.fit, told, row, np.ones(360, dtype=bool), 0.0, residual)
    if by_legs is None or any(one.state != "found" for one in shown[:3]):
        raise NotAssessableError(ANALYSIS, _why_open(shown, values, level_deg, settings), NEEDED)
    covered, gap = covered_bins(values.heading_deg, 2.0 * NEAR_DEG), widest_gap_deg(values.heading_deg)
    return _Chosen("straight_legs", by_legs, shown, row, covered, gap, left_over(values, cells, settings))


def _legs_row(coefficients: tuple[GroundCoefficient, ...], values: LegValues) -> FluxMethod:
    if not coefficients:
        return FluxMethod("straight_legs", "refused", f"{len(values.rows)} straight legs with a true heading")
    found = [one for one in coefficients if one.value_deg is not None]
    return FluxMethod(
        "straight_legs",
        "fitted" if found else "refused",
        "" if found else "the headings flown show no coefficient",
        len(values.rows),
        {one.letter: float(one.value_deg or 0.0) for one in found},
        {one.letter: one.sigma_deg for one in found},
    )


def _tell_turns_more(coefficients: tuple[GroundCoefficient, ...], turns: FluxMethod) -> bool:
    """Tell whether opposite turns tell more than the legs, or the same better."""
    seen = {one.letter: one.sigma_deg for one in coefficients if one.state == "found"}
    if set(LETTERS) - set(seen):
        return True
    legs, other = (sum(sigma[letter] ** 2 for letter in "BCDE") for sigma in (seen, turns.coefficients_sigma_deg))
    return legs > other


def _a_parts(fit: CurveFit, epochs: FluxEpochs, known: TrueHeadings) -> tuple[SigmaPart, ...]:
    used = known.references[0]
    name = {"states": "best trajectory", "ins": "INS heading", "wind": "steady sideslip"}[used.name]
    return (
        SigmaPart("readings", float(np.sqrt(fit.covariance[0, 0]))),
        SigmaPart("declination", epochs.used.sigma_deg),
        SigmaPart(name, known.common_sigma_deg),
    )


def _told_legs(epochs: FluxEpochs, legs: list[Rows], values: LegValues, level_deg: float) -> tuple[FluxLeg, ...]:
    told = []
    for first, last in legs:
        place = values.rows.index((first, last)) if (first, last) in values.rows else None
        altitude = epochs.altitude_m[first:last]
        sigma = None
        if place is not None:
            own = values.own_deg[place] ** 2 + values.common[place, place] + level_deg**2
            sigma = math.sqrt(max(float(own), 0.0))
        told.append(
            FluxLeg(
                start_s=float(epochs.time_s[first]),
                end_s=float(epochs.time_s[last - 1]),
                magnetic_heading_deg=mean_heading(epochs.heading_deg[first:last]),
                true_heading_deg=float(values.true_deg[place]) if place is not None else None,
                error_deg=float(values.error_deg[place]) if place is not None else None,
                noise_sigma_deg=float(values.noise_deg[place]) if place is not None else None,
                sigma_deg=sigma,
                speed_mps=float(np.nanmean(epochs.speed_mps[first:last])),
                altitude_m=float(np.nanmean(altitude)) if np.isfinite(altitude).any() else None,
                samples=last - first,
                state="used" if place is not None else "rejected",
                reason="" if place is not None else "no true heading, or the heading changes on it",
            )
        )
    return tuple(told)


def _wind_told(epochs: FluxEpochs, known: TrueHeadings) -> WindSolved | None:
    wind = known.wind
    if wind is None:
        return None
    north, east = np.nanmean(wind.wind_mps[epochs.is_airborne], axis=0).tolist()
    return WindSolved(north, east, wind.changes_mps, wind.scale, wind.scale_sigma)


def _figures(
    epochs: FluxEpochs,
    error_deg: FloatArray,
    values: LegValues,
    cells: tuple[LagCell, ...],
    chosen: _Chosen,
    level_deg: float,
) -> tuple[FigureData, ...]:
    best = max(cells, key=lambda one: one.weight)
    leg = np.zeros(len(epochs), dtype=np.int64)
    for place, (first, last) in enumerate(values.rows):
        leg[first:last] = place + 1
    rows = np.flatnonzero(epochs.is_airborne & np.isfinite(error_deg))
    rows = rows[:: max(1, -(-len(rows) // MOST_DRAWN))]
    curve, sigma = whole_curve(chosen.fit, CENTRES_DEG, level_deg)
    return (
        FluxEpochRows(
            time_s=epochs.time_s[rows],
            leg=leg[rows],
            magnetic_heading_deg=epochs.heading_deg[rows],
            heading_error_deg=error_deg[rows],
            lean_deg=epochs.lean_deg[rows],
            bank_error_deg=best.bank_deg[rows],
        ),
        FluxCurve(
            uncorrected_magnetic_heading_deg=CENTRES_DEG,
            heading_error_deg=curve,
            heading_error_sigma_deg=sigma,
            deviation_to_add_deg=-curve,
            deviation_sigma_deg=sigma,
            is_interpolated=~chosen.covered,
        ),
    )


def _is_levelled(flight: Flight, topic: str) -> bool:
    """Tell whether the topic has an attitude beside the heading, as an AHRS has."""
    return flight[topic].has("roll_deg", "pitch_deg")


def _why_no_leg(legs: list[Rows], values: LegValues, settings: MagneticFluxSettings) -> str:
    if not legs:
        return (
            f"no straight leg in flight of {settings.leg_min_s:g} s, {settings.settle_s:g} s after a turn, below "
            f"{settings.leg_bank_max_deg:g} deg of bank"
        )
    return f"{len(values.rows)} of {len(legs)} straight legs have a true heading"


def _why_open(
    coefficients: tuple[GroundCoefficient, ...], values: LegValues, level_deg: float, settings: MagneticFluxSettings
) -> str:
    """Return what the legs show, where that is not A, B and C."""
    groups = directions_of(values.heading_deg, settings.repeat_within_deg)
    told = []
    for group in groups[:MOST_DIRECTIONS]:
        error = mean_heading(values.error_deg[group])
        own = values.own_deg[group] ** 2 + np.diag(values.common)[group]
        sigma = math.sqrt(float(np.min(own)) + level_deg**2)
        at = mean_heading(values.heading_deg[group])
        told.append(f"{float(wrap_180(error)):+.1f} +- {sigma:.1f} deg at {at:.0f} deg")
    missing = [row.letter for row in coefficients[:3] if row.state != "found"]
    directions = counted(len(groups), "direction")
    gap = widest_gap_deg(values.heading_deg)
    shown = f"; error {', '.join(told)}" if told else ""
    return f"straight legs in {directions}, widest gap {gap:.0f} deg, do not show {listed(missing)}{shown}"
