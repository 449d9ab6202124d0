"""Placement of ground points: comparison of every design, a map, and remarks."""

from dataclasses import asdict, field

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.results.figures import FigureData
from groundstation.systems.planning.session.accuracy import PLACE, AccuracyModel
from groundstation.systems.planning.session.measures import InformationModes, geometry_of
from groundstation.systems.planning.session.motion import points_at_starts
from groundstation.systems.planning.session.placement_answer import GIVEN, DesignRow, PlacementPlan, PlaceRow
from groundstation.systems.planning.session.placement_arrays import (
    PlacementAccuracy,
    PlacementKeepOut,
    PlacementMap,
    PlacementPoints,
)
from groundstation.systems.planning.session.placing import PlaceLoss, Site, place, starts_of
from groundstation.systems.planning.session.scenario import NEAREST_M, Criterion, Over, SessionPlan

POOR_DOP = 20.0
SPREAD = 0.01  # of the losses of several starts: more is worth a remark
ON_EDGE_M = 0.01
NEAR_WAY_M = 50.0  # across: a point nearer than this stands under the way


@dataclass(frozen=True)
class Design:
    """Places, and how they were found."""

    name: str
    places: FloatArray
    gap: float = 0.0
    has_converged: bool = True
    iterations: int = 0
    evaluations: int = 0
    losses: tuple[float, ...] = field(default=())


def plan_placement(plan: SessionPlan) -> tuple[PlacementPlan, tuple[Finding, ...]]:
    """Find places for the points of a session that are to be placed.

    Raises
    ------
    GroundstationError
        When a point has no allowed place.
    """
    site = Site(plan)
    designs = [Design(GIVEN, site.given)]
    designs += [_designed(site, criterion, over) for criterion, over in _asked(plan)]
    answer = _answer(site, designs)
    return answer, _findings(site, designs, answer)


def _asked(plan: SessionPlan) -> list[tuple[Criterion, Over]]:
    """Return the designs that every plan compares, and the one asked for."""
    usual: list[tuple[Criterion, Over]] = [("determinant", "fixed"), ("covariance", "fixed")]
    usual += [("determinant", "way"), ("covariance", "way")]
    if len(plan.points) > 1:
        usual.append(("covariance", "lost"))
    mine = (plan.placement.criterion, plan.placement.over)
    return usual if mine in usual else [*usual, mine]


def _designed(site: Site, criterion: Criterion, over: Over) -> Design:
    epochs = site.span if over == "way" else (site.fixed, site.fixed)
    wanted = PlaceLoss(site, criterion, epochs, may_lose=over == "lost")
    best, losses = place(wanted, starts_of(site))
    work = best.gap, best.has_converged, best.iterations, best.evaluations
    return Design(f"{criterion}_{over}", best.x, *work, tuple(losses))


def _geometry(site: Site, model: AccuracyModel, position_m: FloatArray) -> InformationModes:
    links = model.links(position_m)
    return geometry_of(links.direction[:, links.receiver == model.user], site.plan.placement.axes)


def _two_sigma(model: AccuracyModel, position_m: FloatArray) -> FloatArray:
    """Twice the sigmas north, east, up of the judged aircraft, shape (epochs, 3)."""
    own = model.first_of(model.user) + PLACE
    return np.asarray(2.0 * np.sqrt(model.accuracy(position_m).covariance[:, own, own]))


def _answer(site: Site, designs: list[Design]) -> PlacementPlan:
    plan, model = site.plan, AccuracyModel(site.plan)
    asked, fixed = plan.placement, site.way[site.fixed, model.user]
    recommended = f"{asked.criterion}_{asked.over}"
    best = next(one for one in designs if one.name == recommended)
    rows = tuple(_row(site, model, one) for one in designs)
    return PlacementPlan(
        judged=plan.user.name,
        recommended=recommended,
        fixed_at_s=site.fixed * plan.step_s,
        fixed_north_m=float(fixed[0]),
        fixed_east_m=float(fixed[1]),
        fixed_height_m=float(fixed[2]),
        from_s=site.span[0] * plan.step_s,
        to_s=site.span[1] * plan.step_s,
        designs=rows,
        places=tuple(row for one in designs for row in _places(site, model, one)),
        moved=plan.points[site.placed[-1]].name,
        settings=_settings(plan),
        figures=_figures(site, model, designs, best),
    )


