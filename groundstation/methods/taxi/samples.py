"""Pairs of INS heading and GNSS velocity at the GNSS times of validity.

Each has the reason why it is used or not.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import direction_of, interpolate_heading, unwrap, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.methods.moving_lines import fitted_lines, window_bounds
from groundstation.methods.taxi.settings import TaxiLimits
from groundstation.results.gates import NO_CONTACT
from groundstation.tables.epochs import MOVING_MPS, distinct_epochs
from groundstation.tables.sources import GNSS_VELOCITY, Need, PairNeed
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]
TextArray = NDArray[np.str_]

USED = "used"
GATE_TEXT = "U20"
GEOMETRY_FIELDS = ("gdop", "pdop", "hdop")
GEOMETRY_NAMES = {"gdop": "GDOP", "pdop": "PDOP", "hdop": "HDOP"}
VELOCITY_SIGMA = "velocity sigma"
HEADING_AND_VELOCITY = PairNeed(  # needs of a straight taxi
    "heading",
    Need("ins", "INS heading", ("true_heading_deg",), or_else=("magnetic_heading_deg",), is_nose=True),
    GNSS_VELOCITY,
)


class GroundContact(Protocol):
    """Ground contact at given times, and the method that proves it.

    Where the method is empty or ``none...`` nothing proves it.
    """

    @property
    def mask(self) -> BoolArray: ...
    @property
    def method(self) -> str: ...


class HeadingOfRows(Protocol):
    """True heading of every row of an INS topic, degrees, NaN where unknown.

    The description says what it was made from. ``declination_sigma_deg`` is that of an error common to all rows; None
    for a heading logged as true.
    """

    @property
    def values_deg(self) -> FloatArray: ...
    @property
    def description(self) -> str: ...
    @property
    def declination_sigma_deg(self) -> float | None: ...


OnGround = Callable[[Int64Array], GroundContact]
HeadingOf = Callable[[str], HeadingOfRows]


@dataclass(frozen=True)
class Proof:
    """Ground contact as found by this module where the caller gives none."""

    mask: BoolArray
    method: str


@dataclass(frozen=True)
class HeadingValues:
    """True heading as logged."""

    values_deg: FloatArray
    description: str
    declination_sigma_deg: float | None = None


@dataclass(frozen=True)
class TaxiSamples:
    """Distinct GNSS epochs of the ground part of a flight, shapes (n,).

    Parameters
    ----------
    time_s : flight seconds of validity
    time_ns : corrected time
    heading_deg : INS true heading at those times, NaN where the log has none near
    north_mps, east_mps : velocity of the main-gear axle (of the antenna until an arm is taken out)
    rate_dps, arm_rate_dps : slope of the INS heading over the long (gate) and the short window (lever arm)
    difference_deg : INS heading minus track
    geometry, integrity : NaN where not logged; integrity 1 good, 0 bad. Where the velocity sigma stands in for a
        dilution of precision, ``geometry`` is 2 at the limit of that sigma
    on_ground : proven
    is_after_lift_off : the epoch is later than the first lift-off
    gate : why a sample is used or not
    segment : number of the straight segment, from 1; 0 for none
    """

    time_s: FloatArray
    time_ns: Int64Array
    heading_deg: FloatArray
    north_mps: FloatArray
    east_mps: FloatArray
    rate_dps: FloatArray
    arm_rate_dps: FloatArray
    geometry: FloatArray
    integrity: FloatArray
    on_ground: BoolArray
    is_after_lift_off: BoolArray
    gate: TextArray
    segment: NDArray[np.int64]
    geometry_name: str = ""
    ground_method: str = ""
    heading_source: str = ""
    heading_sigma_deg: float = 0.0

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def speed_mps(self) -> FloatArray:
        return np.hypot(self.north_mps, self.east_mps)

    @property
    def track_deg(self) -> FloatArray:
        return direction_of(self.north_mps, self.east_mps)

    @property
    def difference_deg(self) -> FloatArray:
        return wrap_180(self.heading_deg - self.track_deg)

    @property
    def is_used(self) -> BoolArray:
        return np.asarray(self.gate == USED)

    @property
    def interval_s(self) -> float:
        """Usual interval between epochs."""
        return float(np.median(np.diff(self.time_s))) if len(self) > 1 else 0.0


def logged_heading(flight: Flight, ins_topic: str) -> HeadingValues:
    """True heading as the INS wrote it."""
    table = flight[ins_topic]
    if not table.has("true_heading_deg"):
        raise NotAssessableError(f"heading, {ins_topic}", "no true heading in the log")
    return HeadingValues(table.values("true_heading_deg"), "true heading")


def logged_ground(flight: Flight, time_ns: Int64Array) -> Proof:
    """Return ground contact by logged weight on wheels: the last value before each time.

    Without it nothing is proven.
    """
    for topic in topics_of_kind("discrete", flight.topics()):
        table = flight[topic]
        known = table.valid("weight_on_wheels")
        if known.any():
            index = np.searchsorted(table.time_ns[known], time_ns, side="right") - 1
            wheels = table.values("weight_on_wheels")[known] > 0.5
            return Proof(wheels[np.maximum(index, 0)] & (index >= 0), "weight on wheels")
    return Proof(np.zeros(len(time_ns), dtype=bool), "")


def window_slope(at: FloatArray, time_s: FloatArray, values: FloatArray, window_s: float) -> FloatArray:
    """Return the least-squares slope of ``values`` over a window centred at each time.

    It is per second and has the shape of ``at``. A window with fewer than three samples is widened to the three nearest
    (raw data: ``window_s`` = 0). NaN where there are fewer than two samples.
    """
    if len(time_s) < 2:
        return np.full(len(at), np.nan)
    low, high = window_bounds(at, time_s, window_s)
    few = high - low < 3
    slope, _value = fitted_lines(at, time_s, values, np.maximum(low - few, 0), np.minimum(high + few, len(time_s)))
    return slope


def pair_samples(
    flight: Flight,
    ins_topic: str,
    gnss_topic: str,
    *,
    settings: TaxiLimits,
    on_ground: OnGround | None = None,
    heading: HeadingOf | None = None,
    with_later_runs: bool = False,
    gnss_latency_s: float = 0.0,
) -> TaxiSamples:
    """Pair each distinct GNSS epoch before lift-off with the INS heading at its time.

    The heading is interpolated. GNSS times are put back by ``gnss_latency_s``, by which GNSS is later than the INS.
    ``with_later_runs`` adds the epochs after lift-off at which ground contact is proven: landing roll and taxi in.

    The heading is interpolated along the shorter arc between INS samples no farther apart than
    ``heading_gap_max_s``; elsewhere it is NaN. The part before lift-off is from the first proven ground contact to
    where none is proven for more than 5 s at speed; where nothing is proven, to ``lift_off_speed_mps``. Ground that is
    proven after such a time alone is that of the landing.
    """
    gnss = distinct_epochs(flight[gnss_topic])
    gnss = replace(gnss, time_ns=gnss.time_ns - round(gnss_latency_s * NS_PER_S))
    given = heading(ins_topic) if heading else logged_heading(flight, ins_topic)
    ground: GroundContact = on_ground(gnss.time_ns) if on_ground else logged_ground(flight, gnss.time_ns)
    method = "" if ground.method.startswith("none") else ground.method
    if not len(gnss):
        raise NotAssessableError(f"heading, {gnss_topic}", "no GNSS velocity in the log")
    part, is_after = _ground_part(gnss, np.asarray(ground.mask), bool(method), settings, with_later_runs)
    if not part.size:
        if method:
            raise NotAssessableError("heading", f"{NO_CONTACT} before lift-off")
        raise NotAssessableError(f"heading, {gnss_topic}", _no_ground_reason(settings))
    gnss, mask = gnss.take(part), np.asarray(ground.mask)[part]
    time_s = flight.seconds(gnss.time_ns)
    ins_time, ins_heading = _ins_heading(flight, ins_topic, given.values_deg, time_s)
    geometry, geometry_name = _geometry(gnss, settings)
    raw = settings.turn_rate_kind == "raw"
    return TaxiSamples(
        time_s=time_s,
        time_ns=gnss.time_ns,
        heading_deg=_interpolated(time_s, ins_time, ins_heading, settings.heading_gap_max_s),
        north_mps=gnss.values("velocity_north_mps"),
        east_mps=gnss.values("velocity_east_mps"),
        rate_dps=window_slope(time_s, ins_time, ins_heading, 0.0 if raw else settings.turn_rate_window_s),
        arm_rate_dps=window_slope(time_s, ins_time, ins_heading, settings.arm_rate_window_s),
        geometry=geometry,
        integrity=gnss.values("integrity_ok"),
        on_ground=mask,
        is_after_lift_off=is_after,
        gate=np.full(len(gnss), "", dtype=GATE_TEXT),
        segment=np.zeros(len(gnss), dtype=np.int64),
        geometry_name=geometry_name,
        ground_method=method,
        heading_source=given.description,
        heading_sigma_deg=given.declination_sigma_deg or 0.0,
    )


def _geometry(gnss: Table, settings: TaxiLimits) -> tuple[FloatArray, str]:
    """Return the dilution of precision of each epoch, and its name.

    Where none is logged it is, in motion, the sigma that the receiver states. That sigma is the dilution of precision
    times the noise of the ranges' rates. At standstill the noise is measured.
    """
    field = next((name for name in GEOMETRY_FIELDS if gnss.has(name)), "")
    if field:
        return gnss.values(field), GEOMETRY_NAMES[field]
    if not gnss.has("velocity_sigma_mps"):
        return np.full(len(gnss), np.nan), ""
    speed = np.hypot(gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps"))
    scale = settings.geometry_max / settings.velocity_sigma_max_mps
    sigma_mps = np.where(speed > settings.taxi_speed_min_mps, gnss.values("velocity_sigma_mps"), np.nan)
    return sigma_mps * scale, VELOCITY_SIGMA


def _ground_part(
    gnss: Table, on_ground: BoolArray, is_proven: bool, settings: TaxiLimits, with_later_runs: bool
) -> tuple[NDArray[np.int64], BoolArray]:
    """Return the numbers of the epochs to pair, and a mask of those later than lift-off."""
    before = _before_lift_off(gnss, on_ground, is_proven, settings)
    index = np.arange(before.start, before.stop)
    later = np.arange(before.stop, len(gnss))
    if with_later_runs and is_proven:
        index = np.concatenate([index, later[on_ground[later]]])
    return index, index >= before.stop


def _before_lift_off(gnss: Table, on_ground: BoolArray, is_proven: bool, settings: TaxiLimits) -> slice:
    speed = np.hypot(gnss.values("velocity_north_mps"), gnss.values("velocity_east_mps"))
    fast = np.flatnonzero(speed > settings.lift_off_speed_mps)
    if not is_proven:
        return slice(0, int(fast[0]) if len(fast) else len(gnss))
    contact = np.flatnonzero(on_ground)
    if not contact.size:
        raise NotAssessableError("heading", NO_CONTACT)
    time_s = (gnss.time_ns - gnss.time_ns[0]) / NS_PER_S
    off = (~on_ground) & (speed > MOVING_MPS)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], off, [False]]).astype(np.int8)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        is_fast = float(speed[start:end].max()) > settings.taxi_speed_max_mps
        if is_fast and time_s[min(end, len(gnss) - 1)] - time_s[start] > 5.0:
            return slice(min(int(contact[0]), int(start)), int(start))
    return slice(int(contact[0]), len(gnss))


def _no_ground_reason(settings: TaxiLimits) -> str:
    return (
        "no GNSS epoch before lift-off: the log begins in the air (no ground contact is logged, and its first epoch is "
        f"faster than {settings.lift_off_speed_mps:g} m/s)"
    )


def _ins_heading(
    flight: Flight, ins_topic: str, heading_deg: FloatArray, time_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return times and continuous headings of the valid INS rows around the epochs.

    There is one row for each time.
    """
    table = flight[ins_topic]
    known = np.isfinite(heading_deg)
    if "valid" in table:
        known &= table.values("valid") != 0.0
    ins_time = flight.seconds(table.time_ns)
    known &= (ins_time > time_s[0] - 10.0) & (ins_time < time_s[-1] + 10.0)
    index = np.flatnonzero(known)
    index = index[np.concatenate([[True], np.diff(table.time_ns[index]) > 0])[: len(index)]]
    if len(index) < 2:
        raise NotAssessableError(f"heading, {ins_topic}", "no INS heading while the aircraft was on the ground")
    return ins_time[index], unwrap(np.asarray(heading_deg)[index])


