"""Deviation of a flux valve in flight: straight legs and turns against a true heading."""

import math
from dataclasses import asdict, replace

import numpy as np

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.base.words import listed
from groundstation.methods import harmonics
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import SigmaPart
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
from groundstation.systems.magnetic.flux_verdict import flux_decide, flux_gates
from groundstation.systems.magnetic.ground_answer import GroundCoefficient
from groundstation.systems.magnetic.ground_epochs import logged_variation_deg, step_of
from groundstation.systems.magnetic.ground_fit import (
    CurveFit,
    along_axis,
    coefficients_of,
    directions_of,
    widest_gap_deg,
    with_declination,
)
from groundstation.systems.magnetic.manoeuvre import covered_bins
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.systems.magnetic.swings import steer_card
from groundstation.tables.phases import Phases, flight_phases
from groundstation.tables.table import Flight

LEAST_LEGS = 2
MOST_DIRECTIONS = 4  # told
NEEDED = "straight legs on four headings round the circle"
SLOW_SIGMA_DEG: dict[ReferenceName, float] = {"states": 0.2, "ins": 0.2, "wind": 1.0}  # of a true heading, over minutes
NEAR_DEG = 45.0  # a heading no farther from its neighbours counts as flown
MOST_DRAWN = 4000


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
    error = wrap_180(epochs.heading_deg + epochs.declination_deg - known.true_deg)
    name = known.references[0].name
    bank, cells = fit_bank(epochs, error, SLOW_SIGMA_DEG[name], settings, is_by_wind=name == "wind")
    step = step_of(flight[topic], "magnetic_heading_deg")
    values = leg_values(epochs, legs, known, error, step, settings)
    turns = by_opposite_turns(epochs, known.true_deg, bank, cells, _level_sigma(epochs, known), settings, magnetic)
    if len(values.rows) < LEAST_LEGS and turns.values_deg is None:
        raise NotAssessableError(ANALYSIS, _why_no_leg(legs, values, settings), NEEDED)
    found = replace(
        _answer(epochs, topic, legs, values, known, bank, cells, turns, settings),
        logged_variation_deg=logged_variation_deg(flight, topic, epochs.time_ns),
        heading_step_deg=step,
    )
    verdict, reason = flux_decide(found.gates)
    fit = _recommended_fit(found.recommended_method, values, cells, turns, settings)
    found = replace(
        found,
        verdict=verdict,
        verdict_reason=reason,
        figures=_figures(epochs, error, values, cells, fit, found, _level_sigma(epochs, known)),
    )
    return replace(found, remarks=flux_remarks(found, _is_levelled(flight, topic), settings))


def _answer(
    epochs: FluxEpochs,
    topic: str,
    legs: list[Rows],
    values: LegValues,
    known: TrueHeadings,
    bank: BankError,
    cells: tuple[LagCell, ...],
    turns: OppositeMethod,
    settings: MagneticFluxSettings,
) -> FluxDeviation:
    level = _level_sigma(epochs, known)
    fit = fit_legs(values, cells, settings) if len(values.rows) >= LEAST_LEGS else None
    by_legs = coefficients_of(fit, level, settings) if fit is not None else ()
    row = _legs_row(by_legs, fit, level, values)
    name = _recommend(by_legs, row, turns)
    chosen = _recommended_fit(name, values, cells, turns, settings)
    coefficients = by_legs if name == "straight_legs" else _all_found(turns)
    if any(row.state != "found" for row in coefficients[:3]):
        raise NotAssessableError(ANALYSIS, _why_open(coefficients, values, level, settings), NEEDED)
    covered, gap = _covered(values, turns, name)
    residual = (
        left_over(values, cells, settings) if name == "straight_legs" else left_by_turns(values, chosen.values_deg)
    )
    covariance = with_declination(chosen.covariance, level)
    sigma = np.sqrt(np.diag(covariance))
    gates = flux_gates(
        {
            "gap": gap,
            "curve": float(np.sqrt(0.5 * np.sum(sigma[1:] ** 2))),
            "level": float(sigma[0]),
            "left": residual.after if residual else None,
            "dip": None if epochs.dip_deg is None else abs(epochs.dip_deg),
        },
        settings,
    )
    deviation = -wrap_180(harmonics.design(CENTRES_DEG) @ chosen.values_deg)
    by_letter = dict(zip(LETTERS, map(float, sigma), strict=True))
    return FluxDeviation(
        ins_topic=topic,
        verdict="undecided",
        verdict_reason="",
        recommended_method=name,
        references=known.references,
        declination=epochs.used,
        legs=_told_legs(epochs, legs, values, level),
        methods=(row, turns.row),
        coefficients=coefficients,
        a_parts=_a_parts(chosen, epochs, known),
        bank_error=bank,
        directions=len(directions_of(values.heading_deg, settings.repeat_within_deg)),
        widest_gap_deg=gap,
        settle_s=settings.settle_s,
        place_sigma_deg=chosen.place_sigma_deg,
        gates=gates,
        card=steer_card(deviation, by_letter, covered, settings.card_step_deg),
        deviation_deg=tuple(map(float, deviation)),
        wind=_wind_told(epochs, known),
        along=along_axis(chosen, coefficients, settings) if name == "straight_legs" else None,
        residual_rms_deg=residual,
        dip_deg=epochs.dip_deg,
        settings={name: value for name, value in asdict(settings).items() if value is not None},
    )


