"""Smoother of a session: batch least squares over all vehicles and all of its time.

Unknown are the states of all vehicles at the knots (the same as in the filters), uncertain ground points, and biases
of pairs. Every pass linearises all readings and all motion about the last answer and solves for the change exactly
(Gauss-Newton); a step that makes the loss grow is halved. No truth is used. The first reference is that of a filter
over the knots.

Source: Barfoot, State Estimation for Robotics, 2nd ed. 2024, chapters 3 to 5 (batch, robust costs).
"""

from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import GATED, USED
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.chain import Chain, Problem, block
from groundstation.systems.cooperative.smoother.forward import Doubts, doubt_blocks, first_pass
from groundstation.systems.cooperative.smoother.knots import Knots, knots_of
from groundstation.systems.cooperative.smoother.layout import Layout, layout_of
from groundstation.systems.cooperative.smoother.rows import Linearised, Rows
from groundstation.systems.cooperative.smoother.sight import OutputStates
from groundstation.systems.cooperative.smoother.weights import Repetitions, cauchy, honest_factor, loss
from groundstation.systems.cooperative.tracks import AlgorithmRun, JudgedMeasurements, VehicleTrack

SETTLED = 0.05  # a last step that moves no state of the readings by more in all, in shares of a sigma, ends the passes
HALVINGS = 4
MOST_RELATIVE = 12  # vehicles, up to which covariances of their places to one another are made
# Variance of what is opened at a knot: enough, for the first pass has found the leap, and no more than the sums of a
# session keep their digits beside. With (100 km)^2 the score of a common shift of the stations was wrong 50 times over.
MOST_OPEN_M2 = 1e8


@dataclass(frozen=True)
class SmoothedPoint:
    """Ground point that was uncertain, as the session has it.

    Parameters
    ----------
    point : int
        Number of the point in the session.
    error_m : ndarray, shape (2,)
        Believed less estimated position, north and east.
    covariance_m2 : ndarray, shape (2, 2)
    """

    point: int
    error_m: FloatArray
    covariance_m2: FloatArray


@dataclass(frozen=True)
class SmoothedRun:
    """Answer of the smoother.

    Parameters
    ----------
    run : AlgorithmRun
    points : tuple of SmoothedPoint
    passes : int
    has_settled : bool
        Whether the last step was small.
    """

    run: AlgorithmRun
    points: tuple[SmoothedPoint, ...]
    passes: int
    has_settled: bool


def run_smoothed(prepared: Prepared, settings: CooperativeSettings, *, innovates: bool = True) -> AlgorithmRun:
    """Smooth a session.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    innovates : bool
        False: readings shrink the covariance and leave the states where they are.
    """
    return smooth(prepared, settings, innovates=innovates).run


def smooth(prepared: Prepared, settings: CooperativeSettings, *, innovates: bool = True) -> SmoothedRun:
    """Smooth a session; see :func:`run_smoothed`."""
    return _Smoother(prepared, settings).run(innovates=innovates)


_Output = tuple[FloatArray, Int64Array, OutputStates]  # times, knots among those of outputs, states


