"""Stand after the alignment, shutdown, and what alignments between changed."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.records import BoolArray
from groundstation.base.units import M_PER_NAUTICAL_MILE, MPS2_PER_G
from groundstation.methods.ins_noise import RADPS_PER_DPH, InsNoise
from groundstation.methods.intervals import BOUND95, slope_through_origin
from groundstation.systems.inertial.alignment_answer import (
    GroundPlace,
    InsRealignment,
    InsShutdown,
    StandingDrift,
)
from groundstation.systems.inertial.alignment_limits import standing_limit_mps2
from groundstation.systems.inertial.alignment_slopes import (
    CIRCLE95,
    ROUNDED,
    AxisSlope,
    length_of,
    means_with_sigma,
    slopes_of,
    step_of,
)
from groundstation.systems.inertial.alignment_stands import GroundMotion
from groundstation.systems.inertial.differences import VELOCITY_FIELDS, InsDifferences
from groundstation.systems.inertial.units_answer import Measured
from groundstation.systems.inertial.units_log import ORDINARY_M, ORDINARY_MPS
from groundstation.tables.table import Flight, Table

LEAST_DRIFT_S, LONGEST_DRIFT_S = 60.0, 600.0
PARKED_S = 60.0  # means at the end are over so long
LEAST_PARKED_S = 20.0
AT_END_S = 10.0  # the last stand reaches to the end of the INS but for so long
LEAST_RATE_S = 600.0  # as in the rates of the flight
STEP_S = 30.0  # means before and after an alignment are over so long
FEWEST = 5
LIMIT_SIGMAS = 3.44  # radius that a round normal distribution exceeds in 0.27 %
S_PER_MIN, S_PER_H = 60.0, 3600.0
LEAST_HEADING_STEP_DEG = 0.01  # no heading is written, or steady, to less
EDGE_S = 3.0  # of a stand: the brakes, the first roll


def velocities(flight: Flight, ins: Table) -> tuple[FloatArray, FloatArray]:
    """Return times and velocities of an INS."""
    return flight.seconds(ins.time_ns), np.column_stack([ins.values(name) for name in VELOCITY_FIELDS])


def standing_drift(
    time_s: FloatArray,
    velocity_mps: FloatArray,
    stands: tuple[tuple[float, float], ...],
    start_s: float | None,
    noise: InsNoise | None,
) -> tuple[StandingDrift | None, str]:
    """Return the drift of the velocity while standing after the start, or why there is none.

    ``noise`` None: it is not judged. Of a long stand the first ten minutes count.
    """
    began_s = float(time_s[0]) if start_s is None or start_s < time_s[0] else start_s
    after = [(max(one[0], began_s), one[1]) for one in stands if one[1] > began_s]
    first = next((one for one in after if one[1] - one[0] >= 2.0 * EDGE_S), None)
    if first is None or first[0] > began_s + LONGEST_DRIFT_S:
        return None, "the aircraft does not stand after the alignment"
    begin_s, end_s = first[0], min(first[1] - EDGE_S, first[0] + LONGEST_DRIFT_S)
    if end_s - begin_s < LEAST_DRIFT_S:
        return None, f"it stands for {max(end_s - begin_s, 0.0):.0f} s after the alignment, {LEAST_DRIFT_S:.0f} needed"
    rows = (time_s >= begin_s) & (time_s < end_s)
    slopes = slopes_of(time_s[rows], velocity_mps[rows])
    if slopes is None:
        return None, "too few velocities of the INS while it stands"
    north, east = (AxisSlope(S_PER_MIN * one.value, S_PER_MIN * one.sigma) for one in slopes)
    size = length_of(north, east)
    limit = None
    if noise is not None:
        waited_s = begin_s - start_s if start_s is not None else 0.0
        limit = S_PER_MIN * drift_limit_mps2(noise, waited_s, end_s - begin_s)
    is_above = limit is not None and size.value - size.half95 > limit
    return StandingDrift(begin_s, end_s, north.measured, east.measured, size, limit, is_above), ""


def drift_limit_mps2(noise: InsNoise, waited_s: float, length_s: float) -> float:
    """Return the length of a velocity slope that an honest unit of a class hardly exceeds.

    Of a shipped class it is that of simulated stands. Of any other, for one axis: tilt x g, drift x g x the mean time
    since the alignment, and the walk of the velocity, whose fitted slope has the variance 6 q / (5 T).
    """
    shipped = standing_limit_mps2(noise.name, length_s + 2.0 * waited_s)
    if shipped is not None:
        return shipped
    middle_s = waited_s + 0.5 * length_s
    drift_radps = RADPS_PER_DPH * float(np.hypot(noise.drift_dph, noise.random_drift_dph))
    parts = (
        MPS2_PER_G * noise.tilt_rad,
        MPS2_PER_G * drift_radps * middle_s,
        noise.velocity_walk_mps_per_sqrt_s * float(np.sqrt(1.2 / length_s)),
    )
    return LIMIT_SIGMAS * float(np.sqrt(np.sum(np.square(parts))))


def shutdown_of(
    time_s: FloatArray,
    velocity_mps: FloatArray,
    motion: GroundMotion,
    compared: InsDifferences | None,
    noise: InsNoise,
    start_s: float | None,
    *,
    is_unaided: bool,
) -> InsShutdown:
    """Return the state at the end of the log."""
    stands = motion.spans()
    last_s = float(time_s[-1])
    parked = stands[-1] if stands and stands[-1][1] >= last_s - AT_END_S else None
    began_s = float(motion.time_s[0]) if len(motion.time_s) else 0.0
    if parked is not None and not motion.moves[motion.within(began_s, parked[0])].any():
        parked, reason = None, "the aircraft never moved"
    elif parked is None:
        reason = "the log ends in motion"
    else:
        reason = "" if parked[1] - parked[0] >= LEAST_PARKED_S else f"parked for {parked[1] - parked[0]:.0f} s only"
    speed = None
    if parked is not None and not reason:
        begin_s = max(parked[0] + EDGE_S, parked[1] - PARKED_S)
        rows = (time_s >= begin_s) & (time_s <= parked[1])
        means = means_with_sigma(time_s[rows], velocity_mps[rows])
        speed = None if means is None else length_of(*means)
    error, at_s, hours, rate = _terminal(compared, noise, start_s, parked, is_unaided=is_unaided)
    if error is None:
        reason = "; ".join(filter(None, (reason, "not compared with GNSS")))
    elif parked is not None and at_s is not None and at_s < parked[0]:
        reason = "; ".join(filter(None, (reason, "no GNSS at the stand: the last one known")))
    first_s, end_s = (None, None) if parked is None else parked
    return InsShutdown(parked is not None, reason, first_s, end_s, speed, error, at_s, hours, rate)


def _terminal(
    compared: InsDifferences | None,
    noise: InsNoise,
    start_s: float | None,
    parked: tuple[float, float] | None,
    *,
    is_unaided: bool,
) -> tuple[Measured | None, float | None, float | None, Measured | None]:
    """Return the last position error, when, the hours behind it, and their quotient."""
    if compared is None:
        return None, None, None, None
    epochs = compared.epochs
    known = np.flatnonzero(np.isfinite(epochs.position_m).all(axis=1))
    if not len(known):
        return None, None, None, None
    at_s = float(epochs.time_s[known[-1]])
    is_at_stand = parked is not None and at_s > parked[0] + EDGE_S
    window_s = PARKED_S if is_at_stand else STEP_S
    first_s = max(at_s - window_s, parked[0] if parked is not None and is_at_stand else -np.inf)
    rows = known[epochs.time_s[known] >= first_s]
    error = epochs.position_m[rows]
    if not is_at_stand and len(rows) > 2:  # it moves on: the value at the end of a line through the window
        error = np.stack([_at_end(epochs.time_s[rows], axis) for axis in error.T])[None]
    sigma_m = float(np.hypot(max(noise.gnss.position_correlated_m, ORDINARY_M), noise.gnss.position_white_m / 3.0))
    size = Measured(float(np.hypot(*np.mean(error, axis=0))), CIRCLE95 * sigma_m)
    if start_s is None or not is_unaided:
        return size, at_s, None, None
    resets = epochs.time_s[epochs.is_reset & (epochs.time_s <= at_s) & (epochs.time_s > start_s)]
    since_s = at_s - (float(resets[-1]) if len(resets) else start_s)
    hours = since_s / S_PER_H
    if since_s < LEAST_RATE_S:
        return size, at_s, hours, None
    per_hour = 1.0 / (M_PER_NAUTICAL_MILE * hours)
    return size, at_s, hours, Measured(size.value * per_hour, size.half95 * per_hour)


def _at_end(time_s: FloatArray, values: FloatArray) -> float:
    """Return the value at the last time of a line through samples."""
    since = time_s - time_s[-1]
    design = np.column_stack([np.ones(len(since)), since])
    return float(np.linalg.lstsq(design, values, rcond=None)[0][0])


def realignments_of(
    aligned_s: tuple[tuple[float, float], ...],
    compared: InsDifferences | None,
    heading: tuple[FloatArray, FloatArray] | None,
    motion: GroundMotion,
    start_s: float | None,
) -> tuple[InsRealignment, ...]:
    """Return what every alignment after the start, and every position that was set, changed.

    Parameters
    ----------
    aligned_s : tuple of (float, float)
        Alignments after the start, by the mode.
    heading : (time_s, difference_deg), optional
        Heading of the INS less that of the aircraft, where anything tells it.
    """
    spans = [(*one, True) for one in aligned_s]
    if compared is not None:
        resets = compared.epochs.time_s[compared.epochs.is_reset]
        near = [any(first - STEP_S <= at <= end + STEP_S for first, end in aligned_s) for at in resets.tolist()]
        spans += [(at, at, False) for at, is_near in zip(resets.tolist(), near, strict=True) if not is_near]
    spans.sort()
    if not spans:
        return ()
    begins = [start_s, *(end for _, end, _ in spans)]
    ends = [*(first for first, _, _ in spans[1:]), np.inf]
    found = []
    for (first_s, end_s, is_aligned), since_s, until_s in zip(spans, begins[:-1], ends, strict=True):
        place = _place(motion, first_s, end_s)
        steps = (None, None) if compared is None else _steps(compared, first_s, end_s)
        turned = _heading_step(heading, first_s, end_s)
        if not is_aligned and steps[0] is not None and steps[0].value <= steps[0].half95:
            continue  # the flag of the mode flickered: nothing changed
        before = None if since_s is None else _rate(compared, since_s, first_s)
        found.append(
            InsRealignment(first_s, end_s, is_aligned, place, *steps, turned, before, _rate(compared, end_s, until_s))
        )
    return tuple(found)


def _place(motion: GroundMotion, first_s: float, end_s: float) -> GroundPlace:
    rows = motion.within(first_s - 1.0, end_s + 1.0)
    stands, moves = int(motion.stands[rows].sum()), int(motion.moves[rows].sum())
    if not stands and not moves:
        return "unknown"
    return "standing" if stands >= moves else "moving"


def _steps(compared: InsDifferences, first_s: float, end_s: float) -> tuple[Measured | None, Measured | None]:
    """Return the lengths of the steps of position and velocity error."""
    epochs = compared.epochs
    before = (epochs.time_s >= first_s - STEP_S) & (epochs.time_s < first_s)
    after = (epochs.time_s >= end_s) & (epochs.time_s < end_s + STEP_S)
    found: list[Measured | None] = []
    for values, sigma in ((epochs.position_m, ORDINARY_M), (epochs.velocity_mps, ORDINARY_MPS)):
        one, other = _edge(epochs.time_s, values, before, first_s), _edge(epochs.time_s, values, after, end_s)
        if one is None or other is None:
            found.append(None)
            continue
        slow = np.sqrt(2.0) * sigma if end_s - first_s > STEP_S else 0.0  # what is slow is the same on both sides
        half = CIRCLE95 * float(np.sqrt(one[1] ** 2 + other[1] ** 2 + slow**2))
        found.append(Measured(float(np.hypot(*(other[0] - one[0]))), half))
    return found[0], found[1]


def _edge(time_s: FloatArray, values: FloatArray, rows: BoolArray, at_s: float) -> tuple[FloatArray, float] | None:
    """Return the value at the edge of a window, by a line through it, and its sigma."""
    known = rows & np.isfinite(values).all(axis=1)
    if known.sum() < FEWEST:
        return None
    design = np.column_stack([np.ones(int(known.sum())), time_s[known] - at_s])
    fitted = np.linalg.lstsq(design, values[known], rcond=None)[0]
    rest = values[known] - design @ fitted
    scatter = float(np.sqrt(np.sum(rest**2) / (2.0 * max(known.sum() - 2, 1))))
    return fitted[0], scatter * float(np.sqrt(np.linalg.pinv(design.T @ design)[0, 0]))


def _heading_step(heading: tuple[FloatArray, FloatArray] | None, first_s: float, end_s: float) -> Measured | None:
    """Return the step of the heading error, None where it is not known."""
    if heading is None:
        return None
    time_s, difference_deg = heading
    before = (time_s >= first_s - STEP_S) & (time_s < first_s)
    after = (time_s >= end_s) & (time_s < end_s + STEP_S)
    if before.sum() < FEWEST or after.sum() < FEWEST:
        return None
    one, other = difference_deg[before], difference_deg[after]
    centre = one[-1]
    means = [float(np.mean(wrap_180(part - centre))) for part in (one, other)]
    variance = sum(float(np.var(wrap_180(part - centre))) / len(part) for part in (one, other))
    variance += 2.0 * (ROUNDED * max(step_of(one), step_of(other), LEAST_HEADING_STEP_DEG)) ** 2
    return Measured(float(wrap_180(means[1] - means[0])), BOUND95 * float(np.sqrt(variance)))


def _rate(compared: InsDifferences | None, since_s: float, until_s: float) -> float | None:
    """Return the slope through the origin of the radial error over a span."""
    if compared is None:
        return None
    epochs = compared.epochs
    rows = (epochs.time_s >= since_s) & (epochs.time_s < until_s) & np.isfinite(epochs.position_m).all(axis=1)
    if not rows.any() or epochs.time_s[rows][-1] - since_s < LEAST_RATE_S:
        return None
    hours = (epochs.time_s[rows] - since_s) / S_PER_H
    radial = np.hypot(*epochs.position_m[rows].T) / M_PER_NAUTICAL_MILE
    return slope_through_origin(hours, radial, np.ones(len(hours)))


def heading_while_standing(
    time_s: FloatArray, heading_deg: FloatArray, motion: GroundMotion, spans: tuple[tuple[float, float], ...]
) -> tuple[FloatArray, FloatArray] | None:
    """Return the heading near alignments through which the aircraft stood: it did not turn.

    None where it stood through none.
    """
    keep = np.zeros(len(time_s), dtype=bool)
    for first_s, end_s in spans:
        around = motion.within(first_s - STEP_S, end_s + STEP_S)
        if around.any() and not motion.moves[around].any() and motion.stands[around].mean() > 0.5:
            keep |= (time_s >= first_s - STEP_S) & (time_s <= end_s + STEP_S)
    keep &= np.isfinite(heading_deg)
    return (time_s[keep], heading_deg[keep]) if keep.any() else None
