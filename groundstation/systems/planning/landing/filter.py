"""Filter of the approach on simulated or recorded ranges, and its covariance without any."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.methods.kalman.transition import Transition
from groundstation.results.landing_categories import axis_95_m, radius_95_m
from groundstation.systems.planning.landing.model import CLOCK, PLACE, ErrorModel, error_model
from groundstation.systems.planning.landing.moving_point import fly_moving_point
from groundstation.systems.planning.landing.scenario import RangeApproach

OUTPUT_STEP_S = 0.25
FIRST_PASS, GROWTH = 10, 1.5  # epochs of the first pass; each later one goes so many times as far,
LONGEST_S = 1.0  # and no further than this
MIRRORED_SIGMA = 3.0  # below ground by more: the mirror image of the aircraft was found


@dataclass(frozen=True)
class ApproachReadings:
    """Inputs of the filter at each of n epochs.

    Parameters
    ----------
    place_m : ndarray, shape (n, 3)
        Place by INS and barometer: along, right, up.
    points_m : ndarray, shape (n, k, 3)
        Places of the points, the moving one's as it reports it, last.
    range_m : ndarray, shape (n, k)
        Pseudo-ranges; NaN where there is none.
    """

    place_m: FloatArray
    points_m: FloatArray
    range_m: FloatArray

    def __post_init__(self) -> None:
        for name in ("place_m", "points_m", "range_m"):
            object.__setattr__(self, name, frozen(np.ascontiguousarray(getattr(self, name))))


@dataclass(frozen=True)
class ApproachTrack:
    """Output of the filter along the path.

    Parameters
    ----------
    time_s : ndarray, shape (m,)
    true_m : ndarray, shape (m, 3)
        The nominal place.
    correction_m : ndarray, shape (m, 3)
        Estimated errors of the place by INS and barometer.
    covariance_m2 : ndarray, shape (m, 3, 3)
    innovation : ndarray, shape (n, k)
        Over its sigma, of every measurement.
    """

    time_s: FloatArray
    true_m: FloatArray
    correction_m: FloatArray
    covariance_m2: FloatArray
    innovation: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "true_m", "correction_m", "covariance_m2", "innovation"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def sigma_m(self) -> FloatArray:
        """One sigma along, right and up, shape (m, 3)."""
        return np.sqrt(np.diagonal(self.covariance_m2, axis1=1, axis2=2))

    @property
    def horizontal_95_m(self) -> FloatArray:
        """Radius that holds 95 %, shape (m,)."""
        return radius_95_m(self.covariance_m2[:, :2, :2])

    @property
    def lateral_95_m(self) -> FloatArray:
        """Half width to the right and left that holds 95 %, shape (m,)."""
        return axis_95_m(self.sigma_m[:, 1])

    @property
    def vertical_95_m(self) -> FloatArray:
        """Half height that holds 95 %, shape (m,)."""
        return axis_95_m(self.sigma_m[:, 2])


def nominal_readings(scenario: RangeApproach) -> ApproachReadings:
    """Readings without any error: the filter then gives the covariance along the true path."""
    place = scenario.places_m
    points = np.broadcast_to(scenario.point_places_m, (len(place), len(scenario.points), 3))
    track = fly_moving_point(scenario)
    if track is not None:
        points = np.concatenate([points, track.place_m[:, None, :]], axis=1)
    return ApproachReadings(place, points, np.linalg.norm(place[:, None, :] - points, axis=-1))


def with_errors(
    nominal: ApproachReadings, model: ErrorModel, errors: FloatArray, white_m: FloatArray
) -> ApproachReadings:
    """Add errors of a model, shape (n, states), and white range errors (n, k) to readings."""
    points = nominal.points_m.copy()
    slow = 0.0 if model.slow < 0 else errors[:, model.slow : model.slow + points.shape[1]]
    if model.moving >= 0:
        points[:, -1] += errors[:, model.moving : model.moving + 3]
    ranges = nominal.range_m + errors[:, CLOCK, None] + slow + white_m
    return ApproachReadings(nominal.place_m + errors[:, PLACE], points, ranges)


def covariance_along(scenario: RangeApproach, *, models_correlation: bool = True) -> ApproachTrack:
    """Covariance of the filter along the true path, linearised about it."""
    model = error_model(scenario, has_slow_errors=models_correlation)
    run = _Run(scenario, model, nominal_readings(scenario))
    run.to(len(scenario.time_s), np.zeros_like(scenario.places_m), np.zeros((3, 3)), is_curved=False)
    return run.track()


def filter_ranges(
    scenario: RangeApproach, readings: ApproachReadings, *, models_correlation: bool = True
) -> ApproachTrack:
    """Filter the ranges of an approach.

    Height and clock are hardly told apart by few points far away, so the first estimates are wrong by hundreds of
    metres and a range is curved over that. So the filter goes back every second (more often at first): it starts
    again and linearises all earlier ranges about what it knows now. At any time it has used no later measurement.

    Parameters
    ----------
    scenario : RangeApproach
        Gives path, errors and noise that the filter believes.
    readings : ApproachReadings
    models_correlation : bool
        Whether the slow part of the ranges' errors is among the states; without, it is taken for white noise.
    """
    model = error_model(scenario, has_slow_errors=models_correlation)
    run, count, done = _Run(scenario, model, readings), len(scenario.time_s), 0
    most = max(1, round(LONGEST_S / scenario.noise.interval_s))
    while done < count:
        until = min(max(FIRST_PASS, int(np.ceil(GROWTH * done))), done + most, count)
        reference = np.full((count, 3), np.nan)
        if done:
            reference[:done] = run.back_from(done)
        run.to(until, reference, run.P[np.ix_(PLACE, PLACE)])
        done = until
    return run.track()


class _Run:
    """Passes of the compiled filter over one approach.

    A later pass overwrites innovations and heights where it goes again; places stay those of the first pass.
    """

    def __init__(self, scenario: RangeApproach, model: ErrorModel, readings: ApproachReadings) -> None:
        self.scenario, self.model, self.readings = scenario, model, readings
        unmodelled_m = scenario.noise.correlated_m if model.slow < 0 else 0.0
        self.variance_m2 = scenario.noise.white_m**2 + unmodelled_m**2
        rows, cols = np.nonzero(model.F)
        q_rows, q_cols = np.nonzero(np.triu(model.Q))
        self.transition = Transition.sparse(
            model.size, rows, cols, model.F[rows, cols][None], q_rows, q_cols, model.Q[q_rows, q_cols][None]
        )
        self.every = max(1, round(OUTPUT_STEP_S / scenario.noise.interval_s))
        self.kept = np.arange(0, len(scenario.time_s), self.every)
        self.x, self.P = np.zeros((1, model.size)), np.array(model.P0)
        self.place_x, self.place_p = np.empty((len(self.kept), 3)), np.empty((len(self.kept), 3, 3))
        self.innovation = np.empty(readings.range_m.shape)
        self.height = np.empty((len(scenario.time_s), 2))
        self.outputs = 0

    def to(self, until: int, reference_m: FloatArray, reference_p: FloatArray, *, is_curved: bool = True) -> None:
        """Filter from the start to an epoch (not included).

        Only the places beyond the end of the last pass are kept; earlier ones stay.
        """
        from groundstation.systems.planning.landing.loop import filter_approach

        model, dynamics = self.model, self.transition.dynamics
        moving = (np.arange(3) + model.moving) if model.moving >= 0 else np.zeros(3, dtype=np.int64)
        has_place = np.zeros(self.readings.range_m.shape[1], dtype=np.int64)
        has_place[-1] = model.moving >= 0
        self.x[:], self.P[:] = 0.0, model.P0
        outputs = -(-until // self.every)
        place_x, place_p = np.empty((outputs, 3)), np.empty((outputs, 3, 3))
        filter_approach(
            self.transition.states,
            dynamics.pattern,
            dynamics.F,
            dynamics.noise_rows,
            dynamics.noise_columns,
            dynamics.after,
            np.array([*PLACE, CLOCK, *moving, 0], dtype=np.int64),
            frozen(has_place),
            model.slow,
            self.readings.place_m[:until],
            frozen(reference_m[:until]),
            reference_p,
            is_curved,
            self.readings.points_m[:until],
            self.readings.range_m[:until],
            self.variance_m2,
            self.x,
            self.P,
            self.every,
            place_x,
            place_p,
            self.innovation[:until],
            self.height[:until],
        )
        new = slice(self.outputs, outputs)
        self.place_x[new], self.place_p[new], self.outputs = place_x[new], place_p[new], outputs

    def back_from(self, epoch: int) -> FloatArray:
        """Errors of the place at all earlier epochs as they look from this one, shape (epoch, 3).

        Along and right: by the velocity. Height: smoothed, for the barometer wanders.
        """
        from groundstation.systems.planning.landing.loop import smooth_walk

        x, own = self.x[0], self.scenario.own
        back_s = self.scenario.noise.interval_s * np.arange(epoch - 1, -1, -1.0)
        moved_s = own.velocity_s * np.expm1(back_s / own.velocity_s)
        smooth_walk(self.height[:epoch], float(self.model.Q[PLACE[2], PLACE[2]]))
        up_m = self.height[:epoch, 0].copy()
        above_m = self.readings.place_m[:epoch, 2] - up_m
        mirrored = above_m < -MIRRORED_SIGMA * np.sqrt(self.P[PLACE[2], PLACE[2]])
        up_m[mirrored] += 2.0 * above_m[mirrored]  # aircraft stay above ground: ranges do not tell it from below
        return np.column_stack([x[0] - x[2] * moved_s, x[1] - x[3] * moved_s, up_m])

    def track(self) -> ApproachTrack:
        """Return the results of the passes."""
        return ApproachTrack(
            self.scenario.time_s[self.kept],
            self.scenario.places_m[self.kept],
            self.place_x,
            self.place_p,
            self.innovation,
        )