def _row(site: Site, model: AccuracyModel, one: Design) -> DesignRow:
    position = site.positions(one.places)
    geometry, sigma = _geometry(site, model, position), _two_sigma(model, position)
    at = site.fixed - 1  # of what begins with the second epoch
    north, east, up = sigma[site.fixed].tolist()
    worst = sigma[site.span[0] : site.span[1] + 1].max(axis=0).tolist()
    lost, without = _worst_loss(site, position)
    best, most = min(one.losses, default=1.0), max(one.losses, default=1.0)
    return DesignRow(
        design=one.name,
        determinant=float(geometry.determinant[at]),
        eigenvalue=float(geometry.least_eigenvalue[at]),
        dop=float(geometry.dilution()[at]),
        two_sigma_north_m=north,
        two_sigma_east_m=east,
        two_sigma_up_m=up,
        worst_two_sigma_north_m=worst[0],
        worst_two_sigma_east_m=worst[1],
        worst_two_sigma_up_m=worst[2],
        lost=lost,
        lost_two_sigma_north_m=without[0],
        lost_two_sigma_east_m=without[1],
        lost_two_sigma_up_m=without[2],
        gap=one.gap,
        has_converged=one.has_converged,
        iterations=one.iterations,
        evaluations=one.evaluations,
        starts=len(one.losses),
        start_spread=abs(most / best - 1.0) if best and np.isfinite(most) else 0.0,
    )


def _worst_loss(site: Site, position_m: FloatArray) -> tuple[str, tuple[float | None, ...]]:
    """Return the ground point whose loss costs most at the fixed point.

    With it come twice the sigmas without this point.
    """
    if len(site.plan.points) < 2:
        return "", (None, None, None)
    weights = site.plan.placement
    found = []
    for number, point in enumerate(site.plan.points):
        model, left = site.without(number)
        sigma = _two_sigma(model, position_m[: site.fixed + 1, left])[-1]
        cost = float(sigma**2 @ [weights.weight_north, weights.weight_east, weights.weight_up])
        found.append((cost, point.name, tuple(sigma.tolist())))
    _, name, sigmas = max(found)
    return name, sigmas


def _places(site: Site, model: AccuracyModel, one: Design) -> list[PlaceRow]:
    position, count = site.positions(one.places)[0], len(site.plan.aircraft)
    rows = []
    for number, point in enumerate(site.plan.points):
        where = position[count + number]
        away = site.regions[0].distance_m(where[:2])
        way = site.way[:, model.user]
        across, below = _under(way, where)
        rows.append(
            PlaceRow(
                design=one.name,
                point=point.name,
                north_m=float(where[0]),
                east_m=float(where[1]),
                height_m=float(where[2]),
                is_placed=point.is_placed or bool(point.mirrors),
                keep_out_distance_m=away if np.isfinite(away) else None,
                below_way_m=below if across <= NEAR_WAY_M else None,
            )
        )
    return rows


def _under(way_m: FloatArray, place_m: FloatArray) -> tuple[float, float]:
    """Return a place's least horizontal distance from a way, and its depth below it there."""
    begin, move = way_m[:-1], np.diff(way_m, axis=0)
    length = np.maximum((move[:, :2] ** 2).sum(axis=1), 1e-12)
    share = np.clip(((place_m[:2] - begin[:, :2]) * move[:, :2]).sum(axis=1) / length, 0.0, 1.0)
    nearest = begin + share[:, None] * move
    beside = np.linalg.norm(nearest[:, :2] - place_m[:2], axis=1)
    step = int(np.argmin(beside))
    return float(beside[step]), float(nearest[step, 2] - place_m[2])


def _settings(plan: SessionPlan) -> dict[str, float | str | bool]:
    flat: dict[str, float | str | bool] = {"step_s": plan.step_s}
    for name, part in (("ranging", plan.ranging), ("placement", plan.placement), ("errors", plan.user.errors)):
        for key, value in asdict(part).items():
            if key == "keep_out":
                flat[f"{name}_{key}"] = ", ".join(one["name"] for one in value) or "nothing"
            else:
                flat[f"{name}_{key}"] = ", ".join(value) if isinstance(value, tuple) else value
    return flat


