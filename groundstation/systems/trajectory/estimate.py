"""Estimate of the trajectory of one segment.

It goes from start, latency, noise and slip to the smoothed passes.
"""

from collections.abc import Callable
from dataclasses import field, replace

import numpy as np

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.halves import two_at_once
from groundstation.systems.trajectory import observations, slip, still
from groundstation.systems.trajectory.fit import NUMBERS, Fit, Number, Scores, fit_model
from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.systems.trajectory.layout import Plan, Samples, fill_gaps, lay_out
from groundstation.systems.trajectory.model import Model, StartSigmas, gate
from groundstation.systems.trajectory.observations import Observations
from groundstation.systems.trajectory.passes import (
    OWN_ESTIMATE,
    Pass,
    Start,
    at_line,
    filter_epochs,
    line_of,
    linear_room,
    make_room,
    nothing_kept,
    run_pass,
)
from groundstation.systems.trajectory.score import Scored, Variances, score_of, solved_with
from groundstation.systems.trajectory.start import starts_at
from groundstation.systems.trajectory.states import (
    ATT,
    LAG,
    LAT,
    LEV,
    MNT,
    NO_SLIP,
    SG,
    SLOW,
    STATES,
    WHEEL,
    FloatArray,
    Gate,
    Noise,
    Now,
    Room,
)
from groundstation.systems.trajectory.track import angles_of, smoothed_track

OPEN_SIGMAS, CLOSED_SIGMAS = 30.0, 5.0  # of the gate, before and after the noise is fitted
LATENCY_ROUNDS, LATENCY_ENOUGH_S = 6, 0.003
MOST_LATENCY_S = 2.0  # no receiver is later; beyond it a filter has lost its way
SETTLE_ROUNDS, LINE_ROUNDS = 3, 2
COARSE_FIT_S, FIT_S = 150.0, 600.0  # seconds behind the first motion that the noise is fitted to
MOVES_MPS = 1.0
SETTLED_RAD = 5e-4  # attitude of the start against the pass before
SLIP = (Number("slip_mps", 1.0, 0.1, 20.0), Number("slip_walk_deg_rts", 1.0, 0.1, 10.0))
PRUNE_S, PRUNE_BELOW = 120.0, 60.0  # hypotheses so far below the best after so long are given up
SAME_HEADING_DEG = 10.0


@dataclass(frozen=True)
class Problem:
    """Input of the estimate of a segment.

    ``sigma_m`` (3,) is the median of the stated position sigmas.
    """

    samples: Samples
    gnss: GnssFixes
    seen: Observations
    begin_s: float
    sigma_m: FloatArray
    is_still: bool
    latency_s: float = 0.0
    lag_s: float = 0.0
    sigmas: StartSigmas = field(default_factory=StartSigmas)
    has_slip: bool = False
    has_baro: bool = False
    has_wheels: bool = False
    heading_sigma_rad: float = 0.0  # of a magnetic heading; its observations are weaker, as they say the same

    def plan(self, model: Model) -> Plan:
        """Return the epochs and the measurements with the variances of a model."""
        return lay_out(self.samples, model.weighted(self.seen), self.begin_s, self.latency_s, self.lag_s)

    def noise(self, model: Model) -> Noise:
        """Return a model's numbers as the loops take them."""
        return model.noise(self.sigma_m)

    def variances(self, model: Model) -> FloatArray:
        """Return the variances of the constants at the start."""
        return self.sigmas.variances(
            self.noise(model),
            model,
            has_latency=True,
            has_slip=self.has_slip,
            has_baro=self.has_baro,
            has_wheels=self.has_wheels,
        )

    def restarted(self, start: Start, model: Model) -> Start:
        """Return a start with the variances of a model."""
        variances, p = self.variances(model), start.p.copy()
        for at in (*range(SG, LEV), *range(SLOW, STATES)):
            p[at, :] = p[:, at] = 0.0
            p[at, at] = variances[at]
        return replace(start, p=p)


@dataclass(frozen=True)
class Hypothesis:
    """A heading at the start, what became of it, and the logarithm of its likelihood."""

    start_heading_deg: float
    end_heading_deg: float
    likelihood: float
    start: Start


