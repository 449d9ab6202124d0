"""Criteria of wind, threshold, flare, touchdown and roll-out of one approach."""

import math
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import M_PER_FOOT
from groundstation.results.gates import Gate
from groundstation.systems.landing.answer import AlongError, PositionError, RunwayUsed, StabilisedAt
from groundstation.systems.landing.criteria_answer import KINDS, Criterion, CriterionState, Place, Score
from groundstation.systems.landing.criteria_settings import Limits, is_within
from groundstation.systems.landing.geometry import RelativeToRunway
from groundstation.systems.landing.logged import Logged, Series
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.stabilised import PERCENT, place_at, rows_below
from groundstation.systems.landing.sustained import worst_sustained
from groundstation.systems.landing.touchdown_answer import Touchdown
from groundstation.systems.landing.verdict_answer import in_feet_too

if TYPE_CHECKING:
    from groundstation.systems.landing.finals import Final

FLARE_M, FLOAT_M = 50.0 * M_PER_FOOT, 20.0 * M_PER_FOOT
# Landing distance available (m) up to which the aiming point begins so far behind the threshold (m).
# Source: ICAO Annex 14, volume I, table 5-1.
AIMING_POINTS = ((800.0, 150.0), (1_200.0, 250.0), (2_400.0, 300.0), (math.inf, 400.0))
LEAST_WIND_S = 20.0
NOT_LOGGED, AS_RECORDED, CORRECTED = "not in the log", "as recorded", "corrected"
NO_THRESHOLD = "the threshold is placed by the positions themselves"


@dataclass(frozen=True, eq=False, kw_only=True)
class _Seen:
    """Everything that the criteria of one approach are read from."""

    path: FlightPath
    final: "Final"
    runway: RunwayUsed
    relative: RelativeToRunway
    logged: Logged
    touchdown: Touchdown | None
    off: "_Off"
    settings: LandingSettings


@dataclass(frozen=True)
class _Off:
    """Error of the positions along and across the runway, taken off, and what remains.

    ``along_by`` and ``across_by`` name the reference that showed it; empty where nothing is taken off.
    """

    along_m: float
    across_m: float
    along_sigma_m: float
    across_sigma_m: float
    along_by: str = ""
    across_by: str = ""

    @property
    def brief(self) -> str:
        """Say whether figures along the runway are corrected."""
        return CORRECTED if self.along_by else AS_RECORDED

    def along_told(self, recorded: str = "") -> str:
        """Tell how a figure along the runway is corrected, and what is recorded."""
        return _corrected(self.along_m, self.along_by, recorded)

    def across_told(self, recorded: str = "") -> str:
        """Tell a figure across the runway likewise."""
        return _corrected(self.across_m, self.across_by, recorded)


def _corrected(error_m: float, by: str, recorded: str) -> str:
    """Return how a figure stands to the recorded positions.

    Examples
    --------
    >>> _corrected(-193.2, "the glide path", "139 m"), _corrected(0.0, "", "139 m")
    ('corrected: positions less -193 m by the glide path; 139 m as recorded', 'as recorded')
    """
    if not by:
        return AS_RECORDED
    beside = f"; {recorded} {AS_RECORDED}" if recorded else ""
    return f"{CORRECTED}: positions less {error_m:+.0f} m by {by}{beside}"


@dataclass(frozen=True)
class _Value:
    """Value found for a criterion, before it is judged."""

    value: float | None = None
    sigma: float | None = None
    at: Place | None = None
    logged_by: str = ""
    reason: str = ""


def criteria_of(
    path: FlightPath,
    final: "Final",
    runway: RunwayUsed,
    relative: RelativeToRunway,
    logged: Logged,
    touchdown: Touchdown | None,
    step_m: tuple[float, float],
    errors: tuple[tuple[PositionError, ...], tuple[AlongError, ...]],
    settings: LandingSettings,
) -> tuple[Criterion, ...]:
    """Return every criterion beside those of the check heights, judged."""
    seen = _Seen(
        path=path,
        final=final,
        runway=runway,
        relative=relative,
        logged=logged,
        touchdown=touchdown,
        off=_off(path, runway, step_m, *errors, settings),
        settings=settings,
    )
    found = {"thrust": _thrust(seen), **_wind(seen)}
    if touchdown is not None:
        found |= _threshold(seen, touchdown) | _flare(seen, touchdown) | _place(seen, touchdown)
        found |= _manner(seen, touchdown)
    return tuple(judged(name, found[name], settings.criteria.of(name)) for name in KINDS if name in found)


