"""Differences INS minus GNSS for the filter, with what could not be believed left out."""

from dataclasses import fields, replace
from functools import cached_property

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.geodesy import curvature_radii_m, on_earth
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.systems.inertial import screening
from groundstation.systems.inertial.filter import DifferenceEpochs
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.tables.gaps import seconds_covered
from groundstation.tables.resample import join
from groundstation.tables.sources import Need, PairNeed, aided_share, choose_pair
from groundstation.tables.table import Flight, Table

POSITION_FIELDS = ("latitude_deg", "longitude_deg")
VELOCITY_FIELDS = ("velocity_north_mps", "velocity_east_mps")
POSITIONS = PairNeed(
    "inertial",
    Need("ins", "INS position", POSITION_FIELDS, takes_longest=True),
    Need("gnss", "GNSS position", POSITION_FIELDS, takes_longest=True),
)
UNUSED_MODES = ("align", "attitude")
TRACK_MPS = 20.0  # slower, and the track is not the heading
LONGEST_FLIGHT_S = 4.0e6  # 46 days: a clock that jumps by years must not fill the memory


@dataclass(frozen=True)
class InsDifferences:
    """INS minus GNSS on the epochs of the filter, and the motion of the INS there.

    Parameters
    ----------
    ins_topic, gnss_topic : str
    epochs : DifferenceEpochs, n of them
    latitude_deg, longitude_deg, altitude_m : ndarrays, shape (n,)
        Of the INS; NaN where unknown.
    velocity_mps : ndarray, shape (n, 2)
        Of the INS, north and east.
    aided_share : float
        Share of the INS samples whose mode says that GNSS corrects them.
    findings : tuple of Finding
        What was left out, with place and count.
    heading_deg : ndarray, shape (n,), optional
        True heading of the INS, NaN where unknown.
    """

    ins_topic: str
    gnss_topic: str
    epochs: DifferenceEpochs
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    aided_share: float
    findings: tuple[Finding, ...]
    heading_deg: FloatArray | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))

    @cached_property
    def motion_known(self) -> tuple[FloatArray, ...]:
        """Latitude, altitude and velocities north and east of the INS at every epoch, gaps filled."""
        time_s, found = self.epochs.time_s, []
        for values in (self.latitude_deg, self.altitude_m, *self.velocity_mps.T):
            known = np.isfinite(values)
            filled = np.interp(time_s, time_s[known], values[known]) if known.any() else np.zeros(len(time_s))
            found.append(frozen(filled))
        return tuple(found)

    @cached_property
    def unwrapped_heading_rad(self) -> FloatArray:
        """Heading at every epoch without wrap, shape (n,).

        It is the heading of the INS, or its track where the heading is unknown. It is held where the INS gives neither
        and the aircraft is slower than :data:`TRACK_MPS`; zero if it never moved.
        """
        north, east = self.velocity_mps.T
        track = np.where(np.hypot(north, east) > TRACK_MPS, np.arctan2(east, north), np.nan)
        heading = track
        if self.heading_deg is not None:
            told = np.deg2rad(self.heading_deg)
            heading = np.where(np.isfinite(told), told, track)
        known = np.flatnonzero(np.isfinite(heading))
        if not len(known):
            return np.zeros(len(heading))
        return np.interp(np.arange(len(heading)), known, np.unwrap(heading[known]))


