"""Witnesses of a touchdown other than heights: load, wheels, pitch, weight on wheels.

Each gives the likelihood of the touchdown over a grid of times, or the reason why it shows none.
"""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import MPS2_PER_G
from groundstation.tables.motion import runs
from groundstation.tables.wheels import WHEELS, contact_of

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

LOAD_RANGE_G = (-1.0, 4.0)  # beyond it a sample is a fault of the recorder
SPIKE_G = 1.5  # of one sample against both its neighbours
SLOWEST_LOAD_HZ = 4.0  # the impact lasts some 0.2 s: between slower samples it is lost
JUMP_G, JUMP_SIGMAS = 0.08, 4.0  # a contact shows at least so much, and so many times the scatter in flight
SOFT, SOFT_S = 0.1, 2.0  # share of contacts too soft for a jump, and how long until one follows
BASE_S, QUIET_S = 0.6, 0.4  # the level before a jump; jumps closer together are one
RISE_S = 0.1  # from contact to the first higher sample
LEAST_GUST, GUST_FALL = 0.03, 3.0  # probability that a jump far above all in flight is a gust, and how it falls
SPUN_UP = 0.5  # share of the ground speed that a wheel in flight does not have
PITCH_FALL_DEG, PITCH_FALL_S = 1.2, 3.0  # a nose that is let down
PITCH_STEP_S = 0.25  # a faster pitch is averaged
PITCH_DELAY_S, PITCH_EARLY_S = 1.0, 0.6  # it falls so long after the contact; a relaxed flare falls before it
SWITCH_DELAY_S = 0.6  # struts that a light touchdown does not press
LANDED_DELAY_S = 10.0  # a filter that finds itself landed
FLARE_S = 10.0  # before the window, in which scatter in flight is taken


@dataclass(frozen=True, eq=False)
class Hint:
    """Likelihood of the touchdown over the grid by one witness; None with the reason."""

    name: str
    topic: str
    rate_hz: float | None
    likelihood: FloatArray | None
    reason: str = ""


@dataclass(frozen=True, eq=False)
class LoadSamples:
    """Normal acceleration in g, spikes of single samples left out, arrays of shape (n,)."""

    topic: str
    time_s: FloatArray
    load_g: FloatArray

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return rate_of(self.time_s)


def rate_of(time_s: FloatArray) -> float:
    """Return the samples a second, by the median step; 0 where there are too few."""
    steps = np.diff(time_s)
    return float(1.0 / max(np.median(steps), 1e-4)) if steps.size else 0.0


def load_of(flight: "Flight", first_s: float, last_s: float) -> LoadSamples | None:
    """Return the normal acceleration of the fastest topic within a stretch; None without any."""
    found: list[LoadSamples] = []
    for kind in ("ins", "imu"):
        for topic in topics_of_kind(kind, flight.topics()):
            if not flight[topic].has("accel_z_mps2"):
                continue
            time_s, load_g = flight.time_s(topic), -flight[topic].values("accel_z_mps2") / MPS2_PER_G
            rows = (time_s >= first_s) & (time_s <= last_s) & (load_g > LOAD_RANGE_G[0]) & (load_g < LOAD_RANGE_G[1])
            time_s, load_g = _in_order(time_s[rows], load_g[rows])
            if len(load_g) >= 3:
                kept = ~_spikes(load_g)
                found.append(LoadSamples(topic, time_s[kept], load_g[kept]))
    return max(found, key=lambda one: one.rate_hz, default=None)


