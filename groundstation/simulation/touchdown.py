"""Simulated touchdowns: flare, contact and roll-out as the channels of a log show them.

The motion is along a straight runway whose ground rises and is not plane.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import MPS2_PER_G, NS_PER_S
from groundstation.simulation.processes import gauss_markov
from groundstation.tables.table import Flight, Table

MOTION_HZ = 100.0
BEFORE_S, AFTER_S = 90.0, 40.0
START_UTC = "2026-05-04T06:00:00Z"
GLIDE_RAD = np.deg2rad(3.0)
FELT_S, IMPACT_S, STRUT_HZ = 10.0, 0.25, 1.4  # the slope of the runway is followed so long before the contact
SPIN_UP_S = 0.3


@dataclass(frozen=True, kw_only=True)
class TouchdownMotion:
    """True motion about the contact; speeds are relative to the runway.

    ``nose_after_s`` is when the nose begins to fall (None: it does not), ``bounce_s`` how long the aircraft is in the
    air once more, ``kink`` the change of the runway's slope at the contact, ``gust_g`` a jump of the load ``gust_s``
    before it.
    """

    speed_mps: float = 60.0
    sink_mps: float = 1.0
    flare_s: float = 4.0
    float_s: float = 0.0
    slope: float = 0.0
    kink: float = 0.0
    uneven: float = 0.0025
    flare_pitch_deg: float = 3.0
    nose_after_s: float | None = 1.0
    turbulence_g: float = 0.03
    gust_g: float = 0.0
    gust_s: float = 2.0
    bounce_s: float = 0.0
    impact_g: float = 0.05
    impact_g_per_mps: float = 0.25


@dataclass(frozen=True, kw_only=True)
class TouchdownChannels:
    """Channels of the log: rates (0: not logged), noise, delays."""

    load_hz: float = 8.0
    load_noise_g: float = 0.02
    pitch_hz: float = 4.0
    wheels_hz: float = 1.0
    wheels_late_s: float = 0.4
    wheel_speed_hz: float = 0.0
    receiver_hz: float = 1.0
    has_altitude: bool = True
    has_vertical_speed: bool = True
    receiver_late_s: float = 0.3
    radio_hz: float = 1.0
    radio_step_m: float = 0.1
    nose_up_m: float = 0.5


@dataclass(frozen=True, eq=False)
class SimulatedTouchdown:
    """Log of a touchdown, and the values that an analysis should find."""

    flight: Flight
    contact_s: float
    sink_mps: float
    slope: float
    second_contact_s: float | None


@dataclass(frozen=True, eq=False)
class _Truth:
    time_s: FloatArray
    along_m: FloatArray
    speed_mps: FloatArray
    above_m: FloatArray
    ground_m: FloatArray
    load_g: FloatArray
    pitch_deg: FloatArray
    nose_share: FloatArray


def simulate_touchdown(
    motion: TouchdownMotion, channels: TouchdownChannels, rng: np.random.Generator
) -> SimulatedTouchdown:
    """Fly and record a touchdown. The same arguments and generator give the same log."""
    contact_s = BEFORE_S + float(rng.uniform(0.0, 1.0))
    truth = _truth(motion, contact_s, rng)
    tables = _recorded(truth, motion, channels, contact_s, rng)
    start_ns = iso_to_utc_ns(START_UTC)[0]
    flight = Flight(
        {topic: _table(topic, start_ns, *rows) for topic, rows in tables.items()},
        {"aircraft": "simulated", "flight": "touchdown", "start_utc": START_UTC},
        start_ns,
        has_utc=True,
        source_name="touchdown.csv",
    )
    second = contact_s + 0.3 + motion.bounce_s if motion.bounce_s > 0.0 else None
    return SimulatedTouchdown(flight, contact_s, motion.sink_mps, motion.slope, second)


def _truth(motion: TouchdownMotion, contact_s: float, rng: np.random.Generator) -> _Truth:
    time_s = np.arange(0.0, BEFORE_S + AFTER_S, 1.0 / MOTION_HZ)
    to_go = contact_s - time_s
    before = np.clip(to_go, 0.0, None)
    braking = np.where(time_s > contact_s + 3.0, 2.0, 0.7) * (to_go < 0.0)
    slowing = np.where((before > 0.0) & (before < motion.flare_s), 0.4, 0.0)
    late = np.cumsum(braking) / MOTION_HZ
    speed = np.maximum(motion.speed_mps - late + (np.sum(slowing) - np.cumsum(slowing)) / MOTION_HZ, 3.0)
    along = np.cumsum(speed) / MOTION_HZ
    along = along - np.interp(contact_s, time_s, along)
    # Height above the runway: float at the last sink rate, flare in which it grows to that of the glide path.
    glide = motion.speed_mps * np.tan(GLIDE_RAD)
    flared = np.clip(before - motion.float_s, 0.0, motion.flare_s)
    beyond = np.clip(before - motion.float_s - motion.flare_s, 0.0, None)
    growth = (glide - motion.sink_mps) / motion.flare_s
    above = motion.sink_mps * np.minimum(before, motion.float_s + motion.flare_s)
    above = above + 0.5 * growth * flared**2 + glide * beyond
    bounce = np.zeros(len(time_s))
    if motion.bounce_s > 0.0:
        share = np.clip((-to_go - 0.3) / motion.bounce_s, 0.0, 1.0)
        bounce = 0.5 * MPS2_PER_G * 0.3 * motion.bounce_s**2 * share * (1.0 - share)
    step_m = motion.speed_mps / MOTION_HZ
    rises = motion.slope + motion.kink * (to_go < 0.0)
    wander = gauss_markov(rng, (len(time_s),), step_m, motion.uneven, 150.0) * (to_go < FELT_S)
    ground = np.cumsum((rises + wander) * np.gradient(along))
    ground = ground - np.interp(contact_s, time_s, ground)
    load = _load(motion, time_s, contact_s, rng)
    nose = np.zeros(len(time_s)) if motion.nose_after_s is None else np.clip(-to_go - motion.nose_after_s, 0.0, None)
    down = np.clip(nose * 2.0 / max(motion.flare_pitch_deg, 0.1), 0.0, 1.0)
    raised = np.clip(1.0 - (before - motion.float_s) / motion.flare_s, 0.0, 1.0)
    sway = gauss_markov(rng, (len(time_s),), 1.0 / MOTION_HZ, 0.3, 1.5) * (to_go > 0.0)
    pitch = motion.flare_pitch_deg * (0.3 + 0.7 * raised) * (1.0 - down) + sway
    return _Truth(time_s, along, speed, above + bounce, ground, load, pitch, 1.0 - down)


def _load(motion: TouchdownMotion, time_s: FloatArray, contact_s: float, rng: np.random.Generator) -> FloatArray:
    """Normal acceleration: turbulence in the air, impact, struts, rumble."""
    since = time_s - contact_s
    count = (len(time_s),)
    load = 1.0 + gauss_markov(rng, count, 1.0 / MOTION_HZ, motion.turbulence_g, 0.7) * np.where(since < 0.0, 1.0, 0.3)
    in_flare = (since > -motion.flare_s - motion.float_s) & (since < -motion.float_s)
    glide = motion.speed_mps * np.tan(GLIDE_RAD)
    load = load + in_flare * max(glide - motion.sink_mps, 0.0) / motion.flare_s / MPS2_PER_G
    load = load + gauss_markov(rng, count, 1.0 / MOTION_HZ, 0.04, 0.05) * (since > 0.0)
    load = load + motion.gust_g * np.exp(-np.abs(since + motion.gust_s) / 0.15)
    blows = [(0.0, motion.sink_mps)]
    if motion.bounce_s > 0.0:
        blows.append((0.3 + motion.bounce_s, motion.sink_mps))
        load = np.where((since > 0.3) & (since < 0.3 + motion.bounce_s), load - 0.3, load)
    for at, sink in blows:
        size = motion.impact_g + motion.impact_g_per_mps * sink
        u = since - at
        load = load + size * np.sin(np.pi * np.clip(u / IMPACT_S, 0.0, 1.0))
        rest = np.clip(u - IMPACT_S, 0.0, None)
        load = load - 0.4 * size * np.exp(-rest / 0.5) * np.sin(2.0 * np.pi * STRUT_HZ * rest) * (u > IMPACT_S)
    return np.asarray(load)


def _recorded(
    truth: _Truth, motion: TouchdownMotion, channels: TouchdownChannels, contact_s: float, rng: np.random.Generator
) -> dict[str, tuple[FloatArray, dict[str, FloatArray]]]:
    last_s = float(truth.time_s[-1])

    def times(rate_hz: float) -> FloatArray:
        return np.arange(float(rng.uniform(0.0, 1.0 / rate_hz)), last_s, 1.0 / rate_hz)

    def at(values: FloatArray, when: FloatArray) -> FloatArray:
        return np.interp(when, truth.time_s, values)

    def noise(when: FloatArray, sigma: float) -> FloatArray:
        return sigma * rng.standard_normal(len(when))

    altitude = truth.ground_m + truth.above_m
    when = times(channels.receiver_hz)
    shown = when - channels.receiver_late_s
    north, east = np.cos(0.5) * at(truth.along_m, shown), np.sin(0.5) * at(truth.along_m, shown)
    latitude, longitude = latitude_longitude_deg(north, east, 50.0, 10.0)
    receiver = {"latitude_deg": latitude, "longitude_deg": longitude, "ground_speed_mps": at(truth.speed_mps, shown)}
    slow = gauss_markov(rng, (len(when),), 1.0 / channels.receiver_hz, 0.5, 60.0)
    if channels.has_altitude:
        receiver["altitude_msl_m"] = 100.0 + at(altitude, shown) + slow + noise(when, 0.1)
    if channels.has_vertical_speed:
        smooth = np.convolve(-np.gradient(altitude, truth.time_s), np.full(21, 1.0 / 21.0), mode="same")
        receiver["velocity_down_mps"] = at(smooth, shown) + noise(when, 0.1)
    tables = {"gnss": (when, receiver)}
    if channels.load_hz:
        when = times(channels.load_hz)
        load = at(truth.load_g, when) + noise(when, channels.load_noise_g)
        tables["ins.accelerometer"] = when, {"accel_z_mps2": -load * MPS2_PER_G}
    if channels.pitch_hz:
        when = times(channels.pitch_hz)
        tables["ins"] = when, {"pitch_deg": at(truth.pitch_deg, when) + noise(when, 0.1)}
    if channels.radio_hz:
        when = times(channels.radio_hz)
        read = at(truth.above_m, when) + channels.nose_up_m * at(truth.nose_share, when) - 0.3 + noise(when, 0.1)
        height = np.round(read / channels.radio_step_m) * channels.radio_step_m
        tables["radio_altimeter"] = when, {"height_m": np.where(read < 750.0, height, np.nan)}
    discrete: dict[str, FloatArray] = {}
    if channels.wheels_hz:
        when = times(channels.wheels_hz)
        discrete["weight_on_wheels"] = (when > contact_s + channels.wheels_late_s).astype(float)
        tables["discrete"] = when, discrete
    elif channels.wheel_speed_hz:
        when = times(channels.wheel_speed_hz)
        spun = np.clip((when - contact_s) / SPIN_UP_S, 0.0, 1.0)
        tables["discrete"] = when, {"wheel_speed_mps": spun * at(truth.speed_mps, when)}
    return tables


def _table(topic: str, start_ns: int, time_s: FloatArray, columns: Mapping[str, FloatArray]) -> Table:
    time_ns = np.round(time_s * NS_PER_S).astype(np.int64)
    return Table(
        topic,
        time_ns + start_ns,
        {
            name: Column(values != 0.0 if name == "weight_on_wheels" else values, _present(values))
            for name, values in columns.items()
        },
        np.arange(len(time_ns), dtype=np.int64),
        Column(time_ns),
    )


def _present(values: FloatArray) -> "np.ndarray | None":
    known = np.isfinite(values)
    return None if known.all() else known