def differences(
    flight: Flight,
    *,
    settings: InertialSettings,
    excluded_s: tuple[tuple[float, float], ...] = (),
    ins_topic: str = "",
) -> InsDifferences:
    """Compare INS and GNSS of a flight.

    The INS is the one named, else the first that has what is needed. GNSS samples are averaged over
    ``epoch_interval_s`` after the INS has been interpolated to each of them; epochs with
    INS alone stand in the gaps of GNSS.

    Raises
    ------
    NotAssessableError
        With the reason: no INS, no GNSS, or less GNSS than ``least_gnss_s``.
    """
    ins_topic, gnss_topic = choose_pair(flight, POSITIONS, ins_topic)
    ins, realigned_ns = navigating(flight[ins_topic].unique_times())
    gnss = flight[gnss_topic].unique_times()
    if not len(ins):
        raise NotAssessableError("inertial", f"{ins_topic} never left alignment")
    findings = list(screening.unknown_values(flight, ins, gnss))
    ins, resets = screening.ins_jumps(flight, ins, settings)
    findings += resets.findings
    reset_ns = np.union1d(resets.time_ns, realigned_ns)
    motion = join(ins, gnss.time_ns, (*POSITION_FIELDS, *VELOCITY_FIELDS), largest_gap_s=settings.ins_gap_max_s)
    position, velocity = _position_difference(motion, gnss, _altitude(gnss)), _velocity_difference(motion, gnss)
    unusable = _within(flight.seconds(gnss.time_ns), excluded_s) | _astride(gnss.time_ns, ins.time_ns, reset_ns)
    position[unusable], velocity[unusable] = np.nan, np.nan
    bad, found = screening.unbelieved(flight, gnss, motion, position, reset_ns, settings)
    findings += found
    position[bad], velocity[bad] = np.nan, np.nan
    compared = np.isfinite(position).any(axis=1) | np.isfinite(velocity).any(axis=1)
    time_s, columns = _binned(flight, ins, gnss.take(compared), position[compared], velocity[compared], settings)
    gnss_seconds = seconds_covered(time_s[np.isfinite(columns[:, :4]).any(axis=1)], settings.outage_s)
    if gnss_seconds < settings.least_gnss_s:
        raise NotAssessableError(
            "inertial",
            f"{gnss_seconds:.0f} s with INS and GNSS together",
            f"at least {settings.least_gnss_s:.0f} s",
        )
    at = join(
        ins,
        flight.start_ns + np.round(time_s * NS_PER_S).astype(np.int64),
        None,
        largest_gap_s=max(settings.ins_gap_max_s, 2.0 * settings.epoch_interval_s),
    )
    latitude, longitude = on_earth(at.values("latitude_deg"), at.values("longitude_deg"))
    ins_velocity = np.stack([at.values(name) for name in VELOCITY_FIELDS], axis=1)
    epochs = DifferenceEpochs(
        time_s,
        columns[:, 0:2],
        columns[:, 2:4],
        drag_per_s(latitude, _altitude(at), ins_velocity),
        _reset_marks(flight, time_s, reset_ns),
    )
    return InsDifferences(
        *(ins_topic, gnss_topic, epochs, latitude, longitude, _altitude(at), ins_velocity),
        aided_share=aided_share(ins),
        findings=tuple(findings),
        heading_deg=at.values("true_heading_deg") if at.has("true_heading_deg") else None,
    )


def drag_per_s(latitude_deg: FloatArray, altitude_m: FloatArray, velocity_mps: FloatArray) -> FloatArray:
    """Return the rates by which position errors drag each other along in flight, 1/s.

    The shape is (n, 2, 2), errors are in metres. The error east is that of longitude times the radius of the parallel:
    (error east)' = velocity error east + tan(latitude) / R (velocity east x error north - velocity north x error east).
    Zero where the motion is unknown.
    """
    _, prime_vertical = curvature_radii_m(np.nan_to_num(latitude_deg))
    slope = np.tan(np.deg2rad(np.clip(latitude_deg, -88.0, 88.0))) / (prime_vertical + np.nan_to_num(altitude_m))
    out = np.zeros((len(latitude_deg), 2, 2))
    out[:, 1, 0] = slope * velocity_mps[:, 1]
    out[:, 1, 1] = -slope * velocity_mps[:, 0]
    return np.nan_to_num(out)


def only_used(epochs: DifferenceEpochs, settings: InertialSettings) -> DifferenceEpochs:
    """Return the epochs without what the settings keep from the filter."""
    position = epochs.position_m if settings.use_position else np.full_like(epochs.position_m, np.nan)
    velocity = epochs.velocity_mps if settings.use_velocity else np.full_like(epochs.velocity_mps, np.nan)
    return replace(epochs, position_m=position, velocity_mps=velocity)


def _within(time_s: FloatArray, intervals_s: tuple[tuple[float, float], ...]) -> BoolArray:
    mask = np.zeros(len(time_s), dtype=bool)
    for start_s, end_s in intervals_s:
        mask |= (time_s >= start_s) & (time_s <= end_s)
    return mask


def _astride(gnss_ns: Int64Array, ins_ns: Int64Array, reset_ns: Int64Array) -> BoolArray:
    """Find GNSS samples between the INS samples before and after a reset: half of each."""
    mask = np.zeros(len(gnss_ns), dtype=bool)
    for after_ns in reset_ns:
        row = int(np.searchsorted(ins_ns, after_ns))
        if row:
            mask |= (gnss_ns > ins_ns[row - 1]) & (gnss_ns < after_ns)
    return mask