def _in_order(time_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    _times, first = np.unique(time_s, return_index=True)
    return time_s[first], values[first]


def _spikes(load_g: FloatArray) -> np.ndarray:
    """Tell which samples stand apart from both their neighbours."""
    is_spike = np.zeros(len(load_g), dtype=bool)
    middle = load_g[1:-1]
    is_spike[1:-1] = np.minimum(np.abs(middle - load_g[:-2]), np.abs(middle - load_g[2:])) > SPIKE_G
    return is_spike


@dataclass(frozen=True, eq=False)
class Jumps:
    """Contacts that the load shows, arrays of shape (k,).

    ``step_s`` is the time since the sample before, ``flown_g`` is the greatest rise in sure flight before them.
    """

    time_s: FloatArray
    size_g: FloatArray
    step_s: FloatArray
    flown_g: float


def jumps_of(load: LoadSamples, flown_until_s: float) -> Jumps:
    """Sudden rises of the load above the level just before them.

    They are greater than the scatter in sure flight, before ``flown_until_s``.
    """
    time_s, load_g = load.time_s, load.load_g
    before = np.searchsorted(time_s, time_s - BASE_S)
    total = np.concatenate([[0.0], np.cumsum(load_g)])
    row = np.arange(len(load_g))
    level = (total[row] - total[before]) / np.maximum(row - before, 1)
    rise = np.where(row > before, load_g - level, 0.0)
    flown = rise[(time_s < flown_until_s) & (row > before)]
    noise = 1.4826 * float(np.median(np.abs(flown))) if flown.size >= 5 else JUMP_G / JUMP_SIGMAS
    high = rise > max(JUMP_G, JUMP_SIGMAS * noise)
    times, sizes, steps = (list[float]() for _ in range(3))
    for first, last in runs(high):
        if times and time_s[first] - times[-1] < QUIET_S:
            sizes[-1] = max(sizes[-1], float(np.max(rise[first:last])))
            continue
        step_s = float(time_s[first] - time_s[max(first - 1, 0)])
        times.append(float(time_s[first]) - 0.5 * step_s)
        sizes.append(float(np.max(rise[first:last])))
        steps.append(step_s)
    return Jumps(np.array(times), np.array(sizes), np.array(steps), float(flown.max()) if flown.size else JUMP_G)


def by_load(load: LoadSamples | None, grid_s: FloatArray) -> Hint:
    """First contact by a jump of the normal acceleration."""
    name = "normal acceleration"
    if load is None:
        return Hint(name, "", None, None, "not logged")
    rate = load.rate_hz
    if rate < SLOWEST_LOAD_HZ:
        return Hint(name, load.topic, rate, None, f"{rate:.1f} Hz: an impact of 0.2 s falls between the samples")
    found = jumps_of(load, float(grid_s[0]))
    inside = (found.time_s >= grid_s[0]) & (found.time_s <= grid_s[-1])
    if not inside.any():
        return Hint(name, load.topic, rate, None, "no jump above the scatter in flight")
    likelihood = np.zeros(len(grid_s))
    left = 1.0  # probability that no jump so far was the contact
    for row in np.flatnonzero(inside):
        sigma = np.hypot(found.step_s[row] / np.sqrt(12.0), RISE_S)
        above = found.size_g[row] / max(found.flown_g, 0.02) - 1.0  # all jumps in sure flight
        is_flown = float(np.clip(0.5 * np.exp(-GUST_FALL * above), LEAST_GUST, 0.9))
        weight, left = left * (1.0 - is_flown), left * is_flown
        likelihood += weight * np.exp(-0.5 * ((grid_s - found.time_s[row] + 0.3 * RISE_S) / sigma) ** 2) / sigma
    return Hint(name, load.topic, rate, or_before(likelihood, SOFT, SOFT_S, float(grid_s[1] - grid_s[0])))


def by_wheel_speed(flight: "Flight", ground_speed_mps: float, grid_s: FloatArray) -> Hint:
    """Spin-up of a wheel that stands still in flight."""
    name = "wheel speed"
    for kind, field in (("discrete", "wheel_speed_mps"), ("odometry", "speed_mps")):
        for topic in topics_of_kind(kind, flight.topics()):
            if not flight[topic].has(field):
                continue
            time_s, speed = flight.time_s(topic), np.abs(flight[topic].values(field))
            rows = (time_s >= grid_s[0]) & (time_s <= grid_s[-1]) & np.isfinite(speed)
            time_s, speed = _in_order(time_s[rows], speed[rows])
            rate = rate_of(time_s)
            is_up = speed > SPUN_UP * ground_speed_mps
            up = np.flatnonzero(is_up[1:] & ~is_up[:-1])
            if not up.size or is_up[: up[0] + 1].mean() > 0.2:
                return Hint(name, topic, rate, None, "no wheel spins up")
            low, high = float(time_s[up[0]]), float(time_s[up[0] + 1])
            return Hint(name, topic, rate, _between(grid_s, low - RISE_S, high, RISE_S, 0.0))
    return Hint(name, "", None, None, "not logged")


def by_pitch(flight: "Flight", grid_s: FloatArray) -> Hint:
    """Nose let down after the contact: the start of the steepest fall from the flare."""
    name = "pitch"
    topic = next((one for one in topics_of_kind("ins", flight.topics()) if flight[one].has("pitch_deg")), "")
    if not topic:
        return Hint(name, "", None, None, "not logged")
    time_s, pitch = flight.time_s(topic), flight[topic].values("pitch_deg")
    rows = (time_s >= grid_s[0]) & (time_s <= grid_s[-1]) & np.isfinite(pitch)
    time_s, pitch = _in_order(time_s[rows], pitch[rows])
    rate = rate_of(time_s)
    if len(pitch) < 5:
        return Hint(name, topic, rate, None, "too few samples")
    if rate > 1.0 / PITCH_STEP_S:
        steps_s = np.arange(time_s[0], time_s[-1], PITCH_STEP_S)
        pitch = np.interp(steps_s, time_s, _mean_over(time_s, pitch, PITCH_STEP_S))
        time_s = steps_s
    floor = float(np.median(pitch[time_s >= time_s[-1] - 4.0]))
    behind = np.clip(np.searchsorted(time_s, time_s + PITCH_FALL_S), 0, len(pitch) - 1)
    lets_down = (pitch - floor > PITCH_FALL_DEG) & (pitch - pitch[behind] > PITCH_FALL_DEG)
    if not lets_down.any():
        return Hint(name, topic, rate, None, "the nose does not fall")
    fall = -np.diff(pitch) / np.diff(time_s)
    steep = int(np.argmax(np.where(lets_down[:-1], fall, -np.inf)))
    slowest = max(0.3 * fall[steep], 0.4)
    while steep > 0 and fall[steep - 1] > slowest:
        steep -= 1  # back to the start of the fall
    step_s = float(time_s[min(steep + 1, len(time_s) - 1)] - time_s[steep])
    low, high = float(time_s[steep]), float(time_s[steep]) + step_s
    return Hint(name, topic, rate, _between(grid_s, low, high, PITCH_EARLY_S, PITCH_DELAY_S))


def _mean_over(time_s: FloatArray, values: FloatArray, half_s: float) -> FloatArray:
    low, high = np.searchsorted(time_s, time_s - half_s), np.searchsorted(time_s, time_s + half_s, side="right")
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[high] - total[low]) / np.maximum(high - low, 1))


