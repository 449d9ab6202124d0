"""Epochs of a flight with magnetic heading, motion and field, about one a second."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, unwrap, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import DEG_PER_RAD, NS_PER_S
from groundstation.base.words import counted
from groundstation.methods.moving_lines import fitted_lines, window_bounds
from groundstation.systems.magnetic.answer import DeclinationUsed
from groundstation.systems.magnetic.flown import IN_THE_AIR
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.readings import NO_DATE, PLACE_WANTED, altitude_at, position_at
from groundstation.tables.motion import runs
from groundstation.tables.phases import Phases
from groundstation.tables.resample import values_at
from groundstation.tables.table import Flight, Table

ANALYSIS = "magnetic_flux"
NO_HEADING = "no magnetic heading in the log"
STEP_S, GAP_S = 1.0, 2.5  # of the epochs; values are taken over no longer gap
BREAK_S = 5.0  # a longer step between epochs ends a leg
TURNING_DPS = 0.5
GRAVITY_MPS2 = 9.81
DERIVED_SD_DEG = 0.03  # magnetic heading that follows the true one so closely is computed from it
LEAST_EPOCHS, MOST_EPOCHS = 60, 20_000


@dataclass(frozen=True)
class FluxEpochs:
    """Epochs with a magnetic heading; arrays of shape (n,), NaN where unknown.

    ``velocity_mps`` (n, 2) is that of GNSS, north and east. ``lean_deg`` is the bank in turns, 0 in straight flight:
    what hangs is upright there whatever the roll reads. ``per_tilt`` is Z / H of the model.
    """

    time_ns: Int64Array
    time_s: FloatArray
    heading_deg: FloatArray
    declination_deg: FloatArray
    per_tilt: FloatArray
    roll_deg: FloatArray
    lean_deg: FloatArray
    rate_dps: FloatArray
    velocity_mps: FloatArray
    airspeed_mps: FloatArray
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    altitude_m: FloatArray
    is_airborne: BoolArray
    used: DeclinationUsed
    dip_deg: float | None
    gnss_topic: str

    def __len__(self) -> int:
        return len(self.time_s)


def heading_topic(flight: Flight, named: str = "") -> str:
    """Return the topic of the magnetic heading: the first that has one, or the one named.

    Raises
    ------
    NotAssessableError
        When the log has none.
    """
    topics = [topic for topic in topics_of_kind("ins", flight.topics()) if flight[topic].has("magnetic_heading_deg")]
    found = [topic for topic in topics if not named or topic == named]
    if not found:
        raise NotAssessableError(ANALYSIS, f"{NO_HEADING} of {named}" if named else NO_HEADING)
    return found[0]


def gather_epochs(flight: Flight, topic: str, phases: Phases, settings: MagneticFluxSettings) -> FluxEpochs:
    """Return the epochs of a magnetic heading.

    Raises
    ------
    NotAssessableError
        With the reason: hardly a heading, no speed, no declination, never in the air.
    """
    unit = flight[topic].trusted()
    unit = _thinned(unit.take(unit.valid("magnetic_heading_deg")).unique_times())
    if len(unit) < LEAST_EPOCHS:
        raise NotAssessableError(
            ANALYSIS, f"{counted(len(unit), 'epoch')} of magnetic heading, one a second: {LEAST_EPOCHS} needed"
        )
    at_ns, heading = unit.time_ns, wrap_360(unit.values("magnetic_heading_deg"))
    time_s = flight.seconds(at_ns)
    gnss_topic, velocity = _velocity(flight, at_ns)
    airspeed = _airspeed(flight, at_ns)
    ground = np.hypot(*velocity.T)
    speed = np.where(np.isfinite(airspeed), airspeed, ground)
    if not np.isfinite(speed).any():
        raise NotAssessableError(ANALYSIS, "neither GNSS velocity nor true airspeed in the log")
    altitude = altitude_at(flight, unit, at_ns)
    is_airborne = np.isin(phases.at(time_s), IN_THE_AIR) & (speed >= settings.speed_min_mps)
    if not is_airborne.any():
        raise NotAssessableError(ANALYSIS, f"never in the air above {settings.speed_min_mps:g} m/s")
    rate = _slope(time_s, unwrap(heading), settings.rate_window_s)
    by_turn = DEG_PER_RAD * np.arctan(speed * rate / DEG_PER_RAD / GRAVITY_MPS2)
    roll = unit.values("roll_deg")
    roll = np.where(np.isfinite(roll), roll, by_turn)
    turning = np.abs(rate) > TURNING_DPS
    declination, per_tilt, used, dip = _field(flight, unit, at_ns, altitude, is_airborne, settings)
    return FluxEpochs(
        time_ns=at_ns,
        time_s=time_s,
        heading_deg=heading,
        declination_deg=declination,
        per_tilt=per_tilt,
        roll_deg=roll,
        lean_deg=np.where(turning & is_airborne & np.isfinite(roll), roll, 0.0),
        rate_dps=rate,
        velocity_mps=velocity,
        airspeed_mps=airspeed,
        speed_mps=speed,
        acceleration_mps2=_slope(time_s, speed, settings.acceleration_window_s),
        altitude_m=altitude,
        is_airborne=is_airborne,
        used=used,
        dip_deg=dip,
        gnss_topic=gnss_topic,
    )


def find_legs(epochs: FluxEpochs, settings: MagneticFluxSettings) -> list[tuple[int, int]]:
    """Return the straight legs as rows [first, last): level, steady, settled after a turn."""
    with np.errstate(invalid="ignore"):
        turning = (np.abs(epochs.rate_dps) > settings.leg_rate_max_dps) | (
            np.abs(epochs.roll_deg) > settings.leg_bank_max_deg
        )
        steady = ~(np.abs(epochs.acceleration_mps2) > settings.acceleration_max_mps2)
    straight = epochs.is_airborne & ~turning & steady & (_since(epochs.time_s, turning) >= settings.settle_s)
    together = np.concatenate([[0], np.cumsum(np.diff(epochs.time_s) > BREAK_S)])
    found: list[tuple[int, int]] = []
    for first, last in runs(straight):
        edges = [first, *(first + 1 + np.flatnonzero(np.diff(together[first:last]))), last]
        for begin, end in pairwise(edges):
            parts = max(1, int(np.ceil((epochs.time_s[end - 1] - epochs.time_s[begin]) / settings.leg_max_s)))
            cuts = np.linspace(begin, end, parts + 1).round().astype(int)
            found += [(int(one), int(other)) for one, other in pairwise(cuts)]
    return [
        (one, other)
        for one, other in found
        if other - one > 1 and epochs.time_s[other - 1] - epochs.time_s[one] >= settings.leg_min_s
    ]


def is_computed_from(flight: Flight, topic: str, epochs: FluxEpochs) -> bool:
    """Tell whether the magnetic heading is the logged true one less a stored variation.

    An inertial unit computes it so; there is no compass in it.
    """
    true = values_at(flight[topic].trusted(), "true_heading_deg", epochs.time_ns, largest_gap_s=GAP_S)
    known = np.isfinite(true) & epochs.is_airborne
    if np.count_nonzero(known) < LEAST_EPOCHS or "magnetic" in flight.metadata.get(
        f"derived.{topic}.true_heading_deg", ""
    ):
        return False
    left = wrap_180(epochs.heading_deg + epochs.declination_deg - true)[known]
    columns = np.stack([np.ones(left.size), epochs.time_s[known] - epochs.time_s[known][0]], axis=1)
    about = wrap_180(left - left[0])
    trend, *_ = np.linalg.lstsq(columns, about, rcond=None)
    return float(np.std(about - columns @ trend)) < DERIVED_SD_DEG + _steps_sd_deg(flight[topic])


def _steps_sd_deg(table: Table) -> float:
    """Standard deviation that rounding of both headings alone makes."""
    total = 0.0
    for name in ("magnetic_heading_deg", "true_heading_deg"):
        values = np.unique(np.diff(np.unique(table.values(name)[np.isfinite(table.values(name))])))
        total += float(values[values > 1e-6].min(initial=1.0)) ** 2 / 12.0 if values.size else 0.0
    return float(np.sqrt(total))


def _thinned(table: Table) -> Table:
    steps_ns = np.diff(table.time_ns)
    if not steps_ns.size:
        return table
    wanted_s = max(STEP_S, float(table.time_ns[-1] - table.time_ns[0]) / NS_PER_S / MOST_EPOCHS)
    step = int(wanted_s * NS_PER_S / max(float(np.median(steps_ns)), 1.0) + 0.5)
    return table.take(slice(0, None, step)) if step > 1 else table


def _velocity(flight: Flight, at_ns: Int64Array) -> tuple[str, FloatArray]:
    names = ("velocity_north_mps", "velocity_east_mps")
    for topic in topics_of_kind("gnss", flight.topics()):
        if flight[topic].has(*names):
            table = flight[topic].unique_times()
            parts = [values_at(table, name, at_ns, largest_gap_s=GAP_S) for name in names]
            return topic, np.stack(parts, axis=1)
    return "", np.full((len(at_ns), 2), np.nan)


def _airspeed(flight: Flight, at_ns: Int64Array) -> FloatArray:
    for topic in topics_of_kind("air", flight.topics()):
        if flight[topic].has("true_airspeed_mps"):
            return values_at(flight[topic].unique_times(), "true_airspeed_mps", at_ns, largest_gap_s=GAP_S)
    return np.full(len(at_ns), np.nan)


def _slope(time_s: FloatArray, values: FloatArray, window_s: float) -> FloatArray:
    """Slope of lines over a window about each epoch; NaN where a value is not known."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(values), np.nan)
    low, high = window_bounds(time_s, time_s[known], window_s)
    return fitted_lines(time_s, time_s[known], values[known], low, high)[0]