@dataclass(frozen=True)
class Estimate:
    """Estimate of a segment."""

    problem: Problem
    model: Model
    fit: Fit
    hypotheses: tuple[Hypothesis, ...]
    result: Pass
    gate: Gate
    travel: slip.Travel

    @property
    def constant_sigma_m(self) -> FloatArray:
        """Sigma of a constant error of GNSS position, north, east, down, shape (3,).

        It is what the slow error leaves of what the receiver states.

        An error that lasts longer than the log is seen by nothing in it: the fit takes it for none.
        """
        share = 1.0 - min(1.0, self.model.slow_scale) ** 2
        return np.asarray(self.problem.sigma_m * np.sqrt(share))

    @property
    def latency_s(self) -> float:
        """Latency of GNSS position."""
        return self.problem.latency_s + float(self.result.constants[LAT])

    @property
    def lag_s(self) -> float:
        """Latency of GNSS velocity behind that of position."""
        return self.problem.lag_s + float(self.result.constants[LAG])


def pose(imu: ImuIncrements, gnss: GnssFixes, *, may_stop: bool) -> Problem:
    """Return the problem of a segment at latency zero.

    Raises
    ------
    NotAssessableError
        Without a fix in the span of the unit.
    """
    samples = fill_gaps(imu)
    have = np.isfinite(gnss.latitude_deg) & np.isfinite(motion_of(gnss)[:, :2]).all(axis=1)
    inside = have & (gnss.time_s >= samples.begin_s) & (gnss.time_s < samples.time_s[-1])
    if not inside.any():
        raise NotAssessableError("trajectory", "no fix with a position and a velocity lies in the span of the unit")
    begin_s = float(gnss.time_s[inside][0])
    middle, stands, rate = still.still_windows(samples, gnss, 0.0, may_stop=may_stop)
    seen = observations.joined([observations.of_gnss(gnss), still.observations_of(middle, stands, rate)])
    near = np.abs(middle - begin_s) < 1.5
    sigma_m = np.nanmedian(gnss.position_sigma_m[inside], axis=0)
    return Problem(samples, gnss, seen, begin_s, sigma_m, bool(stands[near].all() and near.any()))


def hypotheses_of(problem: Problem, model: Model, rules: Gate) -> tuple[Hypothesis, ...]:
    """Return the heading hypotheses by likelihood, the best first.

    Those that became one are one.
    """
    plan, noise = problem.plan(model), problem.noise(model)
    starts = starts_at(
        problem.samples,
        problem.gnss,
        plan.epoch_s[0],
        noise,
        problem.sigmas,
        problem.variances(model),
        is_still=problem.is_still,
        latency_s=problem.latency_s,
    )
    early = int(np.searchsorted(plan.epoch_s, _first_motion_s(problem.gnss, plan.epoch_s[0]) + PRUNE_S))
    early = min(early, len(plan.epoch_s))
    rooms = [linear_room(plan), linear_room(plan)]  # what is linearised is not kept: two at once need two

    def run(begin: int, end: int, now: Now, work: Room) -> float:
        room = rooms.pop()
        value = filter_epochs(
            problem.samples, plan, noise, rules, OWN_ESTIMATE, (begin, end), now, work, room, nothing_kept()
        )
        rooms.append(room)
        return value

    def begun(start: Start) -> tuple[float, Start, Now, Room]:
        now, work = start.now(), make_room(start.prior)
        return run(0, early, now, work), start, now, work

    def ended(one: tuple[float, Start, Now, Room]) -> Hypothesis:
        value, start, now, work = one
        total = value + run(early, len(plan.epoch_s), now, work)
        return Hypothesis(heading_of(start.nav), heading_of(now.nav), total, start)

    runs = two_at_once(begun, starts)
    best = max(value for value, *_ in runs)
    found = two_at_once(ended, [one for one in runs if one[0] >= best - PRUNE_BELOW])
    found.sort(key=lambda one: -one.likelihood)
    kept: list[Hypothesis] = []
    for one in found:
        apart = [abs(float(wrap_180(one.end_heading_deg - other.end_heading_deg))) for other in kept]
        if all(angle > SAME_HEADING_DEG for angle in apart):
            kept.append(one)
    return tuple(kept)