def by_weight_on_wheels(flight: "Flight", grid_s: FloatArray) -> Hint:
    """Switch of the struts, late by its sampling and by struts that are not pressed yet."""
    contact = contact_of(flight)
    name = "weight on wheels"
    if contact is None:
        return Hint(name, "", None, None, "not logged")
    is_switch = contact.name == WHEELS
    name = name if is_switch else "landed flag"
    time_s = flight.seconds(contact.time_ns)
    rows = (time_s >= grid_s[0] - 2.0) & (time_s <= grid_s[-1] + LANDED_DELAY_S)
    time_s, is_on = time_s[rows], contact.on_ground[rows]
    topic = next(iter(topics_of_kind("discrete", flight.topics())), "")
    rate = rate_of(time_s)
    on = np.flatnonzero(is_on[1:] & ~is_on[:-1])
    if not on.size:
        return Hint(name, topic, rate, None, "no change in the window")
    delay_s = SWITCH_DELAY_S if is_switch else LANDED_DELAY_S
    low, high = float(time_s[on[0]]), float(time_s[on[0] + 1])
    return Hint(name, topic, rate, _between(grid_s, low, high, 0.05, delay_s))


def _between(grid_s: FloatArray, low_s: float, high_s: float, sigma_s: float, delay_s: float) -> FloatArray:
    """Likelihood of a cause before an effect that was seen between two samples.

    The effect comes ``delay_s`` later in the mean, exponentially, give or take a normal ``sigma_s``.
    """
    step = float(grid_s[1] - grid_s[0])
    reach = np.arange(-20.0, 20.0 + 0.5 * step, step)
    late = np.exp(-reach / delay_s) * (reach >= 0.0) if delay_s > 0.0 else (np.abs(reach) < 0.5 * step).astype(float)
    normal = np.exp(-0.5 * (reach / sigma_s) ** 2)
    kernel = np.convolve(late / late.sum(), normal / normal.sum(), mode="same")  # of effect minus cause
    total = np.concatenate([[0.0], np.cumsum(kernel)])
    edge = reach[0] - 0.5 * step + step * np.arange(len(total))
    high = np.interp(max(high_s, low_s + step) - grid_s, edge, total)
    return np.asarray(np.clip(high - np.interp(low_s - grid_s, edge, total), 0.0, None))


def or_before(likelihood: FloatArray, share: float, mean_s: float, step_s: float) -> FloatArray:
    """Return a likelihood whose cause came earlier in a share of cases, exponentially."""
    keep = float(np.exp(-step_s / mean_s))
    earlier = decaying_sum(1.0 - keep, keep, likelihood[::-1])[::-1]
    return np.asarray((1.0 - share) * likelihood + share * earlier)


def decaying_sum(gain: float, keep: float, values: FloatArray) -> FloatArray:
    """Return ``total[k] = keep total[k - 1] + gain values[k]`` along the last axis.

    A plain loop: ``scipy.signal``, which has it as ``lfilter``, takes longer to import than a whole landing.
    """
    out = np.empty(values.shape)
    total = np.zeros(values.shape[:-1])
    for k in range(values.shape[-1]):
        out[..., k] = total = keep * total + gain * values[..., k]
    return out