def _since(time_s: FloatArray, turning: NDArray[np.bool_]) -> FloatArray:
    places = np.flatnonzero(turning)
    last = np.searchsorted(places, np.arange(len(time_s)), side="right") - 1
    since = np.full(len(time_s), np.inf)
    after = last >= 0
    since[after] = time_s[after] - time_s[places[last[after]]]
    return since


def _field(
    flight: Flight,
    unit: Table,
    at_ns: Int64Array,
    altitude: FloatArray,
    is_airborne: BoolArray,
    settings: MagneticFluxSettings,
) -> tuple[FloatArray, FloatArray, DeclinationUsed, float | None]:
    """Return declination and Z / H at every epoch, the declination used and the dip."""
    stated, count = settings.declination_deg, len(at_ns)
    latitude, longitude = position_at(flight, unit, at_ns)
    has_place = bool(np.isfinite(latitude).any())
    if not flight.has_utc or not has_place:
        if stated is None:
            raise NotAssessableError(ANALYSIS, *(NO_DATE if has_place else ("no position in the log", PLACE_WANTED)))
        used = DeclinationUsed(stated, settings.declination_sigma_deg, "as stated")
        return np.full(count, stated), np.full(count, np.nan), used, None
    latitude = np.where(np.abs(latitude) <= 90.0, latitude, np.nan)
    model = declination_along(latitude, longitude, np.nan_to_num(altitude), int(flight.start_ns))
    middle = float(np.nanmedian(np.where(is_airborne, model.values_deg, np.nan)))
    horizontal, down = (
        float(np.nanmedian(np.where(is_airborne, part, np.nan))) for part in (model.horizontal_nt, model.down_nt)
    )
    sigma = float(np.nanmedian(model.sigma_deg))
    per_tilt = np.where(np.isfinite(model.down_nt), model.down_nt / model.horizontal_nt, down / horizontal)
    dip = float(DEG_PER_RAD * np.arctan2(down, horizontal))
    along = np.where(np.isfinite(model.values_deg), model.values_deg, middle)
    used = DeclinationUsed(middle, sigma, model.model, horizontal, down)
    if stated is not None:
        along = wrap_180(stated + wrap_180(along - middle))
        used = DeclinationUsed(stated, settings.declination_sigma_deg, "as stated", horizontal, down)
    return along, per_tilt, used, dip
