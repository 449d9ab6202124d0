"""Information of a session about errors of its ground stations, and what they do to it.

A station that stands elsewhere than believed, or whose ranges are too long by a delay, adds known columns times unknown
numbers to the residuals of the smoother's problem. All else stays unknown in it: with the states eliminated the numbers
have an information matrix and a score, and a unit of each moves the answer by what the same elimination gives. The
likelihood ratio of any set of such errors follows from these (see ``hypotheses``).

Source: Friedland, Treatment of bias in recursive filtering, 1969; Willsky and Jones, A generalized likelihood ratio
approach to the detection and estimation of jumps in linear systems, 1976; Baarda, A testing procedure for use in
geodetic networks, 1968.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import Int64Array, frozen
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.loop_types import POINT
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.smoothed import SmoothedProblem, smooth_problem
from groundstation.systems.cooperative.smoother.weights import cauchy, honest_factor
from groundstation.systems.cooperative.stations.response import Response, respond
from groundstation.tables.session import Session

EACH = 3  # numbers of a station: shift north, shift east (believed less true place), delay of its ranges, all in metres
LEAST_RANGES = 50  # of the stations, from which on their residuals tell of correlation
NOISE_OF_PAIRS = 2.0  # sigmas of the sum of two autocorrelations of independent residuals, over sqrt(2)
SURVEYED_M = 1e-4  # sigma of a station that is taken as exact, small enough to be so


@dataclass(frozen=True)
class StationInformation:
    """Information about the errors of p stations, three numbers each.

    Parameters
    ----------
    names : tuple of str
    matrix : ndarray, shape (3 p, 3 p)
        Information of all the numbers, one over square metres.
    score : ndarray, shape (3 p,)
        The matrix times the best numbers.
    answer : ndarray, shape (t, v, 2, 3 p)
        By how much a metre of each number moves the smoothed answer north and east, at the knots.
    covariance_m2 : ndarray, shape (t, v, 2, 2)
        Of the answer there.
    ranges : ndarray, shape (p,)
        Ranges to each station.
    repetition : float
        Factor of the variances that the residuals of the stations' links ask for, 1 or more: they repeat themselves, or
        are larger than believed. It is in the matrix and the score already.
    response : Response
    """

    names: tuple[str, ...]
    matrix: FloatArray
    score: FloatArray
    answer: FloatArray
    covariance_m2: FloatArray
    ranges: FloatArray
    repetition: float
    response: Response

    def __post_init__(self) -> None:
        for name in ("matrix", "score", "answer", "covariance_m2", "ranges"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def station_information(
    session: Session, settings: CooperativeSettings
) -> tuple[StationInformation, SmoothedProblem, Prepared]:
    """Smooth a session and return what it tells of its stations."""
    known = tuple(
        point if point.position_sigma_m > 0.0 else replace(point, position_sigma_m=SURVEYED_M)
        for point in session.points
    )
    prepared = prepare(replace(session, points=known), settings)
    solved = smooth_problem(prepared, settings)
    return information_of(prepared, solved, settings), solved, prepared


def information_of(prepared: Prepared, solved: SmoothedProblem, settings: CooperativeSettings) -> StationInformation:
    """Return the information about the stations in the smoother's problem at its answer."""
    problem, rows, layout = solved.problem, solved.rows, solved.layout
    stations = len(prepared.points.sigma_m)
    columns = np.zeros((len(problem.residual), EACH * stations))
    source = np.where(rows.kind == POINT, prepared.events.source[rows.event], -1)
    for station in range(stations):
        mine = np.flatnonzero(source == station)
        for axis in range(2):
            is_axis = problem.columns[mine] == layout.points[station] + axis
            columns[mine, EACH * station + axis] = np.where(is_axis, problem.values[mine], 0.0).sum(axis=1)
        columns[mine, EACH * station + 2] = ~rows.is_bearing[mine]
    response = respond(problem, columns)
    left = response.left
    weighted = columns * problem.weight[:, None]
    places = np.array([[layout.of(who).start, layout.of(who).start + 1] for who in range(len(prepared.vehicles))])
    matrix = weighted.T @ left[:, :-1]
    covariance = np.array(
        [
            track.horizontal_m2[nearest_rows(track.time_s, solved.knots.time_s, takes_later=True)]
            for track in solved.smoothed.run.tracks
        ]
    )
    score = weighted.T @ left[:, -1]
    at_stations = np.flatnonzero((source >= 0) & ~rows.is_bearing)
    free = left[:, -1] - left[:, :-1] @ np.linalg.lstsq(matrix, score, rcond=1e-9)[0]
    link = (prepared.events.receiver[rows.event] * stations + source)[at_stations]
    normal = (free * np.sqrt(problem.weight))[at_stations]
    factor = repetition(normal, link, prepared.events.time_s[rows.event][at_stations], settings.smoother.robust_sigmas)
    return StationInformation(
        tuple(point.name for point in prepared.session.points),
        0.5 * (matrix + matrix.T) / factor,
        score / factor,
        -response.moved[:, places, :-1],  # a state is the error that is taken off
        covariance.swapaxes(0, 1),
        np.array([(source == station).sum() for station in range(stations)], dtype=np.float64),
        factor,
        response,
    )


def repetition(normal: FloatArray, link: Int64Array, time_s: FloatArray, scale: float) -> float:
    """Return the factor by which residuals tell less than as many independent ones.

    It is the long-run variance of the residuals of a link over that of right, independent readings under the robust
    weights, from the autocorrelations of all links together. Their sum ends at the first pair of lags whose sum is not
    positive (Geyer, 1992); 1 or more.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> white, link, time_s = rng.standard_normal(4000), np.arange(4000) // 1000, np.arange(4000) % 1000
    >>> repetition(white, link, time_s, 0.0) < 1.2
    True
    >>> 1.6 < repetition((white + np.roll(white, 1)) / np.sqrt(2.0), link, time_s, 0.0) < 2.4
    True
    """
    order = np.lexsort((time_s, link))
    value, link = normal[order], link[order]
    count = len(value)
    if count < LEAST_RANGES:
        return 1.0
    square = float((value**2).mean())
    total, lag = 1.0, 1
    while lag < count // 4:
        pair = 0.0
        for step in (lag, lag + 1):
            same = link[step:] == link[:-step]
            if int(same.sum()) >= LEAST_RANGES:
                pair += float((value[step:] * value[:-step])[same].mean()) / max(square, 1e-12)
        if pair <= NOISE_OF_PAIRS / np.sqrt(count):
            break
        total += 2.0 * pair
        lag += 2
    return max(1.0, total * square / honest_square(scale))


def honest_square(scale: float) -> float:
    """Return the mean square of right, independent residuals under the robust weights.

    Examples
    --------
    >>> honest_square(0.0)
    1.0
    """
    if scale <= 0.0:
        return 1.0
    u = np.linspace(-12.0, 12.0, 4801)
    density = np.exp(-0.5 * u**2)
    return float((density * cauchy(u, scale) * u**2).sum() / density.sum()) * honest_factor(scale)