def navigating(ins: Table) -> tuple[Table, Int64Array]:
    """Return the samples in which the INS navigates: none of alignment, none invalid.

    With the times at which it took up navigating again: it may come back with other errors.
    """
    keep = ~np.isin(ins.text("mode"), UNUSED_MODES)
    if "valid" in ins:
        column = ins.columns["valid"]
        keep &= np.asarray(column.values, dtype=bool) | ~column.mask
    if keep.all():
        return ins, np.zeros(0, dtype=np.int64)
    again = keep & ~np.concatenate([[True], keep[:-1]])
    again &= np.cumsum(keep) > 1  # the first sample of all is no return
    return ins.take(keep), ins.time_ns[again]


def _altitude(table: Table) -> FloatArray:
    for name in ("altitude_ellipsoid_m", "altitude_msl_m"):
        if table.has(name):
            return np.nan_to_num(table.values(name))
    return np.zeros(len(table))


def _position_difference(motion: Table, gnss: Table, altitude_m: FloatArray) -> FloatArray:
    """INS minus GNSS, metres north and east, shape (n, 2)."""
    latitude, longitude = on_earth(gnss.values("latitude_deg"), gnss.values("longitude_deg"))
    ins_latitude, ins_longitude = on_earth(motion.values("latitude_deg"), motion.values("longitude_deg"))
    meridian, prime_vertical = curvature_radii_m(latitude)
    north = np.deg2rad(ins_latitude - latitude) * (meridian + altitude_m)
    parallel = (prime_vertical + altitude_m) * np.cos(np.deg2rad(latitude))
    return np.stack([north, np.deg2rad(wrap_180(ins_longitude - longitude)) * parallel], axis=1)


def _velocity_difference(motion: Table, gnss: Table) -> FloatArray:
    return np.stack([motion.values(name) - gnss.values(name) for name in VELOCITY_FIELDS], axis=1)


def _binned(
    flight: Flight,
    ins: Table,
    gnss: Table,
    position: FloatArray,
    velocity: FloatArray,
    settings: InertialSettings,
) -> tuple[FloatArray, FloatArray]:
    """Return means over equal intervals of flight time: times (n,), differences (n, 4).

    NaN where GNSS is absent.
    """
    interval = settings.epoch_interval_s
    ins_s, gnss_s = flight.seconds(ins.time_ns), flight.seconds(gnss.time_ns)
    last = max([*ins_s[-1:], *gnss_s[-1:], 0.0])
    if last > LONGEST_FLIGHT_S:
        raise NotAssessableError("inertial", f"a log of {counted(round(last / 86400.0), 'day')}", "a flight")
    # half an interval of offset: samples on whole intervals, with jitter either way, fall into one bin each
    bins = [np.floor(part / interval + 0.5).astype(np.int64) for part in (ins_s, gnss_s)]
    which = np.unique(np.concatenate(bins))
    ins_mean = mean_in(np.searchsorted(which, bins[0]), ins_s[:, None], len(which))[:, 0]
    gnss_mean = mean_in(np.searchsorted(which, bins[1]), np.column_stack([gnss_s, position, velocity]), len(which))
    time_s = np.where(np.isfinite(gnss_mean[:, 0]), gnss_mean[:, 0], ins_mean)
    return time_s, gnss_mean[:, 1:]


def mean_in(bin_of: Int64Array, values: FloatArray, bins: int) -> FloatArray:
    """Return means of values (n, k) over the samples of each bin, shape (bins, k).

    NaN where none is known.
    """
    known = np.isfinite(values)
    out = np.full((bins, values.shape[1]), np.nan)
    for column in range(values.shape[1]):
        rows = slice(None) if known[:, column].all() else known[:, column]
        total = np.bincount(bin_of[rows], weights=values[rows, column], minlength=bins)
        count = np.bincount(bin_of[rows], minlength=bins)
        out[:, column] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return out


def _reset_marks(flight: Flight, time_s: FloatArray, reset_ns: Int64Array) -> BoolArray:
    marks = np.zeros(len(time_s), dtype=bool)
    at = np.searchsorted(time_s, flight.seconds(reset_ns))
    marks[at[at < len(time_s)]] = True
    return marks