def _level_sigma(epochs: FluxEpochs, known: TrueHeadings) -> float:
    """Sigma that all errors share: declination and reference."""
    return math.hypot(epochs.used.sigma_deg, known.common_sigma_deg)


def _legs_row(
    coefficients: tuple[GroundCoefficient, ...], fit: CurveFit | None, level_deg: float, values: LegValues
) -> FluxMethod:
    if fit is None:
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


def _recommend(coefficients: tuple[GroundCoefficient, ...], row: FluxMethod, turns: OppositeMethod) -> FluxMethodName:
    """Return the legs, or opposite turns where those tell more, or the same better."""
    if turns.values_deg is None:
        return "straight_legs"
    seen = {one.letter: one.sigma_deg for one in coefficients if one.state == "found"}
    if set("ABCDE") - set(seen):
        return "opposite_turns"
    legs, other = (sum(sigma[letter] ** 2 for letter in "BCDE") for sigma in (seen, turns.row.coefficients_sigma_deg))
    return "straight_legs" if legs <= other else "opposite_turns"


def _recommended_fit(
    name: FluxMethodName,
    values: LegValues,
    cells: tuple[LagCell, ...],
    turns: OppositeMethod,
    settings: MagneticFluxSettings,
) -> CurveFit:
    if name == "opposite_turns" and turns.values_deg is not None and turns.covariance is not None:
        return CurveFit(turns.values_deg, turns.covariance, 0.0)
    return fit_legs(values, cells, settings)


def _all_found(turns: OppositeMethod) -> tuple[GroundCoefficient, ...]:
    row = turns.row
    return tuple(
        GroundCoefficient(letter, row.coefficients_deg[letter], row.coefficients_sigma_deg[letter], "found")
        for letter in LETTERS
    )


def _covered(values: LegValues, turns: OppositeMethod, name: FluxMethodName) -> tuple[np.ndarray, float]:
    """Return the degrees near a heading flown, and the widest part that is not flown."""
    if name == "opposite_turns":
        return np.ones(360, dtype=bool), 0.0
    return covered_bins(values.heading_deg, 2.0 * NEAR_DEG), widest_gap_deg(values.heading_deg)


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
    fit: CurveFit,
    found: FluxDeviation,
    level_deg: float,
) -> tuple[FigureData, ...]:
    best = max(cells, key=lambda one: one.weight)
    leg = np.zeros(len(epochs), dtype=np.int64)
    for place, (first, last) in enumerate(values.rows):
        leg[first:last] = place + 1
    rows = np.flatnonzero(epochs.is_airborne & np.isfinite(error_deg))
    rows = rows[:: max(1, -(-len(rows) // MOST_DRAWN))]
    columns = harmonics.design(CENTRES_DEG)
    covariance = with_declination(fit.covariance, level_deg)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", columns, covariance, columns))
    covered, _gap = (
        (np.ones(360, dtype=bool), 0.0)
        if found.recommended_method == "opposite_turns"
        else (covered_bins(values.heading_deg, 2.0 * NEAR_DEG), 0.0)
    )
    curve = wrap_180(columns @ fit.values_deg)
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
            deviation_to_add_deg=np.array(found.deviation_deg),
            deviation_sigma_deg=sigma,
            is_interpolated=~covered,
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
    directions = f"{len(groups)} direction{'s' * (len(groups) != 1)}"
    gap = widest_gap_deg(values.heading_deg)
    shown = f"; error {', '.join(told)}" if told else ""
    return f"straight legs in {directions}, widest gap {gap:.0f} deg, do not show {listed(missing)}{shown}"
