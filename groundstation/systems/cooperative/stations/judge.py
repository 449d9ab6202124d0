"""Judgement on the ground stations, and a session that does not rely on those in doubt.

Round by round the stations not yet in doubt are tested. Where a test refuses, every station that explains the residuals
about as well as the best is in doubt: two stations that contradict each other do not say which of them is wrong. A
station in doubt stays with a sigma of its place that holds the error found, and so surveys itself; one whose ranges are
too long by a delay that no shift explains is left out. The rounds end when nothing is refused any more.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.datums import BY_NAME, DATUMS
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.quantiles import NORMAL_95
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.smoothed import SmoothedPoint, SmoothedProblem
from groundstation.systems.cooperative.stations.belief import belief_factors, raised_sigmas, with_factors
from groundstation.systems.cooperative.stations.hypotheses import (
    CANNOT_TELL,
    DELAY,
    SHIFT,
    UNSEEN,
    StationTest,
    alarms,
    noncentrality,
    open_hypotheses,
    station_tests,
)
from groundstation.systems.cooperative.stations.information import EACH, StationInformation, station_information
from groundstation.tables.session import GroundPoint, Session

BELIEF_ROUNDS, DELAY_ROUNDS = 2, 2
Solved = tuple[StationInformation, SmoothedProblem, Prepared]
FREE = 5.0  # sigmas of a free place, in sizes of the error found
DATUM_TOLD = 12.0  # twice the log of the likelihood ratio of a datum from which it is told
DATUM_DECIDABLE = 20.0  # noncentrality: the datum's errors would be told in 95 % of sessions


@dataclass(frozen=True)
class Doubt:
    """Station in doubt, with its hypotheses; ``left_out`` where no shift explains its ranges.

    Parameters
    ----------
    station : int
    tests : tuple of StationTest
        The best first; of a station left out its delay alone, about ranges less the delay.
    left_out : bool
    round : int
    place : StationTest, optional
        The shift, from a session in which this station alone is free: a test is linear about an answer that leans on
        the wrong place.
    """

    station: int
    tests: tuple[StationTest, ...]
    left_out: bool
    round: int
    place: StationTest | None = None


@dataclass(frozen=True)
class DatumTest:
    """One datum as the hypothesis on all stations.

    Parameters
    ----------
    name : str
    largest_m : float
        Largest error that a station would have.
    statistic : float
        Twice the log of the likelihood ratio against stations that are right.
    is_decidable : bool
        The session would tell it.
    is_told : bool
    """

    name: str
    largest_m: float
    statistic: float
    is_decidable: bool
    is_told: bool


@dataclass(frozen=True)
class StationJudgement:
    """Judgement on the stations of a session.

    Parameters
    ----------
    asked : StationInformation
        With the stations as the file has them.
    tests : tuple of StationTest
        Of the last round in which each station was asked.
    doubts : tuple of Doubt
        In the order of the rounds.
    datums : tuple of DatumTest
    session : Session
        The one to answer from.
    used : StationInformation
        Of that session.
    surveyed : tuple of SmoothedPoint
        Stations with a sigma of their place, as that session has them.
    raised : dict
        Sigmas of INS and clocks (fields of InsBelief) that were raised for the tests, with the factor.
    """

    asked: StationInformation
    tests: tuple[StationTest, ...]
    doubts: tuple[Doubt, ...]
    datums: tuple[DatumTest, ...]
    session: Session
    used: StationInformation
    surveyed: tuple[SmoothedPoint, ...]
    raised: dict[str, float]

    def named(self) -> tuple[int, ...]:
        """Return the stations that are the only ones of their round in doubt."""
        rounds = [doubt.round for doubt in self.doubts]
        return tuple(doubt.station for doubt in self.doubts if rounds.count(doubt.round) == 1)

    def detectable_m(self, station: int) -> tuple[float, float]:
        """Return the smallest shift found with 95 %, best and worst direction; inf: none is."""
        part = slice(EACH * station, EACH * station + 2)
        information = np.linalg.eigvalsh(self.asked.matrix[part, part])
        need = noncentrality(2 * len(self.asked.names))
        best, worst = (
            float(np.sqrt(need / value)) if value > UNSEEN else float("inf") for value in information[::-1].tolist()
        )
        return best, worst

    def metres_per_metre(self, station: int) -> tuple[float, int]:
        """Return by how much a metre of the station moves the answer at worst, and whose."""
        moved = self.asked.answer[..., EACH * station : EACH * station + 2]
        each = np.linalg.svd(moved, compute_uv=False)[..., 0].max(axis=0)
        return float(each.max()), int(each.argmax())

    def protection_m(self, vehicle: int) -> tuple[float, float]:
        """Return the bound of a vehicle's error with a station off unseen: at worst, at the end.

        It is the largest effect of a shift that the test finds with 95 % and no more, and 1.96 sigma of the answer in
        its worst direction beside it.
        """
        need = noncentrality(2 * len(self.used.names))
        bias = np.zeros(len(self.used.answer))
        for station in range(len(self.used.names)):
            part = slice(EACH * station, EACH * station + 2)
            C = self.used.matrix[part, part]
            value, axes = np.linalg.eigh(C)
            root = axes / np.sqrt(np.maximum(value, UNSEEN))
            moved = self.used.answer[:, vehicle, :, part] @ root
            bias = np.maximum(bias, np.sqrt(need) * np.linalg.svd(moved, compute_uv=False)[..., 0])
        sigma = np.sqrt(np.linalg.eigvalsh(self.used.covariance_m2[:, vehicle])[:, -1])
        level = bias + NORMAL_95 * sigma
        return float(level.max()), float(level[-1])


def judge_stations(session: Session, settings: CooperativeSettings) -> StationJudgement:
    """Judge the stations of a session that has ranges to any."""
    raised, (information, solved, _) = _believable(session, settings)
    now, doubts = session, list[Doubt]()
    found = station_tests(information, range(len(session.points)))
    first, tests, datums = information, found, datum_tests(session, information, found)
    told = max((one for one in datums if one.is_told), key=lambda one: one.statistic, default=None)
    if told is not None:
        now = _in_datum(session, told.name)
        information, solved, _ = station_information(now, raised)
        found = tests = station_tests(information, range(len(session.points)))
    for number in range(len(session.points)):  # each puts one or more in doubt
        if not alarms(found):
            break
        fresh = [_placed(doubt, now, raised) for doubt in _doubts(found, number)]
        doubts += fresh
        now = _without(now, fresh)
        information, solved, _ = station_information(now, raised)
        in_doubt = {one.station for one in doubts}
        found = station_tests(information, [one for one in range(len(now.points)) if one not in in_doubt])
        tests = (*(test for test in tests if test.station in in_doubt), *found)
    stated = {point for point, one in enumerate(now.points) if one.position_sigma_m > 0.0}
    surveyed = tuple(point for point in solved.smoothed.points if point.point in stated)
    factors = raised_sigmas(settings.ins, raised.ins)
    return StationJudgement(first, tests, tuple(doubts), datums, now, information, surveyed, factors)


def _believable(session: Session, settings: CooperativeSettings) -> tuple[CooperativeSettings, Solved]:
    """Return settings with sigmas of INS and clocks as large as the session shows them."""
    solved = station_information(session, settings)
    for _ in range(BELIEF_ROUNDS):
        information, smoothed, prepared = solved
        raised = with_factors(settings, belief_factors(prepared, smoothed, information))
        if raised == settings:
            break
        settings, solved = raised, station_information(session, raised)
    return settings, solved


def _doubts(found: Sequence[StationTest], number: int) -> list[Doubt]:
    still_open = open_hypotheses(found)
    doubts = []
    for station in dict.fromkeys(test.station for test in still_open):
        mine = tuple(test for test in still_open if test.station == station)
        doubts.append(Doubt(station, mine, all(test.kind != SHIFT for test in mine), number))
    return doubts


def _placed(doubt: Doubt, session: Session, settings: CooperativeSettings) -> Doubt:
    """Return the doubt with the place of the station when it alone is free."""
    if doubt.left_out:
        return replace(doubt, tests=(_delayed(doubt, session, settings),))
    shift = next(test for test in doubt.tests if test.kind == SHIFT)
    points = list(session.points)
    points[doubt.station] = _freed(points[doubt.station], FREE * shift.largest_m)
    information, solved, _ = station_information(replace(session, points=tuple(points)), settings)
    (point,) = (one for one in solved.smoothed.points if one.point == doubt.station)
    covariance = information.repetition * point.covariance_m2
    return replace(doubt, place=replace(shift, error_m=point.error_m, covariance_m2=covariance))


def _delayed(doubt: Doubt, session: Session, settings: CooperativeSettings) -> StationTest:
    """Return the delay of a station from ranges that it is taken off.

    A test is linear about an answer that leans on the late ranges, and robust weights have them count for less.
    """
    delay = next(test for test in doubt.tests if test.kind == DELAY)
    ranges = session.ranges
    late = ranges.source == session.points[doubt.station].name
    for _ in range(DELAY_ROUNDS):
        on_time = replace(ranges, pseudorange_m=ranges.pseudorange_m - late * float(delay.error_m[0]))
        information, _, _ = station_information(replace(session, ranges=on_time), settings)
        left = [test for test in station_tests(information, [doubt.station]) if test.kind == DELAY]
        for test in left:
            delay = replace(delay, error_m=delay.error_m + test.error_m, covariance_m2=test.covariance_m2)
    return delay


def _freed(point: GroundPoint, sigma_m: float) -> GroundPoint:
    return replace(point, position_sigma_m=float(np.hypot(point.position_sigma_m, sigma_m)))


def _without(session: Session, doubts: Sequence[Doubt]) -> Session:
    """Return the session with stations in doubt free to move, or left out."""
    points, ranges = list(session.points), session.ranges
    for doubt in doubts:
        point = points[doubt.station]
        if doubt.left_out:
            ranges = ranges.take(ranges.source != point.name)
            continue
        points[doubt.station] = _freed(point, doubt.place.largest_m if doubt.place else 0.0)
    return replace(session, points=tuple(points), ranges=ranges)


def datum_tests(
    session: Session, information: StationInformation, tests: Sequence[StationTest]
) -> tuple[DatumTest, ...]:
    """Test datums in use where the stations are; none where their places are not known."""
    places = [_place_deg(session, point) for point in session.points]
    if not places or any(place is None for place in places):
        return ()
    best_single = max((test.statistic for test in tests), default=0.0)
    rows = []
    for datum in DATUMS:
        if not all(place is not None and datum.is_used_at(*place) for place in places):
            continue
        errors = np.array([datum.error_m(*place) for place in places if place is not None])
        numbers = np.zeros(EACH * len(errors))
        numbers[0::EACH], numbers[1::EACH] = errors[:, 0], errors[:, 1]
        power = float(numbers @ information.matrix @ numbers)
        gain = 2.0 * float(numbers @ information.score) - power
        rows.append((datum.name, float(np.linalg.norm(errors, axis=1).max()), gain, power))
    best = max((gain for _, _, gain, _ in rows), default=0.0)
    return tuple(
        DatumTest(
            name,
            largest,
            gain,
            power >= DATUM_DECIDABLE,
            gain > DATUM_TOLD and gain > best - CANNOT_TELL and gain > best_single - CANNOT_TELL,
        )
        for name, largest, gain, power in rows
    )


def _in_datum(session: Session, name: str) -> Session:
    """Return the session with stations whose places were in a datum, taken for WGS-84."""
    points = []
    for point in session.points:
        place = _place_deg(session, point)
        assert place is not None  # else no datum was asked
        axes = np.eye(3)[:, :2] if session.frame == "local" else ecef_from_n(*place)[:, :2]
        x, y, z = (np.array(point.position_m) - axes @ BY_NAME[name].error_m(*place)).tolist()
        points.append(replace(point, position_m=(x, y, z)))
    return replace(session, points=tuple(points))


def _place_deg(session: Session, point: GroundPoint) -> tuple[float, float] | None:
    if session.frame == "ecef":
        latitude, longitude, _ = geodetic_deg_m(np.array(point.position_m))
        return float(latitude), float(longitude)
    return point.place_deg


def survey_of(judgement: StationJudgement, station: int) -> tuple[FloatArray, FloatArray] | None:
    """Return the place that a station surveyed, less that of the file, and its sigmas."""
    for one in judgement.surveyed:
        if one.point == station:
            return -one.error_m, np.sqrt(np.diag(one.covariance_m2))
    return None
