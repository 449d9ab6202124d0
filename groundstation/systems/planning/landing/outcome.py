"""Answer of landing by ranges: tables, stretches that meet a category, figures' arrays."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.results.arrays.typed import joined
from groundstation.results.landing_categories import (
    ACCURACY_ONLY,
    CATEGORIES,
    axis_category_met,
    category_met,
)
from groundstation.systems.planning.landing.answer import (
    ALL_AXES,
    HONEST,
    TOUCHDOWN,
    WHITE,
    AccuracyRow,
    CategorySpan,
    RangeLanding,
    ReferencePointRow,
    TrialRow,
)
from groundstation.systems.planning.landing.arrays import RangesErrors, RangesPath, RangesSpace
from groundstation.systems.planning.landing.filter import ApproachTrack, covariance_along
from groundstation.systems.planning.landing.moving_point import MovingTrack, fly_moving_point, measure
from groundstation.systems.planning.landing.scenario import RangeApproach
from groundstation.systems.planning.landing.trials import Trials, fly_trials

DECISION_HEIGHTS_M = (("200 ft", 60.96), ("100 ft", 30.48))
TRIAL_PLACES_M = (3500.0, 2000.0, 1000.0, 500.0, 0.0)  # before the threshold; touchdown besides


def range_landing(scenario: RangeApproach) -> RangeLanding:
    """Return the accuracy along an approach by ranges, and the filter's consistency.

    The consistency is that over simulated approaches. Where ranges are correlated a filter that takes them for white
    flies the same approaches as well.
    """
    track, moving = covariance_along(scenario), fly_moving_point(scenario)
    filters = (HONEST, WHITE) if scenario.noise.correlated_m > 0.0 else (HONEST,)
    flown = [(name, fly_trials(scenario, models_correlation=name == HONEST)) for name in filters if scenario.trials]
    rows = _rows(scenario, track)
    trial_rows = tuple(row for name, one in flown for row in _trial_rows(name, one))
    least = track.sigma_m.min(axis=0)
    return RangeLanding(
        title=scenario.title,
        points=_points(scenario),
        rows=rows,
        spans=category_spans(track),
        least_along_m=float(least[0]),
        least_right_m=float(least[1]),
        least_up_m=float(least[2]),
        trials=trial_rows,
        trial_count=scenario.trials,
        remarks=(ACCURACY_ONLY, *_remarks(trial_rows)),
        settings=_flat(scenario),
        figures=(_path_figure(scenario, track, moving), _space_figure(scenario, track, moving), *_errors(flown)),
    )


def _points(scenario: RangeApproach) -> tuple[ReferencePointRow, ...]:
    rows = [
        ReferencePointRow(one.name, False, one.before_threshold_m, one.right_m, one.up_m) for one in scenario.points
    ]
    if scenario.moving is not None:
        start_m = scenario.path.start_m + scenario.moving.behind_m
        rows.append(ReferencePointRow("moving", True, start_m, 0.0, scenario.moving.height_m))
    return tuple(rows)


def _rows(scenario: RangeApproach, track: ApproachTrack) -> tuple[AccuracyRow, ...]:
    """Start, both decision heights as far as the path crosses them, threshold, touchdown."""
    path = scenario.path
    slope = float(np.tan(np.deg2rad(path.glide_angle_deg)))
    wanted = [("start", path.start_m)]
    wanted += [(name, height / slope - path.touchdown_m) for name, height in DECISION_HEIGHTS_M]
    wanted += [("threshold", 0.0), (TOUCHDOWN, -path.touchdown_m)]
    return tuple(_row(name, track, before_m) for name, before_m in wanted if before_m <= path.start_m)


def _row(place: str, track: ApproachTrack, before_m: float) -> AccuracyRow:
    k = int(np.argmin(np.abs(track.true_m[:, 0] + before_m)))
    along, right, up = (float(value) for value in track.sigma_m[k])
    lateral, horizontal, vertical = (
        float(part[k]) for part in (track.lateral_95_m, track.horizontal_95_m, track.vertical_95_m)
    )
    met = category_met(horizontal, vertical), axis_category_met(lateral, "horizontal")
    names = [one.name if one else "" for one in (*met, axis_category_met(vertical, "vertical"))]
    here_m, height_m = -float(track.true_m[k, 0]), float(track.true_m[k, 2])
    return AccuracyRow(place, here_m, height_m, along, right, up, lateral, horizontal, vertical, *names)


def category_spans(track: ApproachTrack) -> tuple[CategorySpan, ...]:
    """Stretches of the path on which each category is met: both figures, and each axis alone."""
    spans = []
    for category in CATEGORIES:
        is_vertical = track.vertical_95_m <= category.vertical_m
        is_met = {
            ALL_AXES: is_vertical & (track.horizontal_95_m <= category.horizontal_m),
            "lateral": track.lateral_95_m <= category.horizontal_m,
            "vertical": is_vertical,
        }
        for axis, met in is_met.items():
            ends = _stretches(met, -track.true_m[:, 0])
            spans += [CategorySpan(category.name, axis, first, last) for first, last in ends]
    return tuple(spans)


def _stretches(met: BoolArray, before_m: FloatArray) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], met, [False]]).astype(np.int8)))
    return [(float(before_m[first]), float(before_m[last - 1])) for first, last in edges.reshape(-1, 2)]


def _trial_rows(name: str, trials: Trials) -> list[TrialRow]:
    low, high = trials.limits
    rows = []
    for before_m in (*TRIAL_PLACES_M, -np.inf):
        if before_m > trials.before_threshold_m[0]:
            continue
        k = int(np.argmin(np.abs(trials.before_threshold_m - max(before_m, trials.before_threshold_m[-1]))))
        along, right, up = (float(value) for value in np.sqrt(np.mean(trials.error_m[:, k] ** 2, axis=0)))
        nees, over = float(trials.nees[:, k].mean()), trials.overconfidence[k]
        rows.append(
            TrialRow(
                filter=name,
                before_threshold_m=float(trials.before_threshold_m[k]),
                nees=nees,
                nees_low=low,
                nees_high=high,
                rms_along_m=along,
                rms_right_m=right,
                rms_up_m=up,
                overconfidence_right=float(over[1]),
                overconfidence_up=float(over[2]),
                is_consistent=bool(low <= nees <= high),
            )
        )
    return rows


def _remarks(rows: Sequence[TrialRow]) -> list[str]:
    """Return what the trials say against the filter."""
    remarks = []
    wrong = [row for row in rows if row.filter == HONEST and row.nees > row.nees_high]
    if wrong:
        places = ", ".join(f"{row.before_threshold_m:.0f} m" for row in wrong)
        remarks.append(
            f"The filter is overconfident at {places} before the threshold: heights far from any point are badly "
            "known and ranges are curved over their uncertainty."
        )
    white = [row for row in rows if row.filter == WHITE]
    if white:
        last = white[-1]
        remarks.append(
            f"A filter that treats the correlated range errors as white noise errs at touchdown by "
            f"{last.overconfidence_right:.1f} times its lateral and {last.overconfidence_up:.1f} times its vertical "
            "sigma."
        )
    return remarks


def _flat(scenario: RangeApproach) -> dict[str, float | str | bool]:
    tables = {name: table for name, table in asdict(scenario).items() if isinstance(table, dict)}
    return {f"{table}.{name}": value for table, part in tables.items() for name, value in part.items()}


def _path_figure(scenario: RangeApproach, track: ApproachTrack, moving: MovingTrack | None) -> RangesPath:
    points = np.broadcast_to(scenario.point_places_m, (len(track.time_s), len(scenario.points), 3))
    if moving is not None:
        kept = np.searchsorted(scenario.time_s, track.time_s - 1e-9)
        points = np.concatenate([points, moving.place_m[kept][:, None, :]], axis=1)
    return RangesPath(
        time_s=track.time_s,
        before_threshold_m=-track.true_m[:, 0],
        height_m=track.true_m[:, 2],
        sigma_along_m=track.sigma_m[:, 0],
        sigma_right_m=track.sigma_m[:, 1],
        sigma_up_m=track.sigma_m[:, 2],
        lateral_95_m=track.lateral_95_m,
        horizontal_95_m=track.horizontal_95_m,
        vertical_95_m=track.vertical_95_m,
        determinant=measure(track.true_m, points),
    )


def _space_figure(scenario: RangeApproach, track: ApproachTrack, moving: MovingTrack | None) -> RangesSpace:
    """Return the places of the aircraft, the ground points (once) and the moving point."""
    n = len(track.time_s)
    parts = [("aircraft", track.time_s, track.true_m, np.full(n, scenario.path.speed_mps))]
    if moving is not None:
        kept = np.searchsorted(scenario.time_s, track.time_s - 1e-9)
        parts.append(("moving", track.time_s, moving.place_m[kept], moving.speed_mps[kept]))
    for point, place in zip(scenario.points, scenario.point_places_m, strict=True):
        parts.append((point.name, np.zeros(1), place[None], np.zeros(1)))
    place_m = np.concatenate([part[2] for part in parts])
    return RangesSpace(
        time_s=np.concatenate([part[1] for part in parts]),
        label=np.concatenate([np.full(len(part[1]), part[0]) for part in parts]),
        along_m=place_m[:, 0],
        right_m=place_m[:, 1],
        up_m=place_m[:, 2],
        speed_mps=np.concatenate([part[3] for part in parts]),
    )


def _errors(flown: Sequence[tuple[str, Trials]]) -> tuple[RangesErrors, ...]:
    """Errors and computed sigmas of every trial."""
    if not flown:
        return ()
    parts = []
    for name, trials in flown:
        for number, (error, sigma) in enumerate(zip(trials.error_m, trials.sigma_m, strict=True), start=1):
            parts.append(
                RangesErrors(
                    time_s=trials.time_s,
                    filter=np.full(len(trials.time_s), name),
                    trial=np.full(len(trials.time_s), number),
                    before_threshold_m=trials.before_threshold_m,
                    error_along_m=error[:, 0],
                    sigma_along_m=sigma[:, 0],
                    error_right_m=error[:, 1],
                    sigma_right_m=sigma[:, 1],
                    error_up_m=error[:, 2],
                    sigma_up_m=sigma[:, 2],
                )
            )
    return (joined(parts),)