def judged(name: str, found: _Value, limits: Limits) -> Criterion:
    """Judge a value by limits; one whose sigma reaches over a limit is undecided."""
    state: CriterionState
    if found.value is None:
        state = "not measured" if found.reason else "not logged"
    elif not limits.is_set:
        state = "no limit"
    else:
        margin = NORMAL_95 * (found.sigma or 0.0)
        ends = [is_within(found.value + shift, limits) for shift in (-margin, 0.0, margin)]
        state = "undecided" if len(set(ends)) > 1 else "met" if ends[1] else "not met"
    return Criterion(
        name=name,
        state=state,
        unit=KINDS[name].unit,
        value=found.value,
        sigma=found.sigma,
        at_least=limits.at_least,
        at_most=limits.at_most,
        at=found.at,
        logged_by=found.logged_by,
        reason=found.reason or (NOT_LOGGED if found.value is None else ""),
    )


def score_of(
    checks: tuple[StabilisedAt, ...], criteria: tuple[Criterion, ...], settings: LandingSettings
) -> Score | None:
    """Return the share of the user's weights that was met; None where the user gave none."""
    gates: list[tuple[str, bool | None]] = [(gate.name, _is_met(gate)) for check in checks for gate in check.gates]
    gates += [(one.name, {"met": True, "not met": False}.get(one.state)) for one in criteria]
    weights = [(settings.criteria.of(name).weight, is_met) for name, is_met in gates]
    given = sum(weight for weight, _ in weights)
    known = [(weight, is_met) for weight, is_met in weights if is_met is not None]
    total = sum(weight for weight, _ in known)
    if total <= 0.0:
        return None
    return Score(sum(weight for weight, is_met in known if is_met) / total, total, given)


def _is_met(gate: Gate) -> bool | None:
    return None if gate.state == "not_measured" else gate.state == "passed"


def _off(
    path: FlightPath,
    runway: RunwayUsed,
    step_m: tuple[float, float],
    across: tuple[PositionError, ...],
    along: tuple[AlongError, ...],
    settings: LandingSettings,
) -> _Off:
    """Return the error of the positions on the runway and its sigma.

    Of an INS it is what localizer and glide path show, where they do.
    """
    course = math.radians(runway.true_course_deg)
    north, east = (step / math.sqrt(12.0) for step in step_m)
    place = [
        math.hypot(settings.threshold_sigma_m, sigma or 0.0) for sigma in (runway.along_sigma_m, runway.across_sigma_m)
    ]
    steps = (
        math.hypot(north * math.cos(course), east * math.sin(course)),
        math.hypot(north * math.sin(course), east * math.cos(course)),
    )
    is_ins = path.position_topic.startswith("ins")
    source = settings.ins_position_sigma_m if is_ins else settings.position_noise_m
    along_m, across_m, along_by, across_by = 0.0, 0.0, "", ""
    along_sigma, across_sigma = (math.hypot(source, one, step) for one, step in zip(place, steps, strict=True))
    if is_ins:
        for beside in across:
            if beside.topic == path.position_topic and beside.error_m is not None and beside.sigma_m is not None:
                across_m, across_sigma, across_by = beside.error_m, beside.sigma_m, "the localizer"
        for ahead in along:
            if ahead.topic == path.position_topic and ahead.error_m is not None and ahead.sigma_m is not None:
                along_m, along_sigma, along_by = ahead.error_m, ahead.sigma_m, "the glide path"
    return _Off(along_m, across_m, along_sigma, across_sigma, along_by, across_by)


def _thrust(seen: _Seen) -> _Value:
    """Lowest thrust from the higher check height down, as it lasted."""
    own = rows_below(seen.relative, seen.settings.gate_high_m, seen.settings.gate_floor_m)
    rows = slice(seen.relative.rows.start + own.start, seen.relative.rows.start + own.stop)
    worst = worst_sustained(seen.path.time_s[rows], -seen.logged.thrust_share[rows], seen.settings.sustained_s)
    if worst is None:
        return _Value()
    at = place_at(seen.path, seen.relative, own.start + worst.row)
    return _Value(-PERCENT * worst.value, None, at, seen.logged.sources.get("thrust", ""))