def _interpolated(at: FloatArray, time_s: FloatArray, heading_deg: FloatArray, gap_max_s: float) -> FloatArray:
    after = np.clip(np.searchsorted(time_s, at), 1, len(time_s) - 1)
    is_near = time_s[after] - time_s[after - 1] <= gap_max_s
    return np.where(is_near, interpolate_heading(at, time_s, heading_deg), np.nan)


def without_arm(samples: TaxiSamples, arm_m: float, error_deg: float = 0.0) -> TaxiSamples:
    """Return the velocities of the main-gear axle from those of the antenna ahead of it.

    The antenna is ``arm_m`` ahead. v_axle = v_antenna - omega x arm: a turn to the right moves the antenna to the right
    of the heading. ``error_deg`` is the rough INS heading error: the arm points along the true heading.
    """
    if arm_m == 0.0:
        return samples
    sideways = np.deg2rad(np.nan_to_num(samples.arm_rate_dps)) * arm_m
    heading_rad = np.deg2rad(np.nan_to_num(samples.heading_deg - error_deg))
    return replace(
        samples,
        north_mps=samples.north_mps + sideways * np.sin(heading_rad),
        east_mps=samples.east_mps - sideways * np.cos(heading_rad),
    )


def take_samples(samples: TaxiSamples, mask: BoolArray | NDArray[np.intp]) -> TaxiSamples:
    """The rows of every array that a mask or positions select."""
    arrays: dict[str, Any] = {
        name: value[mask] for name, value in vars(samples).items() if isinstance(value, np.ndarray)
    }
    return replace(samples, **arrays)
