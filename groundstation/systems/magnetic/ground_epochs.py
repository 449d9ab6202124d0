"""Epochs of a flight on the ground with their magnetic heading, and the declination there."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.methods.taxi.delay import known_delay
from groundstation.methods.taxi.gating import gate_samples
from groundstation.methods.taxi.samples import USED, HeadingValues, OnGround, TaxiSamples, pair_samples
from groundstation.methods.taxi.settings import GroundLimits
from groundstation.results.chosen import Interval
from groundstation.results.roles import Delays
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.answer import DeclinationUsed
from groundstation.systems.magnetic.ground_answer import LeftOut
from groundstation.systems.magnetic.ground_settings import MagneticGroundSettings
from groundstation.systems.magnetic.readings import NO_DATE, PLACE_WANTED
from groundstation.tables.epochs import distinct_epochs
from groundstation.tables.headings import FARTHEST_POSITION_S
from groundstation.tables.phases import ground_mask
from groundstation.tables.resample import join
from groundstation.tables.sources import GNSS_VELOCITY, Need, PairNeed
from groundstation.tables.table import Flight, Table

ANALYSIS = "magnetic_ground"
PAIR = PairNeed(ANALYSIS, Need("ins", "magnetic heading", ("magnetic_heading_deg",)), GNSS_VELOCITY)
STEPS_DEG, OFF_STEP_DEG, LEAST_VALUES = (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01), 1e-4, 20
VARIATION_GAP_S = 5.0
SETTLING, NOT_GROUND = "after a turn", "not proven ground"
WHY_LEFT_OUT = {
    "too slow": "slow",
    "too fast": "faster than speed_max_mps",
    "turning": "curved",
    SETTLING: "just after a turn",
    "airborne": "airborne, or ground contact not proven",
    NOT_GROUND: "airborne, or ground contact not proven",
    "no heading": "no magnetic heading there",
    "geometry": "GNSS geometry too poor",
    "integrity": "GNSS integrity bad",
}


@dataclass(frozen=True)
class GroundEpochs:
    """Epochs of the straight runs with what was looked at, shapes (n,); ``run`` counts from 0."""

    samples: TaxiSamples
    declination_deg: FloatArray
    run: NDArray[np.int64]

    @property
    def error_deg(self) -> FloatArray:
        """Magnetic heading + declination - track, in [-180, 180)."""
        return wrap_180(self.samples.difference_deg + self.declination_deg)


def gated(
    flight: Flight,
    topics: tuple[str, str],
    settings: MagneticGroundSettings,
    on_ground: OnGround | None,
    aircraft: AircraftData,
    latencies: Delays | None,
    excluded_s: Sequence[tuple[float, float]],
) -> TaxiSamples:
    """Return the epochs on the ground, gated as the heading analysis gates taxi.

    The magnetic heading stands in the place of the true one.
    """
    limits = GroundLimits(
        taxi_speed_min_mps=settings.speed_min_mps,
        taxi_speed_max_mps=settings.speed_max_mps,
        turn_rate_max_dps=settings.turn_rate_max_dps,
        turn_rate_window_s=settings.turn_rate_window_s,
        segment_turn_deg=settings.heading_change_max_deg,
    )
    delay = known_delay(topics, latencies, aircraft.gnss_latency_s, aircraft.gnss_latency_sigma_s)
    try:
        samples = pair_samples(
            *(flight, *topics),
            settings=limits,
            on_ground=on_ground or (lambda time_ns: ground_mask(flight, time_ns)),
            heading=lambda topic: HeadingValues(flight[topic].values("magnetic_heading_deg"), "magnetic heading"),
            with_later_runs=True,
            gnss_latency_s=delay.latency_s if delay else 0.0,
        )
    except NotAssessableError as error:
        raise NotAssessableError(ANALYSIS, error.found, error.expected, error.next_step) from error
    intervals = tuple(Interval(start_s, end_s) for start_s, end_s in excluded_s)
    return _settled(gate_samples(samples, limits, intervals), settings)


def _settled(samples: TaxiSamples, settings: MagneticGroundSettings) -> TaxiSamples:
    """Leave out the samples just after a turn at any speed.

    A heading that lags has not caught up yet.
    """
    with np.errstate(invalid="ignore"):
        turning = np.flatnonzero(np.abs(samples.rate_dps) > settings.turn_rate_max_dps)
    last = np.searchsorted(turning, np.arange(len(samples)), side="right") - 1
    since = np.full(len(samples), np.inf)
    after = last >= 0
    since[after] = samples.time_s[after] - samples.time_s[turning[last[after]]]
    unsettled = samples.is_used & (since < settings.settle_s)
    gate = samples.gate.copy()
    gate[unsettled] = SETTLING
    return replace(samples, gate=gate, segment=np.where(gate == USED, samples.segment, 0))


def count_left_out(flight: Flight, topics: tuple[str, str], samples: TaxiSamples) -> tuple[LeftOut, ...]:
    """Count the GNSS epochs that belong to no run, by reason, most first."""
    counts = Counter(WHY_LEFT_OUT.get(str(gate), str(gate)) for gate in samples.gate[~samples.is_used])
    counts[WHY_LEFT_OUT[NOT_GROUND]] += len(distinct_epochs(flight[topics[1]])) - len(samples)
    return tuple(LeftOut(reason, count) for reason, count in counts.most_common() if count)


def declination_at(
    flight: Flight,
    topics: tuple[str, str],
    samples: TaxiSamples,
    chosen: NDArray[np.intp],
    settings: MagneticGroundSettings,
) -> tuple[FloatArray, DeclinationUsed]:
    """Declination at the chosen epochs, shape (n,), and its mean with its sigma."""
    if settings.declination_deg is not None:
        stated = DeclinationUsed(settings.declination_deg, settings.declination_sigma_deg, "as stated")
        return np.full(len(chosen), settings.declination_deg), stated
    if not flight.has_utc:
        raise NotAssessableError(ANALYSIS, *NO_DATE)
    latitude, longitude = _positions(flight, topics, samples.time_ns[chosen])
    if not np.isfinite(latitude).any():
        raise NotAssessableError(ANALYSIS, "no position on the ground", PLACE_WANTED)
    try:
        model = declination_along(latitude, longitude, np.zeros(len(chosen)), int(flight.start_ns))
    except NotAssessableError as error:
        raise NotAssessableError(ANALYSIS, error.found, error.expected, "state declination_deg") from error
    mean = float(wrap_180(mean_heading(wrap_360(model.values_deg))))
    values = np.where(np.isfinite(model.values_deg), model.values_deg, mean)
    strengths = [float(np.nanmean(part)) for part in (model.horizontal_nt, model.down_nt)]
    return values, DeclinationUsed(mean, float(np.nanmean(model.sigma_deg)), model.model, *strengths)


def _positions(flight: Flight, topics: tuple[str, str], at_ns: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    names = ("latitude_deg", "longitude_deg")
    others = [topic for kind in ("gnss", "ins") for topic in topics_of_kind(kind, flight.topics())]
    for topic in (topics[1], *others):
        if flight[topic].has(*names):
            joined = join(flight[topic], at_ns, names, largest_gap_s=FARTHEST_POSITION_S)
            latitude, longitude = joined.values(names[0]), joined.values(names[1])
            return np.where(np.abs(latitude) <= 90.0, latitude, np.nan), longitude
    return np.full(len(at_ns), np.nan), np.full(len(at_ns), np.nan)


def step_of(table: Table, name: str) -> float | None:
    """Return the step an angle is logged in; None: none.

    The step is the largest of those that angles are rounded to that holds every value.
    """
    values = table.values(name)
    known = np.unique(values[np.isfinite(values)])
    if len(known) < LEAST_VALUES:
        return None
    return next(
        (step for step in STEPS_DEG if np.all(np.abs(known - step * np.round(known / step)) < OFF_STEP_DEG)), None
    )


def logged_variation_deg(flight: Flight, ins_topic: str, at_ns: Int64Array) -> float | None:
    """Return the mean of true minus magnetic heading that the log's variation makes.

    The mean is known where the reader made the one from the other with that variation.
    """
    names = ("true_heading_deg", "magnetic_heading_deg")
    derived = flight.metadata.get(f"derived.{ins_topic}.true_heading_deg", "")
    if "magnetic" not in derived or not flight[ins_topic].has(*names):
        return None
    joined = join(flight[ins_topic], at_ns, names, largest_gap_s=VARIATION_GAP_S)
    variation = mean_heading(wrap_360(joined.values(names[0]) - joined.values(names[1])))
    return float(wrap_180(variation)) if np.isfinite(variation) else None