def _relative(one: _Output, two: _Output, shared: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times of outputs of two vehicles, and the covariance of one to the other."""
    time_s, at, to = np.intersect1d(one[0], two[0], return_indices=True)
    both = one[2].by_knot[at, :2] @ shared[one[1][at]] @ two[2].by_knot[to, :2].swapaxes(1, 2)
    own = one[2].covariance[at, :2, :2] + two[2].covariance[to, :2, :2]
    return time_s, own - both - both.swapaxes(1, 2)


@dataclass(frozen=True)
class SmoothedProblem:
    """Answer of the smoother with the problem at it, for what can be asked of it besides.

    Parameters
    ----------
    smoothed : SmoothedRun
    problem : Problem
        Linearised at the answer, with the weights that make honest covariances.
    rows : Rows
    layout : Layout
    knots : Knots
    """

    smoothed: SmoothedRun
    problem: Problem
    rows: Rows
    layout: Layout
    knots: Knots


def smooth_problem(prepared: Prepared, settings: CooperativeSettings) -> SmoothedProblem:
    """Smooth a session, and keep the problem at the answer."""
    return _Smoother(prepared, settings).with_problem()


class _Smoother:
    def __init__(self, prepared: Prepared, settings: CooperativeSettings) -> None:
        self._prepared, self._settings = prepared, settings
        self._layout, self._knots = layout_of(prepared, settings), knots_of(prepared, settings)
        for number, group in enumerate(self._layout.groups):
            group.set_knots(np.ascontiguousarray(self._knots.own_s[:, list(self._layout.members[number])]))
        self._rows = Rows(prepared, self._layout, self._knots)
        self._scale = settings.smoother.robust_sigmas
        self._factor = np.ones(len(self._rows.event))
        self._doubts: Doubts = {}

    def run(self, *, innovates: bool) -> SmoothedRun:
        t, size = len(self._knots.time_s), self._layout.size
        if not innovates:
            x = self._still()
            return self._finish(x, Linearised(np.zeros(len(self._rows.event)), self._seen(x).values), 0, True)
        first = first_pass(self._prepared, self._layout, self._knots, self._rows, self._settings)
        x, self._doubts = first.x, first.doubts
        assert x.shape == (t, size)
        repetitions = Repetitions(self._prepared, self._rows)
        seen, passes, has_settled = self._seen(x), 0, False
        x, seen, passes, has_settled = self._settle(x, seen, passes)
        factor = repetitions.factors(self._normal(seen.residual), self._settings)
        if len(factor) and np.abs(factor - 1.0).max() > 0.0:
            self._factor = factor
            x, seen, passes, has_settled = self._settle(x, seen, passes)
        return self._finish(x, seen, passes, has_settled)

    def with_problem(self) -> SmoothedProblem:
        """Run, and keep the problem at the answer."""
        run = self.run(innovates=True)
        return SmoothedProblem(run, self._problem_at_end, self._rows, self._layout, self._knots)

    def _still(self) -> FloatArray:
        """Return the states at all knots as the motion alone leads them."""
        x = np.tile(self._layout.start, (len(self._knots.time_s), 1))
        for number, group in enumerate(self._layout.groups):
            span = self._layout.span(number)
            for knot in range(1, len(x)):
                moved = group.move(x[knot - 1, span].reshape(1, group.count, group.size), knot - 1, knot)[0]
                x[knot, span] = moved.ravel()
        return x

    def _seen(self, x: FloatArray) -> Linearised:
        return self._rows.linearise(x, 0, len(x))

    def _normal(self, residual: FloatArray) -> FloatArray:
        """Return residuals over the spread of one reading."""
        return np.asarray(residual / np.sqrt(self._rows.variance * self._rows.spread))

    def _settle(self, x: FloatArray, seen: Linearised, passes: int) -> tuple[FloatArray, Linearised, int, bool]:
        """Make passes until a step is small."""
        before, process = np.inf, 0.0
        for _ in range(self._settings.smoother.most_passes):
            passes += 1
            problem = self._problem(x, seen, honest=False)
            step, duals = Chain(problem).solve()
            process = self._process(problem, duals)
            x, seen, before = self._stepped(x, step, before, process)
            if self._moved(problem, step) < SETTLED**2:
                return x, seen, passes, True
        return x, seen, passes, False

    def _stepped(
        self, x: FloatArray, step: FloatArray, before: float, process: float
    ) -> tuple[FloatArray, Linearised, float]:
        """Return the states after a step, halved while the loss grows by it."""
        for halving in range(HALVINGS + 1):
            tried = x + step * 0.5**halving
            seen = self._seen(tried)
            now = self._loss(seen) + process
            if not np.isfinite(now) or now > before * (1.0 + 1e-6) + 1e-6:
                continue
            break
        return tried, seen, now

    def _loss(self, seen: Linearised) -> float:
        rows = self._rows
        each = loss(self._normal(seen.residual), self._scale) * rows.spread / self._factor
        return float(np.nansum(each))

    @staticmethod
    def _process(problem: Problem, duals: FloatArray) -> float:
        """Return half the square of what start and motion had to give."""
        total = float((problem.variance * duals[0] ** 2).sum())
        for span, noise in zip(problem.spans, problem.noise, strict=True):
            t, v, n = noise.shape[:3]
            dual = duals[1:, span].reshape(t, v, n)
            total += float(np.einsum("tvi,tvij,tvj->", dual, noise, dual))
        return 0.5 * total

    def _moved(self, problem: Problem, step: FloatArray) -> float:
        """Return the largest square of the change of a prediction over its sigma."""
        padded = np.concatenate([step, np.zeros((len(step), 1))], axis=1)
        change = (problem.values * padded[self._rows.knot[:, None], problem.columns]).sum(axis=1)
        square = change**2 * problem.weight
        return float(square.max(initial=0.0))

    def _problem(self, x: FloatArray, seen: Linearised, *, honest: bool) -> Problem:
        layout, rows = self._layout, self._rows
        phis, noises = [], []
        defect = x[:-1] - x[1:]  # of constants; the others follow
        for number, group in enumerate(layout.groups):
            span = layout.span(number)
            here = x[:, span].reshape(len(x), group.count, group.size)
            moved, phi, noise = group.move(here[:-1], 0, len(x) - 1)
            defect[:, span] = (moved - here[1:]).reshape(len(x) - 1, -1)
            for knot in {at for at, _ in self._doubts}:
                blocks = doubt_blocks(self._prepared, layout, self._doubts, knot, number)
                if blocks is not None and knot:
                    noise = noise.copy()
                    noise[knot - 1] += np.minimum(blocks, MOST_OPEN_M2)
            phis.append(phi)
            noises.append(noise)
        known = np.isfinite(seen.residual)
        weight = cauchy(self._normal(np.where(known, seen.residual, 0.0)), self._scale) / self._factor / rows.variance
        if honest:
            weight = weight * honest_factor(self._scale)
        return Problem(
            [layout.span(number) for number in range(len(layout.groups))],
            phis,
            noises,
            defect,
            layout.start - x[0],
            layout.variance,
            rows.first,
            rows.columns,
            np.where(known[:, None], seen.values, 0.0),
            np.where(known, seen.residual, 0.0),
            weight,
        )

    def _finish(self, x: FloatArray, seen: Linearised, passes: int, has_settled: bool) -> SmoothedRun:
        layout, knots, prepared = self._layout, self._knots, self._prepared
        self._problem_at_end = self._problem(x, seen, honest=True)
        blocks = [np.empty((len(x), layout.groups[g].size, layout.groups[g].size)) for g, _, _ in layout.of_vehicle]
        pairs = list(combinations(range(len(blocks)), 2)) if len(blocks) <= MOST_RELATIVE else []
        asked = {knot: number for number, knot in enumerate(np.unique(knots.output_knot).tolist())}
        shared = {
            (i, j): np.empty((len(asked), blocks[i].shape[1], blocks[j].shape[1])) for i, j in pairs
        }  # of two vehicles, at the knots of outputs
        points: list[SmoothedPoint] = []
        for knot, P, _L, behind in Chain(self._problem_at_end).covariances():
            for vehicle in range(len(blocks)):
                blocks[vehicle][knot] = block(P, behind, layout.of(vehicle))
            for i, j in pairs if knot in asked else ():
                one, two = layout.of(i), layout.of(j)
                shared[i, j][asked[knot]] = P[one, two] - behind[one] @ P[:, two]
            if not knot:
                for point in np.flatnonzero(layout.points >= 0).tolist():
                    at = slice(int(layout.points[point]), int(layout.points[point]) + 2)
                    points.append(SmoothedPoint(point, x[0, at].copy(), block(P, behind, at)))
        tracks, outputs = [], []
        for vehicle, one_vehicle in enumerate(prepared.vehicles):
            mine = knots.output_vehicle == vehicle
            time_s, knot_of = knots.output_s[mine], knots.output_knot[mine]
            group, index, _ = layout.of_vehicle[vehicle].tolist()
            out = layout.groups[group].states_at(
                index, time_s, knot_of, x[knot_of][:, layout.of(vehicle)], blocks[vehicle][knot_of]
            )
            outputs.append((time_s, np.array([asked[one] for one in knot_of.tolist()], dtype=np.int64), out))
            tracks.append(
                VehicleTrack(one_vehicle.name, time_s, out.position_m, out.state, out.covariance, one_vehicle.height)
            )
        judged, counts = self._judged(seen)
        if not has_settled:
            counts["unsettled"] = 1
        signs = [1.0 if vehicle.heading >= 0 else -1.0 for vehicle in prepared.vehicles]  # a place, or its error
        relative = {
            (i, j): _relative(outputs[i], outputs[j], signs[i] * signs[j] * both) for (i, j), both in shared.items()
        }
        none = np.zeros(0)
        run = AlgorithmRun("smoothed", "batch", tuple(tracks), judged, counts, {}, none, none, relative)
        return SmoothedRun(run, tuple(points), passes, has_settled)

    def _judged(self, seen: Linearised) -> tuple[JudgedMeasurements, dict[str, int]]:
        """Return residuals over the spread of one reading; those beyond the gate count as gated."""
        rows, gate = self._rows, self._settings.gate_sigma
        normal = self._normal(seen.residual)
        kept = np.flatnonzero(np.isfinite(normal))
        order: Int64Array = kept[np.lexsort((rows.is_bearing[kept], rows.event[kept]))]
        is_gated = np.abs(normal[order]) > gate if gate > 0.0 else np.zeros(len(order), dtype=bool)
        mark = np.where(is_gated, GATED, USED)
        sigma = np.sqrt(rows.variance * rows.spread)[order]
        counts = {
            "used": int((~is_gated).sum()),
            "gated": int(is_gated.sum()),
            "lost": len(normal) - len(kept),
        }
        for _knot, vehicle in self._doubts:
            name = "clock_leaps" if self._prepared.vehicles[vehicle].clock >= 0 else "reopened"
            counts[name] = counts.get(name, 0) + 1
        judged = JudgedMeasurements(rows.event[order], seen.residual[order], sigma, mark)
        return judged, {name: count for name, count in counts.items() if count}