def heading_of(nav: FloatArray) -> float:
    """Return the heading of an estimate, deg."""
    return float(wrap_360(np.degrees(angles_of(nav[None, 6:])[2][0])))


def _first_motion_s(gnss: GnssFixes, begin_s: float) -> float:
    speed = np.linalg.norm(np.nan_to_num(motion_of(gnss)[:, :2]), axis=1)
    moving = gnss.time_s[(speed > MOVES_MPS) & (gnss.time_s >= begin_s)]
    return float(moving[0]) if len(moving) else begin_s


def settle(problem: Problem, model: Model, rules: Gate, start: Start, rounds: int) -> tuple[Problem, Start]:
    """Run passes until the latency stands; each begins where the one before was smoothed to."""
    for _ in range(rounds):
        plan = problem.plan(model)
        first = np.arange(len(plan.epoch_s)) == 0
        done = run_pass(problem.samples, plan, problem.noise(model), rules, start, wanted=first, has_sigmas=False)
        late, lag = float(done.constants[LAT]), float(done.constants[LAG])
        late = float(np.clip(problem.latency_s + late, -MOST_LATENCY_S, MOST_LATENCY_S)) - problem.latency_s
        start = done.start
        value, prior = start.value.copy(), start.prior.copy()
        for at, by in ((LAT, late), (LAG, lag)):
            prior[at] = -(problem.latency_s if at == LAT else problem.lag_s) - by
            value[at] = 0.0
        start = replace(start, value=value, prior=prior)
        problem = replace(problem, latency_s=problem.latency_s + late, lag_s=problem.lag_s + lag)
        turned_rad = float(np.linalg.norm(done.x[0, ATT : ATT + 3]))
        if max(abs(late), abs(lag)) < LATENCY_ENOUGH_S and turned_rad < SETTLED_RAD:
            break
    return problem, start


def relinearised(
    problem: Problem, model: Model, rules: Gate, done: Pass, rounds: int = LINE_ROUNDS, *, has_sigmas: bool = True
) -> Pass:
    """Run passes that are linearised about the smoothed trajectory of the one before.

    The last of them has sigmas, where they are wanted.

    A filter that is linearised about its own estimate thinks that it sees what it cannot: as the estimate moves, the
    combination of errors that no datum shows moves too.

    Source: B. M. Bell, The iterated Kalman smoother as a Gauss-Newton method, SIAM J. Optimization 4, 1994;
    G. P. Huang, A. I. Mourikis, S. I. Roumeliotis, Observability-based rules for consistent EKF SLAM, 2010.
    """
    plan, noise = problem.plan(model), problem.noise(model)
    for left in range(rounds - 1, -1, -1):
        line = line_of(done)
        start = problem.restarted(at_line(done.start, line), model)
        done = run_pass(problem.samples, plan, noise, rules, start, line, has_sigmas=has_sigmas and not left)
    return done


def fitted(problem: Problem, model: Model, done: Pass, numbers: tuple[Number, ...] = NUMBERS) -> Fit:
    """Fit the numbers of the model to the first part of the log that moves.

    The log is linearised about the line of a pass. A search on the first minutes, with all that an open gate lets in,
    says which measurements are outliers; the others are the same for all models of the second search.
    """
    first_s = _first_motion_s(problem.gnss, problem.begin_s)
    found = fit_model(model, _scores(problem, done, first_s + COARSE_FIT_S), numbers)
    again = fit_model(model, _scores(problem, done, first_s + FIT_S, found.model), numbers, found.model)
    return replace(again, evaluations=found.evaluations + again.evaluations)


