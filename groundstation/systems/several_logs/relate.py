"""Relation of the clocks of two logs of the same flight, by GNSS time and by motion."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.timescales import duration_text, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.systems.joining import NoCommonClockError, NotOneFlightError
from groundstation.systems.several_logs.channels import SignalPair, TopicSignals, pair_of
from groundstation.systems.several_logs.coarse import CoarseLag, grids_of, place_of, steps_of
from groundstation.systems.several_logs.fine import MotionFit, fit_motion
from groundstation.systems.several_logs.relation import LogRelation, RelationStretch, TimedLog
from groundstation.systems.several_logs.settings import TwoClocksSettings
from groundstation.tables.resample import join
from groundstation.tables.table import Flight, Table

LEAPS_S = range(13, 21)  # GPS time less UTC
NEAR_WHOLE_S = 0.35
LEAST_DRIFT_SIGMA = 1e-9
FILES_APART_S = 1.0
_SAYS = {
    "gnss_time": "GNSS time of both",
    "motion": "the motion that both show",
    "gnss_time_and_motion": "GNSS time of both and the motion that both show",
    "file_time": "the times of the files as they are, without an interval",
}
POSITION = ("latitude_deg", "longitude_deg")
LARGEST_GAP_S = 10.0


def relate(first: TimedLog, other: TimedLog, *, settings: TwoClocksSettings | None = None) -> LogRelation:
    """Put the clock of one log on that of another of the same flight.

    Parameters
    ----------
    first, other : TimedLog
    settings : TwoClocksSettings, optional

    Returns
    -------
    LogRelation

    Raises
    ------
    NotOneFlightError
        When the logs do not overlap, do not show one motion, are far from each other, or nothing places them.

    Notes
    -----
    GNSS time, where both logs tell it, gives offset and drift; a recorder stamps the message when it arrives, which
    leaves ``arrival_sigma_s``. The motion that both show gives them too: a search over all lags for where the two fit,
    then least squares (see :func:`fit_motion`). Where both tell, the two are weighed by their variances; where they
    contradict each other the motion is believed. Where neither does, the times of the files are left as they are, if
    both are in UTC.
    """
    settings = settings or TwoClocksSettings()
    by_gnss = _by_gnss_time(first, other, settings)
    files_lag_s = (other.flight.start_ns - first.flight.start_ns) / NS_PER_S if _both_utc(first, other) else None
    if by_gnss:
        _require_overlap(first, other, by_gnss)
    is_late = _stamps_late(first), _stamps_late(other)
    pair = pair_of(first.flight, other.flight, settings.interval_max_s, is_late=is_late)
    place, why = _placed(pair, by_gnss, files_lag_s, settings)
    base = LogRelation(first.flight.start_ns, other.flight.start_ns, ())
    if pair is not None:
        base = replace(base, first_topic=pair.first.topic, other_topic=pair.other.topic, signals=pair.names)
    found = None
    if place is not None and pair is not None:
        moving = replace(base, correlation=place.correlation)
        found, why = _by_motion(moving, pair, place, by_gnss, (first, other), settings)
    if found is None:
        prior = by_gnss or _by_file_time(files_lag_s)
        if not prior:
            names = f"{first.name} and {other.name}"
            text = "cannot be put on one clock: no GNSS time in both"
            raise NoCommonClockError(names, f"{text}; {_without_utc(first, other)}; {why}")
        found = replace(base, stretches=prior, reason=f"{_SAYS[prior[0].method]}; {why}")
        if pair is not None:
            _require_no_contradiction(first, other, pair, found, settings)
    elif files_lag_s is not None and not by_gnss and abs(files_lag_s - found.stretches[0].lag_s) > FILES_APART_S:
        gap_s = files_lag_s - found.stretches[0].lag_s
        text = f"their own times differ by {gap_s:+.1f} s from the motion: the motion is used"
        found = replace(found, remarks=(*found.remarks, text))
    _require_overlap(first, other, found.stretches)
    _require_near(first, other, found, settings)
    return found


def _without_utc(*logs: TimedLog) -> str:
    """Return which logs have no UTC, by which the times of their files would serve."""
    return f"no UTC in {' and '.join(log.name for log in logs if not log.flight.has_utc)}"


def _both_utc(first: TimedLog, other: TimedLog) -> bool:
    return first.flight.has_utc and other.flight.has_utc


def _by_file_time(lag_s: float | None) -> tuple[RelationStretch, ...]:
    if lag_s is None:
        return ()
    return (RelationStretch(-np.inf, 0.0, lag_s, np.inf, 0.0, 0.0, "file_time"),)


def _by_gnss_time(first: TimedLog, other: TimedLog, settings: TwoClocksSettings) -> tuple[RelationStretch, ...]:
    """Relate the logs by the GNSS time of both; empty where one does not have it.

    There is a stretch for each pair of theirs.
    """
    if first.gnss_time is None or other.gnss_time is None:
        return ()
    arrival_s = (
        settings.arrival_sigma_s * float(sum(not told.is_own for told in (first.gnss_time, other.gnss_time))) ** 0.5
    )
    start_ns, end_ns = other.flight.start_ns, other.end_ns
    inside = [one.begin_ns for one in (*other.gnss_time.stretches[1:], *first.gnss_time.stretches[1:])]
    begins_ns = sorted({start_ns, *(begin for begin in inside if start_ns < begin < end_ns)})
    stretches = []
    for begin_ns, until_ns in zip(begins_ns, [*begins_ns[1:], end_ns], strict=True):
        middle_ns = (begin_ns + until_ns) // 2
        b, a = other.gnss_time.at(middle_ns), first.gnss_time.at(middle_ns)
        offset_s = b.offset_at(middle_ns) - a.offset_at(middle_ns)
        lag_s = offset_s + (other.flight.start_ns - first.flight.start_ns) / NS_PER_S
        sigma_s = float(np.linalg.norm([a.sigma_at(middle_ns), b.sigma_at(middle_ns), arrival_s]))
        drift_sigma = max(float(np.hypot(a.drift_sigma, b.drift_sigma)), LEAST_DRIFT_SIGMA)
        begin_s = -np.inf if begin_ns == start_ns else (begin_ns - start_ns) / NS_PER_S
        middle_s = (middle_ns - start_ns) / NS_PER_S
        stretches.append(
            RelationStretch(begin_s, middle_s, lag_s, sigma_s, b.drift - a.drift, drift_sigma, "gnss_time")
        )
    return tuple(stretches)


def _placed(
    pair: SignalPair | None,
    by_gnss: tuple[RelationStretch, ...],
    files_lag_s: float | None,
    settings: TwoClocksSettings,
) -> tuple[CoarseLag | None, str]:
    """Return the lag at which the motions fit; or None, and why the motion does not tell it.

    If several lags fit alike, the one nearest to the times of the files is taken, where both are in UTC.
    """
    if pair is None:
        return None, "no motion that both show"
    still = [side.topic for side in (pair.first, pair.other) if not _moves(pair.names, side, settings)]
    if still:
        return None, f"too little motion in {' and '.join(still)}"
    near_s = None
    if by_gnss:
        lags = [one.lag_s for one in by_gnss]
        near_s = min(lags) - settings.near_gnss_time_s, max(lags) + settings.near_gnss_time_s
    grids = grids_of(pair, settings)
    place = place_of(grids, settings, near_s)
    if place is not None and near_s is None and files_lag_s is not None and place.rival > settings.rival_share_max:
        reach_s = settings.near_gnss_time_s
        place = place_of(grids, settings, (files_lag_s - reach_s, files_lag_s + reach_s))
    if place is None:
        return None, "too little of the motion in common"
    if place.correlation < settings.correlation_min:
        return None, f"the motions do not fit anywhere (correlation {place.correlation:.2f} at best)"
    if not by_gnss and place.rival > settings.rival_share_max:
        return None, f"the motion fits at more than one place (the next best reaches {place.rival:.0%})"
    return place, ""


def _moves(names: tuple[str, ...], side: TopicSignals, settings: TwoClocksSettings) -> bool:
    for name, column in zip(names, side.values.T, strict=True):
        low, high = np.quantile(column, (0.01, 0.99))
        if name in ("north", "east", "speed") and high - low > settings.moving_mps:
            return True
        if name == "heading" and high - low > settings.turning_deg:
            return True
        if name == "turn" and side.interval_s * float(np.ptp(np.cumsum(column))) > settings.turning_deg:
            return True
    return False


def _by_motion(
    found: LogRelation,
    pair: SignalPair,
    place: CoarseLag,
    by_gnss: tuple[RelationStretch, ...],
    logs: tuple[TimedLog, TimedLog],
    settings: TwoClocksSettings,
) -> tuple[LogRelation | None, str]:
    """Fit the motion in each stretch, and weigh it with GNSS time where that is known.

    None, and why, where no stretch can be fitted and GNSS time does not tell.
    """
    first, other = logs
    hidden_s = _hidden_s((first, pair.first), (other, pair.other), settings=settings)
    begins = [(one.begin_s, one.lag_s) for one in by_gnss]
    if len(begins) < 2:
        begins = steps_of(grids_of(pair, settings), place, settings)
    ends = [*(begin for begin, _lag in begins[1:]), other.flight.duration_s]
    stretches, remarks, gaps, fitted = [], list(found.remarks), [], 0
    for number, ((begin_s, lag_s), end_s) in enumerate(zip(begins, ends, strict=True)):
        prior = by_gnss[min(number, len(by_gnss) - 1)] if by_gnss else None
        span_s = (max(begin_s, 0.0), end_s)
        fit = fit_motion(pair, lag_s, span_s, hidden_s, settings)
        if isinstance(fit, str):
            stretches.append(_unfitted(prior, begin_s, span_s, lag_s, settings))
            remarks.append(
                f"from {span_s[0]:.0f} to {span_s[1]:.0f} s of {other.name} the motion gives no result: {fit}"
            )
            continue
        fitted += 1
        stretch, gap = _settled(begin_s, fit, prior, settings)
        stretches.append(stretch)
        if gap is not None:
            gaps.append(gap)
            if stretch.method == "motion":
                text = f"GNSS time and motion contradict each other by {gap[0]:+.3f} s{_named(gap[0])}"
                remarks.append(f"{text}: the motion is used")
    if not by_gnss and not fitted:
        return None, remarks[-1]
    if len(begins) > 1:
        steps = ", ".join(f"{begin:.0f} s" for begin, _lag in begins[1:])
        remarks.append(f"one of the clocks was set at {steps} of {other.name}")
    found = replace(found, stretches=tuple(stretches), remarks=tuple(remarks))
    if gaps:
        found = replace(found, gnss_less_motion_s=gaps[0][0], gnss_less_motion_sigma_s=gaps[0][1])
    what = f"{', '.join(pair.names)} of {pair.first.topic} and {pair.other.topic}"
    return replace(found, reason=f"{_SAYS[found.method]} ({what})"), ""


def _settled(
    begin_s: float, fit: MotionFit, prior: RelationStretch | None, settings: TwoClocksSettings
) -> tuple[RelationStretch, tuple[float, float] | None]:
    """Return a stretch by the motion, weighed with GNSS time where the two agree.

    Also returns GNSS time less motion with its sigma.
    """
    moving = RelationStretch(begin_s, fit.middle_s, fit.lag_s, fit.lag_sigma_s, fit.drift, fit.drift_sigma, "motion")
    if prior is None:
        return moving, None
    gap_s = float(prior.lag_at(fit.middle_s)) - fit.lag_s
    sigma_s = float(np.hypot(prior.sigma_at(fit.middle_s), fit.lag_sigma_s))
    is_wrong = abs(gap_s) > settings.contradiction_sigmas * sigma_s
    return moving if is_wrong else _weighed(moving, prior), (gap_s, sigma_s)


def _stamps_late(log: TimedLog) -> bool:
    """Tell whether a log's GNSS messages may be stamped late, by the clock of its recorder.

    That is so where the recorder also records an INS. A log of GNSS alone has no other clock than its own stamps.
    """
    is_own = log.gnss_time is not None and log.gnss_time.is_own
    return not is_own and any(topic.startswith("ins") for topic in log.flight.topics())


def _hidden_s(*sides: tuple[TimedLog, TopicSignals], settings: TwoClocksSettings) -> float:
    """Return one sigma of the lag that the motion does not show.

    It comes from INS filters that GNSS corrects, and from GNSS messages that came late.
    """
    hidden = [settings.aided_sigma_s for log, side in sides if _is_aided(log, side)]
    hidden += [settings.arrival_sigma_s for log, side in sides if side.topic.startswith("gnss") and _stamps_late(log)]
    return float(np.linalg.norm(hidden)) if hidden else 0.0


def _is_aided(log: TimedLog, side: TopicSignals) -> bool:
    if log.flight.metadata.get("ins_kind", "").lower() == "gnss_aided" and side.topic.startswith("ins"):
        return True
    modes = log.flight[side.topic].text("mode")
    return bool(np.mean(modes == "gnss_aided") > 0.5) if len(modes) else False


def _unfitted(
    prior: RelationStretch | None,
    begin_s: float,
    span_s: tuple[float, float],
    lag_s: float,
    settings: TwoClocksSettings,
) -> RelationStretch:
    """Return a stretch that only the coarse search placed; by GNSS time where that is known."""
    if prior is not None:
        return replace(prior, begin_s=begin_s)
    sigma = 1e-6 * settings.drift_sigma_ppm
    return RelationStretch(begin_s, 0.5 * sum(span_s), lag_s, settings.search_s, 0.0, sigma, "motion")


def _weighed(motion: RelationStretch, prior: RelationStretch) -> RelationStretch:
    """Return the mean of both stretches, weighted by their variances.

    It is taken at the middle of the motion, where its offset and drift are uncorrelated.
    """
    lag_s, lag_sigma_s = _mean(
        motion.lag_s, motion.lag_sigma_s, float(prior.lag_at(motion.middle_s)), float(prior.sigma_at(motion.middle_s))
    )
    drift, drift_sigma = _mean(motion.drift, motion.drift_sigma, prior.drift, prior.drift_sigma)
    return RelationStretch(
        motion.begin_s, motion.middle_s, lag_s, lag_sigma_s, drift, drift_sigma, "gnss_time_and_motion"
    )


def _mean(a: float, a_sigma: float, b: float, b_sigma: float) -> tuple[float, float]:
    weight_a, weight_b = a_sigma**-2, b_sigma**-2
    return (a * weight_a + b * weight_b) / (weight_a + weight_b), (weight_a + weight_b) ** -0.5


def _named(gap_s: float) -> str:
    whole = round(abs(gap_s))
    is_leap = whole in LEAPS_S and abs(abs(gap_s) - whole) < NEAR_WHOLE_S
    return ", equal to the leap seconds between GPS time and UTC" if is_leap else ""


def _require_overlap(first: TimedLog, other: TimedLog, stretches: tuple[RelationStretch, ...]) -> None:
    begin_s = float(stretches[0].lag_at(0.0))
    end_s = other.flight.duration_s + float(stretches[-1].lag_at(other.flight.duration_s))
    if begin_s < first.flight.duration_s and end_s > 0.0:
        return
    apart_s = begin_s - first.flight.duration_s if begin_s > 0.0 else -end_s
    spans = " and ".join(_span(log) for log in (first, other))
    raise NotOneFlightError(
        f"{first.name} and {other.name}", f"no time in common: {duration_text(apart_s)} apart ({spans})"
    )


def _span(log: TimedLog) -> str:
    if not log.flight.has_utc:
        return f"{log.flight.duration_s:.0f} s without UTC"
    return f"{utc_ns_to_iso(log.flight.start_ns, 0)} to {utc_ns_to_iso(log.end_ns, 0)}"


def _require_no_contradiction(
    first: TimedLog, other: TimedLog, pair: SignalPair, found: LogRelation, settings: TwoClocksSettings
) -> None:
    """Refuse logs whose clocks agree and whose motions do not."""
    moves = [_moves(pair.names, side, settings) for side in (pair.first, pair.other)]
    lag_s = found.stretches[0].lag_s
    near_s = lag_s - settings.search_s, lag_s + settings.search_s
    place = place_of(grids_of(pair, settings), settings, near_s) if all(moves) else None
    if place is not None and place.correlation < settings.correlation_other:
        raise NotOneFlightError(
            f"{first.name} and {other.name}",
            f"not of one flight: {', '.join(pair.names)} of {pair.first.topic} and {pair.other.topic} have a "
            f"correlation of {place.correlation:.2f} in the {place.overlap_s:.0f} s in common",
        )


def _require_near(first: TimedLog, other: TimedLog, found: LogRelation, settings: TwoClocksSettings) -> None:
    """Refuse logs that were recorded far from each other at one time."""
    apart = apart_m(first.flight, other.flight, found.first_time_ns)
    if apart is None:
        return
    limit_m = settings.apart_inertial_max_m if apart.is_inertial else settings.apart_max_m
    if apart.distance_m > limit_m:
        raise NotOneFlightError(
            f"{first.name} and {other.name}",
            f"not of one flight: {apart.distance_m / 1e3:.1f} km apart at one time, limit {limit_m / 1e3:g} km",
        )


@dataclass(frozen=True)
class Separation:
    """Median distance over the ground; ``is_inertial``: one position is that of an INS.

    An INS may drift.
    """

    distance_m: float
    is_inertial: bool


def apart_m(first: Flight, other: Flight, first_time_ns: Callable[[Int64Array], Int64Array]) -> Separation | None:
    """Return the distance between the positions of two logs at one time.

    None where one has no position or they never overlap.
    """
    a, b = _positions(first), _positions(other)
    if a is None or b is None:
        return None
    moved = join(a, first_time_ns(b.time_ns), POSITION, largest_gap_s=LARGEST_GAP_S)
    latitude, longitude = (moved.values(name) for name in POSITION)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    if not known.any():
        return None
    distance = []
    for row in np.flatnonzero(known)[:: max(int(known.sum()) // 200, 1)]:
        north, east = north_east_m(
            b.values("latitude_deg")[row], b.values("longitude_deg")[row], float(latitude[row]), float(longitude[row])
        )
        distance.append(float(np.hypot(north, east)))
    return Separation(float(np.median(distance)), any(one.topic.startswith("ins") for one in (a, b)))


def _positions(flight: Flight) -> Table | None:
    topics = [*topics_of_kind("gnss", flight.topics()), *topics_of_kind("ins", flight.topics())]
    found = next((flight[topic] for topic in topics if flight[topic].has(*POSITION)), None)
    if found is None:
        return None
    known = found.unique_times()
    known = known.take(known.valid(*POSITION))
    return known if len(known) > 1 else None
