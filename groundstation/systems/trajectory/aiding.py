"""Estimate of a segment with its aids.

They are tried together, judged, and left out where one does not fit.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.systems.trajectory import compass_rows, observations
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.aids_answer import AidName, AidRow
from groundstation.systems.trajectory.aids_input import Aids
from groundstation.systems.trajectory.estimate import (
    SETTLE_ROUNDS,
    Estimate,
    Hypothesis,
    fitted,
    hypotheses_of,
    relinearised,
    settle,
    without_slip,
)
from groundstation.systems.trajectory.fit import Number
from groundstation.systems.trajectory.inputs import AidReadings, CompassReadings
from groundstation.systems.trajectory.model import Model
from groundstation.systems.trajectory.passes import Pass, run_pass
from groundstation.systems.trajectory.states import HEIGHT, POSITION, VELOCITY, WHEEL
from groundstation.systems.trajectory.track import smoothed_track

T = TypeVar("T", AidReadings, CompassReadings)
NUMBERS = {
    HEIGHT: (Number("baro_m", 1.0, 0.05, 20.0), Number("baro_walk_m_rth", 1.0, 0.05, 30.0)),
    WHEEL: (Number("wheel_mps", 1.0, 0.1, 20.0),),
}
NAMES: dict[int, AidName] = {HEIGHT: "barometer", WHEEL: "wheel speed"}
AXES = {HEIGHT: (2,), WHEEL: (0, 1)}  # of GNSS that an aid speaks of
WORSE, WORSE_BY = 1.25, 0.1  # innovations of GNSS with an aid, over those without
LOST_SHARE = 0.02  # of GNSS that an aid may throw out
NEAR_DEG = 30.0  # of a heading hypothesis to be the same


@dataclass(frozen=True)
class Fitting:
    """Mean squared innovation over what is expected, and the share that the gate let in."""

    ratio: float
    used_share: float


def aided(
    plain: Estimate, aids: Aids, settings: AidSettings, *, ambiguous_below: float, fit: bool = True
) -> tuple[Estimate, tuple[AidRow, ...]]:
    """Return the estimate with the aids that fit, and a row for each that the log has.

    Parameters
    ----------
    plain : Estimate
        Without aids.
    ambiguous_below : float
        Log units between two headings below which motion does not decide.
    fit : bool
        Fit the noise of the aids; else that of the model stays.
    """
    rows = {row.topic: row for row in aids.rows}
    done = plain
    if aids.compass is not None:
        row = next(one for one in aids.rows if one.name == "magnetic heading" and one.is_used)
        done, why = _with_compass(plain, aids.compass, settings, ambiguous_below)
        if why:
            rows[row.topic] = replace(row, is_used=False, reason=why, is_wrong=True)
    wanted = {HEIGHT: aids.height, WHEEL: aids.speed}
    readings = {kind: one for kind, one in wanted.items() if one is not None}
    if WHEEL in readings and not done.problem.has_slip:
        _leave(rows, WHEEL, "its direction of travel in the unit is not that of what rolls", is_wrong=False)
        del readings[WHEEL]
    base = done
    while readings:
        tried = _tried(base, readings, fit=fit)
        wrong = {kind: why for kind in readings if (why := _why_not(base, tried, kind, settings))}
        if not wrong:
            done = tried
            _tell_noise(rows, tried.model)
            break
        for kind, why in wrong.items():
            _leave(rows, kind, why)
            del readings[kind]
    return done, tuple(rows.values())


def may_roll(vehicle: str | None, settings: AidSettings) -> bool:
    """Tell whether no sideways motion is tried.

    It is of what rolls, unless the user switched it off.
    """
    return vehicle == "rolls" and settings.use_no_sideways_motion


def row_of_no_slip(vehicle: str | None, done: Estimate, settings: AidSettings) -> tuple[AidRow, ...]:
    """Return whether no sideways motion was used, of what rolls."""
    if vehicle != "rolls":
        return ()
    if done.problem.has_slip:
        reason = f"sideways and upward motion of what rolls, {done.model.slip_mps:.2g} m/s"
    elif not settings.use_no_sideways_motion:
        reason = "switched off (use_no_sideways_motion): how the unit stands to the travel is not measured either"
    else:
        reason = "its direction of travel in the unit is not as steady as that of what rolls"
    return (AidRow("no sideways motion", "", done.problem.has_slip, reason),)


def _leave(rows: dict[str, AidRow], kind: int, why: str, *, is_wrong: bool = True) -> None:
    topic = next(one.topic for one in rows.values() if one.name == NAMES[kind] and one.is_used)
    rows[topic] = replace(rows[topic], is_used=False, reason=why, is_wrong=is_wrong)


def _tell_noise(rows: dict[str, AidRow], model: Model) -> None:
    """Add the noise of the aids that are used."""
    said: dict[AidName, str] = {
        "barometer": f"noise {model.baro_m:.2g} m, offset walks by {model.baro_walk_m_rth:.2g} m in an hour",
        "wheel speed": f"noise {model.wheel_mps:.2g} m/s",
    }
    for topic, row in rows.items():
        if row.is_used and row.name in said:
            rows[topic] = replace(row, reason="; ".join(filter(None, (row.reason, said[row.name]))))


def _tried(base: Estimate, readings: dict[int, AidReadings], *, fit: bool) -> Estimate:
    """Return the estimate with aids, their noise fitted."""
    parts = [observations.of_readings(one, kind) for kind, one in readings.items()]
    problem = replace(
        base.problem,
        seen=observations.joined([base.problem.seen, *parts]),
        has_baro=HEIGHT in readings,
        has_wheels=WHEEL in readings,
    )
    model, rules, found = base.model, base.gate, base.fit
    start = problem.restarted(base.result.start, model)
    result = run_pass(problem.samples, problem.plan(model), problem.noise(model), rules, start, has_sigmas=False)
    if fit:
        result = relinearised(problem, model, rules, result, 1, has_sigmas=False)
        numbers = tuple(number for kind in readings for number in NUMBERS[kind])
        fresh = fitted(problem, model, result, numbers)
        found = replace(fresh, at_bound=(*found.at_bound, *fresh.at_bound))
        model = found.model
    result = relinearised(problem, model, rules, result)
    return replace(base, problem=problem, model=model, fit=found, result=result)


def fitting(done: Pass, kinds: Iterable[int], axes: tuple[int, ...] = (0, 1, 2)) -> Fitting:
    """Return how measurements of some kinds fit a pass."""
    solved = done.solved
    of = np.isin(np.repeat(done.plan.seen.kind, 3), list(kinds)) & np.tile(
        np.isin(np.arange(3), axes), len(done.plan.seen.kind)
    )
    used = of & (solved.mark == 1)
    if not used.any():
        return Fitting(float("inf"), 0.0)
    ratio = float(np.mean(solved.y[used] ** 2 / solved.S[used]))
    return Fitting(ratio, float(used.sum() / (of & (solved.mark != 0)).sum()))


def _why_not(base: Estimate, tried: Estimate, kind: int, settings: AidSettings) -> str:
    """Return why an aid is left out; empty where it fits."""
    own = fitting(tried.result, (kind,))
    if own.used_share < settings.used_share_min:
        return f"{own.used_share:.0%} of its readings agree with unit and GNSS, limit {settings.used_share_min:.0%}"
    if own.ratio > settings.nis_max:
        return f"its innovations are {own.ratio:.1f} times what is expected, limit {settings.nis_max:g}"
    before, after = (fitting(one.result, (POSITION, VELOCITY), AXES[kind]) for one in (base, tried))
    if after.ratio > WORSE * before.ratio + WORSE_BY:
        return f"with it innovations of GNSS grow from {before.ratio:.2f} to {after.ratio:.2f} of what is expected"
    if after.used_share < before.used_share - LOST_SHARE:
        return f"with it {after.used_share:.0%} of GNSS agree with the unit, without it {before.used_share:.0%}"
    return ""


# -------------------------------------------------------------------------------------------------------- compass


def _with_compass(
    plain: Estimate, compass: CompassReadings, settings: AidSettings, ambiguous_below: float
) -> tuple[Estimate, str]:
    """Return the estimate with a magnetic heading, or the plain one and why it is not used.

    Where motion shows the heading it is held against it; where motion does not decide it chooses among what is left.
    """
    track = smoothed_track(plain.problem.samples, plain.result)
    seen = compass_rows.observations_of(compass, track)
    if len(seen) < 2:
        return plain, "hardly a reading while the attitude is known"
    heading_sigma_deg = float(np.median(track.attitude_sigma_deg[:, 2]))
    best = plain.hypotheses[0]
    is_open = len(plain.hypotheses) > 1 and best.likelihood - plain.hypotheses[1].likelihood < ambiguous_below
    if not is_open:
        off_deg = compass_rows.off_the_track(compass, track)[2]
        mean_deg = float(np.degrees(np.angle(np.mean(np.exp(1j * np.radians(off_deg))))))
        limit_deg = settings.heading_sigmas * float(np.hypot(compass.sigma_deg, heading_sigma_deg))
        if abs(mean_deg) > limit_deg:
            return plain, (
                f"with the deviation stated it points {mean_deg:+.1f} deg from the heading that motion shows, "
                f"limit {limit_deg:.1f}: wrong coefficients, or iron"
            )
    problem = replace(
        plain.problem,
        seen=observations.joined([plain.problem.seen, seen]),
        heading_sigma_rad=float(np.radians(compass.sigma_deg)),
    )
    model, rules = plain.model, plain.gate
    start, hypotheses = plain.result.start, plain.hypotheses
    if is_open:
        chosen = hypotheses_of(without_slip(problem), model, rules)
        start = chosen[0].start
        why = _against_motion(chosen[0], plain.hypotheses, ambiguous_below)
        if why:
            return plain, why
        problem, start = settle(problem, model, rules, start, SETTLE_ROUNDS)
    result = run_pass(problem.samples, problem.plan(model), problem.noise(model), rules, start, has_sigmas=False)
    result = relinearised(problem, model, rules, result)
    if is_open:
        hypotheses = hypotheses_of(without_slip(problem), model, rules)
    return replace(plain, problem=problem, result=result, hypotheses=hypotheses), ""


def _against_motion(chosen: Hypothesis, motion: tuple[Hypothesis, ...], ambiguous_below: float) -> str:
    """Return why motion speaks against the heading that a compass chose, else nothing."""
    near = [one for one in motion if abs(float(wrap_180(one.end_heading_deg - chosen.end_heading_deg))) < NEAR_DEG]
    below = motion[0].likelihood - max((one.likelihood for one in near), default=-np.inf)
    if below < ambiguous_below:
        return ""
    return (
        f"it points to {chosen.end_heading_deg:.0f} deg at the end, where motion shows "
        f"{motion[0].end_heading_deg:.0f} deg"
    )


def used_alone(aids: Aids, rows: tuple[AidRow, ...]) -> Aids:
    """Return the aids that an estimate used."""
    used = {row.name for row in rows if row.is_used}
    return replace(
        aids,
        height=aids.height if "barometer" in used else None,
        speed=aids.speed if "wheel speed" in used else None,
        compass=aids.compass if "magnetic heading" in used else None,
    )


def of_span(aids: Aids, start_s: float, end_s: float) -> Aids:
    """Return the aids in a span of time."""

    def cut(one: T | None) -> T | None:
        inside = None if one is None else (one.time_s >= start_s) & (one.time_s <= end_s)
        return None if one is None or inside is None or not inside.any() else one.take(inside)

    return replace(aids, height=cut(aids.height), speed=cut(aids.speed), compass=cut(aids.compass))
