"""Pseudo-ranges that a session's aircraft measure, over the link and to satellites.

The link is shared in slots.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.simulation.satellites import elevation_deg, emission_ecef_m, orbit_of
from groundstation.simulation.session_errors import VehicleErrors
from groundstation.simulation.session_motion import AircraftMotion, fly, place_m
from groundstation.simulation.session_scenario import SessionAircraft, SessionPoint, SessionScenario
from groundstation.tables.session import Ranges, SatelliteRanges


@dataclass(frozen=True)
class SimulatedAircraft:
    """One aircraft with its motion and errors."""

    aircraft: SessionAircraft
    motion: AircraftMotion
    errors: VehicleErrors


def draw_ranges(
    scenario: SessionScenario, flown: Sequence[SimulatedAircraft], rng: np.random.Generator, scale: float
) -> Ranges:
    """Draw pseudo-ranges over the link.

    Each aircraft transmits in its slot, and all that hear it measure. Points transmit in the first slots of a frame,
    then aircraft in their order. Pseudo-range = distance + clock of the receiver - clock of the transmitter + bias of
    the receiver + noise; points keep the session's time.
    """
    link = scenario.link
    per_frame = round(link.frame_s / link.slot_s)
    frames = int((len(flown[0].motion.time_s) - 1) // per_frame)
    bias = dict(zip((one.aircraft.name for one in flown), link.bias_m * rng.standard_normal(len(flown)), strict=True))
    rows: list[tuple[FloatArray, ...]] = []
    names: list[tuple[str, str]] = []
    transmitters: list[SessionPoint | SimulatedAircraft] = [*scenario.points, *flown]
    for slot, transmitter in enumerate(transmitters):
        at = slot + per_frame * np.arange(frames)
        source = transmitter.aircraft if isinstance(transmitter, SimulatedAircraft) else transmitter
        for receiver in flown:
            if receiver is transmitter or (receiver.aircraft.hears and source.name not in receiver.aircraft.hears):
                continue
            time_s = receiver.motion.time_s[at]
            there = _is_present(source, time_s) & _is_present(receiver.aircraft, time_s)
            true = _pseudorange(scenario, transmitter, receiver, at)
            noise, lost = rng.standard_normal((2, frames)), rng.random((2, frames))
            error = link.range_sigma_m * noise[0] + np.where(lost[1] < link.outlier_share, link.outlier_m * noise[1], 0)
            read = true + scale * (error + bias[receiver.aircraft.name])
            if link.quantum_m > 0.0 and scale > 0.0:
                read = link.quantum_m * np.rint(read / link.quantum_m)
            heard = there & (lost[0] >= link.lost_share)
            rows.append((time_s[heard], read[heard], at[heard].astype(np.float64)))
            names.append((receiver.aircraft.name, source.name))
    return _in_order(rows, names, link.range_sigma_m)


def _pseudorange(
    scenario: SessionScenario,
    transmitter: "SessionPoint | SimulatedAircraft",
    receiver: SimulatedAircraft,
    at: "np.ndarray",
) -> FloatArray:
    """Return the true distance with both clocks in it, at places of the grid."""
    place, clock = receiver.motion.position_m[at], receiver.errors.clock_m[at]
    if isinstance(transmitter, SimulatedAircraft):
        distance = np.linalg.norm(place - transmitter.motion.position_m[at], axis=1)
        return np.asarray(distance + clock - transmitter.errors.clock_m[at])
    return np.asarray(np.linalg.norm(place - place_m(scenario, transmitter), axis=1) + clock)


def _is_present(one: SessionAircraft | SessionPoint, time_s: FloatArray) -> BoolArray:
    return np.asarray((time_s >= one.appears_s) & (time_s <= one.leaves_s))


def _in_order(rows: list[tuple[FloatArray, ...]], names: list[tuple[str, str]], sigma_m: float) -> Ranges:
    """Return one table in order of time; rows of one slot in the order of the receivers."""
    if not rows:
        return Ranges.none()
    time_s, read, slot = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    counts = [len(part[0]) for part in rows]
    receiver = np.repeat(np.array([name for name, _ in names]), counts)
    source = np.repeat(np.array([name for _, name in names]), counts)
    order = np.argsort(slot, kind="stable")
    return Ranges(
        time_s[order],
        receiver[order],
        source[order],
        read[order],
        np.full(len(order), sigma_m),
        slot[order].astype(np.int64),
    )


def draw_satellite_ranges(
    scenario: SessionScenario, flown: Sequence[SimulatedAircraft], rng: np.random.Generator, scale: float
) -> SatelliteRanges:
    """Pseudo-ranges to the satellites above the mask, at the start of every frame."""
    parts: list[tuple[FloatArray, ...]] = []
    names: list[tuple[str, str]] = []
    for one in flown:
        for name in one.aircraft.satellites:
            at, position, distance = _sight(scenario, one.aircraft, name)
            noise = scale * scenario.satellite.range_sigma_m * rng.standard_normal(len(at))
            read = distance + one.errors.receiver_clock_m[at] + noise
            parts.append((one.motion.time_s[at], read, position))
            names.append((one.aircraft.name, name))
    if not parts:
        return SatelliteRanges.none()
    time_s, read, position = (np.concatenate(item) for item in zip(*parts, strict=True))
    counts = [len(part[0]) for part in parts]
    receiver = np.repeat(np.array([name for name, _ in names]), counts)
    satellite = np.repeat(np.array([name for _, name in names]), counts)
    order = np.argsort(time_s, kind="stable")
    sigma = np.full(len(order), scenario.satellite.range_sigma_m)
    return SatelliteRanges(time_s[order], receiver[order], satellite[order], read[order], sigma, position[order])


@lru_cache(maxsize=256)  # without randomness, like the motion: the runs of a study share it
def _sight(
    scenario: SessionScenario, aircraft: SessionAircraft, name: str
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return the grid places at which one satellite is received, its position, its distance.

    The position is that at emission.
    """
    motion, settings = fly(scenario, aircraft), scenario.satellite
    per_frame = round(scenario.link.frame_s / scenario.link.slot_s)
    at = np.arange(0, len(motion.time_s), per_frame)
    at = at[_is_present(aircraft, motion.time_s[at])]
    start_utc_ns, _ = iso_to_utc_ns(settings.start_utc)
    position, distance = emission_ecef_m(orbit_of(name), start_utc_ns, motion.time_s[at], motion.position_m[at])
    up = elevation_deg(position, motion.position_m[at], motion.axes[at][:, :, 2]) >= settings.mask_deg
    return at[up], position[up], distance[up]