def _wind(seen: _Seen) -> dict[str, _Value]:
    """Mean wind from the lower check height to the end, from behind and across.

    Of a go-around above that height, over the last ``LEAST_WIND_S``.
    """
    own = rows_below(seen.relative, seen.settings.gate_low_m, -math.inf)
    last = min(seen.relative.rows.start + own.stop, seen.final.last)
    late = int(np.searchsorted(seen.path.time_s[:last], seen.path.time_s[last - 1] - LEAST_WIND_S))
    first = max(min(seen.relative.rows.start + own.start, late), seen.relative.rows.start)
    rows = slice(first, last)
    north, east = seen.logged.wind_north_mps[rows], seen.logged.wind_east_mps[rows]
    known = np.isfinite(north) & np.isfinite(east)
    if not known.any():
        return {"tailwind": _Value(), "crosswind": _Value()}
    course = math.radians(seen.runway.true_course_deg)
    behind = float(np.mean(north[known]) * math.cos(course) + np.mean(east[known]) * math.sin(course))
    aside = float(np.mean(east[known]) * math.cos(course) - np.mean(north[known]) * math.sin(course))
    by, sigma = seen.logged.sources.get("wind", ""), seen.settings.wind_sigma_mps
    what = "ground less air motion" if seen.logged.wind_is_derived else ""
    side = f"from the {'left' if aside > 0.0 else 'right'}"
    at = place_at(seen.path, seen.relative, first - seen.relative.rows.start)
    return {
        "tailwind": _Value(behind, sigma, at, by, what),
        "crosswind": _Value(abs(aside), sigma, at, by, "; ".join(filter(None, (what, side)))),
    }


def _crossing_s(seen: _Seen) -> float | None:
    """Time at which the threshold was crossed in flight; None where none is known."""
    if not seen.runway.is_surveyed:
        return None
    before = seen.relative.distance_m[seen.relative.is_final] + seen.off.along_m
    rows = np.flatnonzero((before[:-1] > 0.0) & (before[1:] <= 0.0))
    if not rows.size:
        return None
    row = int(rows[-1])
    time_s = seen.path.time_s[seen.relative.rows.start + row : seen.relative.rows.start + row + 2]
    return float(np.interp(0.0, [-before[row], -before[row + 1]], time_s))


def _threshold(seen: _Seen, touchdown: Touchdown) -> dict[str, _Value]:
    crossing_s = _crossing_s(seen)
    if crossing_s is None or crossing_s > touchdown.time_s:
        reason = "not crossed in flight" if seen.runway.is_surveyed else NO_THRESHOLD
        return dict.fromkeys(("threshold_height", "threshold_speed"), _Value(reason=reason))
    settings, speed = seen.settings, max(touchdown.ground_speed_mps or 1.0, 1.0)
    time_sigma_s = seen.off.along_sigma_m / speed
    height, by = seen.logged.radio.at(crossing_s), seen.logged.radio.logged_by
    if height is None:
        rows = slice(seen.relative.rows.start, seen.relative.rows.stop)
        height, by = _at(seen.path.time_s[rows], seen.relative.height_m, crossing_s), seen.path.altitude_source
    sink = _at(seen.path.time_s, seen.path.sink_rate_mps, crossing_s) or 0.0
    sigma = math.hypot(settings.height_sigma_m, sink * time_sigma_s)
    at, how = Place(crossing_s, height, 0.0), f"over the threshold by positions {seen.off.brief}"
    indicated = _at(seen.path.time_s, seen.logged.indicated_mps, crossing_s)
    by_air = seen.logged.sources.get("indicated", "")
    value, reason = indicated, "" if indicated is not None or not by_air else "no indicated airspeed at the threshold"
    if indicated is not None and settings.reference_speed_mps is not None:
        value, reason = indicated - settings.reference_speed_mps, "above the reference speed"
    return {
        "threshold_height": _Value(height, None if height is None else sigma, at, by, how if height else ""),
        "threshold_speed": _Value(value, None, at, by_air, reason),
    }


def _at(time_s: np.ndarray, values: np.ndarray, at_s: float) -> float | None:
    known = np.isfinite(values)
    return Series(time_s[known], values[known]).at(at_s)


def _flare(seen: _Seen, touchdown: Touchdown) -> dict[str, _Value]:
    """Time from 50 ft and distance from 20 ft to the touchdown."""
    rows = slice(seen.relative.rows.start, seen.relative.rows.stop)
    height = seen.logged.radio
    if not len(height.between(touchdown.time_s - 60.0, touchdown.time_s)):
        known = np.isfinite(seen.relative.height_m)
        by = seen.path.altitude_source
        height = Series(seen.path.time_s[rows][known], seen.relative.height_m[known], by)
    at_50, at_20 = (_passed_s(height, level, touchdown.time_s) for level in (FLARE_M, FLOAT_M))
    flare, floating = _Value(reason="no height near the ground"), _Value(reason="no height near the ground")
    if at_50 is not None:
        sigma = math.hypot(at_50[1], touchdown.time_sigma_s)
        flare = _Value(touchdown.time_s - at_50[0], sigma, Place(at_50[0], FLARE_M), height.logged_by)
    if at_20 is not None and touchdown.ground_speed_mps:
        speed, time_s = seen.path.ground_speed_mps, seen.path.time_s
        during = (time_s >= at_20[0]) & (time_s <= touchdown.time_s) & np.isfinite(speed)
        mean = float(np.mean(speed[during])) if during.any() else touchdown.ground_speed_mps
        sigma = mean * math.hypot(at_20[1], touchdown.time_sigma_s)
        span = touchdown.time_s - at_20[0]
        floating = _Value(mean * span, sigma, Place(at_20[0], FLOAT_M), height.logged_by, f"{span:.1f} s")
    return {"flare": flare, "floating": floating}