def _figures(site: Site, model: AccuracyModel, designs: list[Design], best: Design) -> tuple[FigureData, ...]:
    plan, count = site.plan, len(site.plan.aircraft)
    positions = [site.positions(one.places) for one in designs]
    names = [one.name for one in designs]
    stand = np.concatenate([position[0, count:] for position in positions])
    points = PlacementPoints(
        design=np.repeat(names, len(plan.points)),
        label=np.tile([point.name for point in plan.points], len(designs)),
        north_m=stand[:, 0],
        east_m=stand[:, 1],
        up_m=stand[:, 2],
        is_placed=np.tile([point.is_placed or bool(point.mirrors) for point in plan.points], len(designs)),
    )
    epochs = plan.steps + 1
    sigma = np.concatenate([_two_sigma(model, position) for position in positions])
    dop = np.concatenate([np.append(np.nan, _geometry(site, model, position).dilution()) for position in positions])
    way = np.tile(site.way[:, model.user], (len(designs), 1))
    accuracy = PlacementAccuracy(
        time_s=np.tile(plan.step_s * np.arange(epochs), len(designs)),
        design=np.repeat(names, epochs),
        north_m=way[:, 0],
        east_m=way[:, 1],
        up_m=way[:, 2],
        dop=dop,
        two_sigma_north_m=sigma[:, 0],
        two_sigma_east_m=sigma[:, 1],
        two_sigma_up_m=sigma[:, 2],
    )
    rings = [(one.name, *corner) for one in plan.placement.keep_out for corner in (*one.corners_m, one.corners_m[0])]
    found: list[FigureData] = [points, accuracy, _map(site, model, best)]
    if rings:
        name, north, east = (np.array(column) for column in zip(*rings, strict=True))
        found.append(PlacementKeepOut(label=name, north_m=north, east_m=east))
    return tuple(found)


def _map(site: Site, model: AccuracyModel, best: Design) -> PlacementMap:
    """Map weighted sigma and determinant at the fixed point over places of the last point.

    The other points stay where they are. A rectangle without height or width has one row or column of places.
    """
    region, side = site.regions[-1], site.plan.placement.map_side
    ends = zip(region.low_m.tolist(), region.high_m.tolist(), strict=True)
    north, east = (np.linspace(low, high, side if high > low else 1) for low, high in ends)
    grid = np.array([(one, other) for one in north for other in east])
    allowed = region.allows(grid)
    sigma, determinant = np.full(len(grid), np.nan), np.full(len(grid), np.nan)
    fixed = (site.fixed, site.fixed)
    variance, geometry = (PlaceLoss(site, one, fixed) for one in ("covariance", "determinant"))
    for place_number in np.flatnonzero(allowed):
        places = best.places.copy()
        places[-1] = grid[place_number]
        if model.links(site.positions(places)).range_m.min() >= NEAREST_M:
            sigma[place_number] = np.sqrt(variance.largest(places))
            determinant[place_number] = -geometry.largest(places)
    return PlacementMap(north_m=grid[:, 0], east_m=grid[:, 1], sigma_m=sigma, determinant=determinant)


def _findings(site: Site, designs: list[Design], answer: PlacementPlan) -> tuple[Finding, ...]:
    row, asked = answer.design(answer.recommended), site.plan.placement
    best = next(one for one in designs if one.name == answer.recommended)
    found = points_at_starts(site.plan, site.positions(best.places)[0])
    given = np.array([[site.plan.points[one].north_m, site.plan.points[one].east_m] for one in site.placed])
    for number, moved in zip(site.placed, np.linalg.norm(site.given - given, axis=1).tolist(), strict=True):
        if moved > ON_EDGE_M:
            text = f"{site.plan.points[number].name} cannot be placed where it is given: moved by {moved:.0f} m"
            found.append(Finding("warn", "placement.given_kept_out", text))
    if not row.has_converged:
        text = f"the placement has not converged: a first-order gain of {row.gap:.2g} of its loss is left"
        found.append(Finding("warn", "placement.not_converged", text))
    elif row.start_spread > SPREAD:
        text = f"starts end in different places: the best of {row.starts} is taken"
        found.append(Finding("info", "placement.several_minima", text))
    found += _on_places(site, best, answer)
    if not np.isfinite(row.dop):
        text = f"the points do not separate {' and '.join(asked.axes)} at the fixed point"
        found.append(Finding("warn", "placement.singular", text))
    elif row.dop > POOR_DOP:
        text = f"dilution of precision {row.dop:.0f} at the fixed point: the points are nearly on one line"
        found.append(Finding("warn", "placement.poor_geometry", text))
    return tuple(found)


def _on_places(site: Site, best: Design, answer: PlacementPlan) -> list[Finding]:
    """Points at the edge of the rectangle, and points under the way."""
    found = []
    for number, region, where in zip(site.placed, site.regions, best.places, strict=True):
        is_wide = region.high_m - region.low_m > 2.0 * ON_EDGE_M  # a side without length has no inside
        at_edge = np.minimum(where - region.low_m, region.high_m - where) <= ON_EDGE_M
        if (at_edge & is_wide).any():
            text = f"{site.plan.points[number].name} is at the edge of the rectangle: the best place may lie outside"
            found.append(Finding("warn", "placement.at_edge", text))
    for row in answer.places_of(answer.recommended):
        if row.below_way_m is not None and row.is_placed and row.below_way_m < site.plan.placement.overflown_m:
            text = f"{row.point} is under the path, {row.below_way_m:.0f} m below it: an obstacle, and hard to hear"
            found.append(Finding("warn", "placement.under_way", text))
    return found
