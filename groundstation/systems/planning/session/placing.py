"""Search for places of ground points.

They are best for a fixed point of the way, for its worst point, or with one point lost.

Source: Skrypnik, Inter-aircraft navigation in air traffic management, 2010, chapter 6.2 (largest det(H'H) at a fixed
point of the path, gradient method).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import GroundstationError
from groundstation.systems.planning.session.accuracy import PLACE, AccuracyModel
from groundstation.systems.planning.session.descent import Minimum, minimise
from groundstation.systems.planning.session.measures import geometry_of, loss, loss_by_direction
from groundstation.systems.planning.session.motion import SessionMotion
from groundstation.systems.planning.session.region import Region, polygon
from groundstation.systems.planning.session.scenario import NEAREST_M, Criterion, LocalCriterion, SessionPlan

Carry = Callable[[FloatArray], FloatArray]
SHARPNESS = (0.1, 0.02, 0.004)  # of the smooth largest loss, one descent after the other; shares of the loss
REACH = 0.01  # of the rectangle: so far a gain that is left is looked for


class Site:
    """Ground points to be placed, along the way of the aircraft without control.

    Parameters
    ----------
    plan : SessionPlan

    Raises
    ------
    GroundstationError
        When a point has no allowed place.
    """

    def __init__(self, plan: SessionPlan) -> None:
        self.plan, count = plan, len(plan.aircraft)
        motion = SessionMotion(plan)
        self.way = motion.paths(motion.uncontrolled).position_m
        self.placed = [number for number, point in enumerate(plan.points) if point.is_placed]
        names = [plan.points[number].name for number in self.placed]
        self.mirrors = {number: names.index(point.mirrors) for number, point in enumerate(plan.points) if point.mirrors}
        self.sources = [count + number for number in self.placed]
        self.fixed = min(max(round(plan.placement.fixed_at_s / plan.step_s), 1), plan.steps)
        last = min(round(plan.placement.to_s / plan.step_s), plan.steps)
        self.span = max(min(round(plan.placement.from_s / plan.step_s), last), 1), max(last, 1)
        self.regions = [self._region(number) for number in range(len(self.placed))]
        self.given = self.project(
            np.array([[plan.points[number].north_m, plan.points[number].east_m] for number in self.placed])
        )

    def _region(self, number: int) -> Region:
        asked = self.plan.placement
        low, high = (asked.low_north_m, asked.low_east_m), (asked.high_north_m, asked.high_east_m)
        region = Region(np.array(low), np.array(high), tuple(polygon(one.corners_m) for one in asked.keep_out))
        found = region.mirrored() if number in self.mirrors.values() else region
        if found.is_empty:
            name = self.plan.points[self.placed[number]].name
            raise GroundstationError(
                self.plan.title,
                f"no place for {name}: keep_out covers the whole rectangle",
                "an allowed place",
                "widen the rectangle or take a keep_out away",
            )
        return found

    @property
    def width(self) -> float:
        """Longer side of the rectangle."""
        return max(float((region.high_m - region.low_m).max()) for region in self.regions) or 1.0

    def project(self, places: FloatArray) -> FloatArray:
        """Nearest allowed places, shape (points, 2)."""
        return np.array([region.nearest(place) for region, place in zip(self.regions, places, strict=True)])

    def positions(self, places: FloatArray) -> FloatArray:
        """Return the positions of all at every epoch, (epochs, sources, 3), with points at places."""
        found = self.way.copy()
        found[:, self.sources, :2] = places
        for number, row in self.mirrors.items():
            found[:, len(self.plan.aircraft) + number, :2] = places[row] * np.array([1.0, -1.0])
        return found

    def by_places(self, by_position: FloatArray) -> FloatArray:
        """Derivative by the places from that by the positions."""
        summed = by_position.sum(axis=0)
        found = summed[self.sources, :2].copy()
        for number, row in self.mirrors.items():
            found[row] += summed[len(self.plan.aircraft) + number, :2] * np.array([1.0, -1.0])
        return np.asarray(found)

    def without(self, number: int) -> tuple[AccuracyModel, list[int]]:
        """The session without a ground point, and which of all sources are left."""
        plain = [replace(point, is_placed=False, mirrors="") for point in self.plan.points]
        left = [one for one in range(self.way.shape[1]) if one != len(self.plan.aircraft) + number]
        return AccuracyModel(replace(self.plan, points=tuple(plain[:number] + plain[number + 1 :]))), left


class PlaceLoss:
    """Smooth maximum of the loss over epochs and, where a point may be lost, over that point.

    Parameters
    ----------
    site : Site
    criterion : Criterion
    epochs : (int, int)
        First and last that count.
    may_lose : bool
        Any one ground point, the worst one.
    """

    def __init__(self, site: Site, criterion: Criterion, epochs: tuple[int, int], may_lose: bool = False) -> None:
        self.site, self.criterion, self.epochs, self.width = site, criterion, epochs, 1.0
        everybody = list(range(site.way.shape[1]))
        whole = [(AccuracyModel(site.plan), everybody)]
        self._models = [site.without(one) for one in range(len(site.plan.points))] if may_lose else whole
        asked = site.plan.placement
        self._axes, self._weights = asked.axes, np.array([asked.weight_north, asked.weight_east, asked.weight_up])

    def __call__(self, places: FloatArray) -> tuple[float, FloatArray]:
        """The smooth largest loss, width log(sum exp(loss / width)), and its derivative.

        Infinite where the way meets a source.
        """
        position = self.site.positions(places)
        found = [self._terms(model, position[:, left]) for model, left in self._models]
        terms = np.concatenate([values for values, _ in found])
        largest = float(terms.max())
        if not np.isfinite(largest):
            return np.inf, np.zeros(places.shape)
        shares = np.exp((terms - largest) / self.width)
        weights = shares / shares.sum()
        by_position = np.zeros(position.shape)
        for (_, carry), (_, left), part in zip(found, self._models, np.split(weights, len(found)), strict=True):
            by_position[:, left] += carry(part)
        return largest + self.width * float(np.log(shares.sum())), self.site.by_places(by_position)

    def largest(self, places: FloatArray) -> float:
        """The largest loss itself."""
        position = self.site.positions(places)
        return max(float(self._terms(model, position[:, left])[0].max()) for model, left in self._models)

    def _terms(self, model: AccuracyModel, position_m: FloatArray) -> tuple[FloatArray, Carry]:
        """Losses at the epochs, and what carries their weights back to the positions."""
        if model.links(position_m[: self.epochs[1] + 1]).range_m.min() < NEAREST_M:
            return np.full(self.epochs[1] - self.epochs[0] + 1, np.inf), np.zeros_like
        if self.criterion == "covariance":
            return self._variances(model, position_m)
        return self._geometry(model, position_m, self.criterion)

    def _variances(self, model: AccuracyModel, position_m: FloatArray) -> tuple[FloatArray, Carry]:
        first, last = self.epochs
        found = model.accuracy(position_m[: last + 1])
        own = model.first_of(model.user) + PLACE
        values = np.asarray(found.covariance[first:, own, own] @ self._weights)

        def carry(weights: FloatArray) -> FloatArray:
            by_covariance = np.zeros(found.covariance.shape)
            by_covariance[first:, own, own] = weights[:, None] * self._weights
            by_position = np.zeros(position_m.shape)
            by_position[: last + 1] = model.by_position(found, by_covariance)
            return by_position

        return values, carry

    def _geometry(
        self, model: AccuracyModel, position_m: FloatArray, criterion: LocalCriterion
    ) -> tuple[FloatArray, Carry]:
        first, last = self.epochs
        links = model.links(position_m[first - 1 : last + 1])
        mine = links.receiver == model.user
        geometry = geometry_of(links.direction[:, mine], self._axes)
        slopes = loss_by_direction(geometry, criterion, self._axes)

        def carry(weights: FloatArray) -> FloatArray:
            by_direction = np.zeros(links.line_m.shape)
            by_direction[:, mine] = weights[:, None, None] * slopes
            by_position = np.zeros(position_m.shape)
            by_position[first : last + 1] = links.by_position(by_direction, model.sources)
            return by_position

        return loss(geometry, criterion), carry


def place(wanted: PlaceLoss, starts: Sequence[FloatArray]) -> tuple[Minimum, list[float]]:
    """Return the places of the least loss, and where each start ended.

    The largest of several terms counts: a smooth maximum of them is minimised, less smooth in each of a few descents.
    """
    site, asked = wanted.site, wanted.site.plan.placement
    found: list[Minimum] = []
    for start in starts:
        at, work = start, (0, 0)
        for sharpness in SHARPNESS:
            wanted.width = max(sharpness * abs(wanted.largest(at)), 1e-300)
            one = minimise(
                wanted,
                site.project,
                at,
                site.width,
                iterations=asked.iterations,
                tolerance=asked.tolerance,
                reach=REACH,
            )
            at, work = one.x, (work[0] + one.iterations, work[1] + one.evaluations)
        found.append(replace(one, loss=wanted.largest(one.x), iterations=work[0], evaluations=work[1]))
    best = min(found, key=lambda one: one.loss)
    total = sum(one.iterations for one in found), sum(one.evaluations for one in found)
    return replace(best, iterations=total[0], evaluations=total[1]), [one.loss for one in found]


def starts_of(site: Site) -> list[FloatArray]:
    """The places given, and random ones."""
    asked, rng = site.plan.placement, np.random.default_rng(site.plan.placement.seed)
    found = [site.given]
    for _ in range(asked.starts):
        drawn = [rng.uniform(region.low_m, region.high_m) for region in site.regions]
        found.append(site.project(np.array(drawn)))
    return found