def _scores(problem: Problem, done: Pass, last_s: float, known: Model | None = None) -> Scores:
    """Return the scores of models on the epochs up to a time.

    Where a model is ``known``, what it rejects is left out.
    """
    plan, rules = done.plan, gate(OPEN_SIGMAS)
    end = int(np.searchsorted(plan.epoch_s, last_s))
    used = problem.seen.take(plan.order[: int(plan.schedule.seen[end])])

    def variances(one: Model) -> Variances:
        weighted = np.ascontiguousarray(one.weighted(used).variance)
        return Variances(weighted, problem.noise(one), problem.restarted(done.begun, one))

    if known is not None:
        said = variances(known)
        _, solved = solved_with(problem.samples, plan, gate(CLOSED_SIGMAS), done.linear, end, said)
        used = replace(used, variance=np.where(solved.mark.reshape(-1, 3) < 0, np.nan, used.variance))

    def scored(model_at: Callable[[FloatArray], Model], at: FloatArray) -> Scored:
        return score_of(problem.samples, plan, rules, done.linear, end, lambda to: variances(model_at(to)), at)

    return scored


def estimate(
    imu: ImuIncrements,
    gnss: GnssFixes,
    *,
    may_roll: bool = False,
    may_stop: bool = True,
    prior: Model | None = None,
    sigmas: StartSigmas | None = None,
    fit: bool = True,
    latency_s: float = 0.0,
    lag_s: float = 0.0,
) -> Estimate:
    """Estimate the trajectory of one segment.

    Parameters
    ----------
    imu, gnss
    may_roll : bool
        The vehicle rolls: it does not slip, where the data agree.
    may_stop : bool
        It may stand still on its way.
    prior : Model, optional
        Numbers of the class.
    sigmas : StartSigmas, optional
        Of the constants at the start.
    fit : bool
        False: the numbers of ``prior`` as they are.
    latency_s, lag_s : float
        Where the search for the latencies begins.
    """
    model = Model() if prior is None else prior
    problem = replace(pose(imu, gnss, may_stop=may_stop), latency_s=latency_s, lag_s=lag_s)
    if sigmas is not None:
        problem = replace(problem, sigmas=sigmas)
    open_gate, rules = gate(OPEN_SIGMAS), gate(CLOSED_SIGMAS)
    first = hypotheses_of(problem, model, open_gate)
    problem, start = settle(problem, model, open_gate, first[0].start, LATENCY_ROUNDS)
    _, done = _at(problem, model, rules, start)
    found = Fit(model, done.likelihood, 0, ())
    if fit:
        done = relinearised(problem, model, rules, done, has_sigmas=False)
        found = fitted(problem, model, done)
        model = found.model
    problem, start = settle(problem, model, rules, problem.restarted(start, model), SETTLE_ROUNDS)
    start, done = _at(problem, model, rules, start)
    track = smoothed_track(problem.samples, done)
    travel = slip.direction_of_travel(track)
    if may_roll and travel.does_roll:
        seen = observations.joined([problem.seen, slip.observations_of(track)])
        problem = replace(problem, seen=seen, has_slip=True)
        value = start.value.copy()
        value[MNT], value[MNT + 1] = travel.yaw_rad, travel.pitch_rad
        start = replace(start, value=value)
        start, done = _at(problem, model, rules, problem.restarted(start, model))
        if fit:
            done = relinearised(problem, model, rules, done, has_sigmas=False)
            found = fitted(problem, model, done, SLIP)
            model = found.model
            start, done = _at(problem, model, rules, problem.restarted(start, model))
    done = relinearised(problem, model, rules, done)
    last = hypotheses_of(without_slip(problem), model, rules)
    return Estimate(problem, model, found, last, done, rules, travel)


def without_slip(problem: Problem) -> Problem:
    """Return the problem without what was learned of the direction of travel.

    It would favour the heading that it is of.
    """
    seen = problem.seen.take(~np.isin(problem.seen.kind, (NO_SLIP, WHEEL)))
    return replace(problem, seen=seen, has_slip=False, has_wheels=False)


def _at(problem: Problem, model: Model, rules: Gate, start: Start) -> tuple[Start, Pass]:
    """Run one pass at the latency that stands, without sigmas."""
    done = run_pass(problem.samples, problem.plan(model), problem.noise(model), rules, start, has_sigmas=False)
    return done.start, done