def _passed_s(height: Series, level_m: float, before_s: float) -> tuple[float, float] | None:
    """Return the last time a height was passed downwards, and its sigma; None in a gap."""
    near = height.between(before_s - 60.0, before_s)
    above = np.flatnonzero(near.values > level_m)
    if not above.size or above[-1] + 1 >= len(near):
        return None
    row = int(above[-1])
    times, values = near.time_s[row : row + 2], near.values[row : row + 2]
    step_s = float(times[1] - times[0])
    if step_s > 5.0:
        return None
    return float(np.interp(-level_m, -values, times)), step_s / math.sqrt(12.0)


def _place(seen: _Seen, touchdown: Touchdown) -> dict[str, _Value]:
    """Touchdown against threshold, aiming point, far end and centre line."""
    names = ("touchdown", "aiming_point", "runway_remaining", "centre_line")
    runway, off = seen.runway, seen.off
    if touchdown.past_threshold_m is None or not runway.is_surveyed:
        return dict.fromkeys(names, _Value(reason=NO_THRESHOLD))
    past = touchdown.past_threshold_m - off.along_m
    time_m = touchdown.time_sigma_s * (touchdown.ground_speed_mps or 0.0)
    sigma, at, by = math.hypot(time_m, off.along_sigma_m), Place(touchdown.time_s, 0.0, -past), seen.path.position_topic
    told = off.along_told(in_feet_too(touchdown.past_threshold_m))
    found = {"touchdown": _Value(past, sigma, at, by, told)}
    length_m = runway.landing_length_m if runway.landing_length_m is not None else runway.length_m
    if length_m is None:
        no_length = _Value(reason="the length of the runway is not known")
        found |= {"aiming_point": no_length, "runway_remaining": no_length}
    else:
        aiming_m = next(point for up_to, point in AIMING_POINTS if length_m < up_to)
        told = f"aiming point {in_feet_too(aiming_m)} behind the threshold; {off.brief}"
        found["aiming_point"] = _Value(past - aiming_m, sigma, at, by, told)
        found["runway_remaining"] = _Value(length_m - past, sigma, at, by, f"of {in_feet_too(length_m)}; {off.brief}")
    rows = slice(seen.relative.rows.start, seen.relative.rows.stop)
    recorded = _at(seen.path.time_s[rows], seen.relative.across_m, touchdown.time_s)
    if recorded is None:
        return found | {"centre_line": _Value(None, None, at, by)}
    aside = recorded - off.across_m
    told = f"{_side(aside)}; {off.across_told(f'{in_feet_too(abs(recorded))} {_side(recorded)}')}"
    course_m = math.radians(runway.course_sigma_deg) * abs(past)
    return found | {"centre_line": _Value(abs(aside), math.hypot(off.across_sigma_m, course_m), at, by, told)}


def _side(across_m: float) -> str:
    return "right" if across_m > 0.0 else "left"


def _manner(seen: _Seen, touchdown: Touchdown) -> dict[str, _Value]:
    """Flap, pitch, bank, sink rate and load as the wheels meet the ground."""
    logged, at_s = seen.logged, touchdown.time_s
    past = touchdown.past_threshold_m
    at = Place(at_s, 0.0, None if past is None else seen.off.along_m - past)
    flap = logged.flap_deg[int(np.argmin(np.abs(seen.path.time_s - at_s)))]
    flap_value = float(flap) if np.isfinite(flap) and "flap" not in logged.tells else None
    flap_reason = logged.tells.get("flap", "") if np.isfinite(flap) else ""
    pitch = logged.pitch.at(at_s)
    low = _passed_s(logged.radio, FLOAT_M, at_s)
    roll = logged.roll.between(at_s - 4.0 if low is None else low[0], at_s)
    bank = float(np.max(np.abs(roll.values))) if len(roll) else None
    told = "" if low is not None or bank is None else "over the last 4 s: no radio altitude"
    return {
        "landing_flap": _Value(flap_value, None, at, logged.sources.get("flap", ""), flap_reason),
        "landing_pitch": _Value(pitch, None, at, logged.pitch.logged_by),
        "landing_bank": _Value(bank, None, at, logged.roll.logged_by, told),
        "landing_sink": _Value(touchdown.sink_rate_mps, touchdown.sink_rate_sigma_mps, at, touchdown.sink_rate_by),
        "landing_load": _Value(touchdown.peak_load_g, None, at),
    }
