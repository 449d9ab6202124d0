"""Screening of INS and GNSS: frozen or jumping receivers, INS resets, missing numbers."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.tables.motion import runs
from groundstation.tables.table import Flight, Table

CHANNEL_FIELDS = ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")
LONGEST_STEP_S = 120.0  # between two samples for a step of position to be held against the velocity
UNEXPLAINED = 0.03  # of the distance flown in the step: the velocity in between is not known
JUDGED_GAP_S = 60.0  # a difference may have moved anywhere in a longer gap of INS or GNSS: the filter judges that
DRIFT_MPS = 5.0  # by which a difference may grow unseen: 10 nmi/h
SIGMAS_OF_A_JUMP = 8.0
LISTED = 3


@dataclass(frozen=True)
class Resets:
    """Times of the first sample after each reset of the INS, and findings.

    The findings are on resets and on single samples.
    """

    time_ns: Int64Array
    findings: tuple[Finding, ...]


def unknown_values(flight: Flight, ins: Table, gnss: Table) -> Iterator[Finding]:
    """Findings on fields that are present in some rows and not a usable number in others."""
    for table in (ins, gnss):
        known = {name: np.isfinite(table.values(name)) for name in CHANNEL_FIELDS if table.has(name)}
        for name, mask in known.items():
            others = np.zeros(len(table), dtype=bool)
            for other in known:
                if other != name and other.split("_")[0] == name.split("_")[0]:
                    others |= known[other]
            missing = others & ~mask
            if missing.any():
                first = float(flight.seconds(table.time_ns[missing][:1])[0])
                text = f"{name}: no usable number in {counted(missing.sum(), 'sample')} that have the other channel"
                yield Finding("warn", "inertial.unknown", text, table.topic, f"from {first:.1f} s", int(missing.sum()))


def ins_jumps(flight: Flight, ins: Table, settings: InertialSettings) -> tuple[Table, Resets]:
    """Return the INS without single samples that jump and jump back at once, and its resets.

    A reset is a step of the INS position that its own velocity does not explain.
    """
    findings = []
    at = _steps(ins, settings.jump_m)
    outliers = at[:-1][np.diff(at) == 1]
    if outliers.size:
        times = flight.seconds(ins.time_ns[outliers])
        text = f"INS position off by {settings.jump_m:.0f} m or more in single samples: not used"
        place = f"{times[0]:.1f} to {times[-1]:.1f} s"
        findings.append(Finding("warn", "inertial.ins_outlier", text, ins.topic, place, int(outliers.size)))
        is_kept = np.ones(len(ins), dtype=bool)
        is_kept[outliers] = False
        ins = ins.take(is_kept)
        at = _steps(ins, settings.jump_m)
    if at.size:
        times = flight.seconds(ins.time_ns[at])
        listed = ", ".join(f"{time:.1f} s" for time in times[:LISTED]) + (" ..." if len(times) > LISTED else "")
        text = f"INS position jumps by {settings.jump_m:.0f} m or more against its own velocity: treated as a reset"
        findings.append(Finding("warn", "inertial.ins_reset", text, ins.topic, listed, int(at.size)))
    return ins, Resets(ins.time_ns[at], tuple(findings))


def unbelieved(
    flight: Flight,
    gnss: Table,
    ins_at_gnss: Table,
    position_m: FloatArray,
    reset_ns: Int64Array,
    settings: InertialSettings,
) -> tuple[BoolArray, list[Finding]]:
    """Find the GNSS samples that are not compared, shape (n,), and the findings on them.

    Findings say why, where and how many.
    """
    checks = (
        (_without_integrity(gnss), "inertial.gnss_integrity", "GNSS reports that it has no integrity"),
        (_frozen(flight, gnss, ins_at_gnss, settings), "inertial.gnss_frozen", "GNSS position frozen while moving"),
        (
            _displaced(flight, gnss, position_m, reset_ns, settings),
            "inertial.gnss_jump",
            f"GNSS position off by {settings.jump_m:.0f} m or more after a jump",
        ),
    )
    bad, findings = np.zeros(len(gnss), dtype=bool), []
    for mask, code, text in checks:
        fresh = mask & ~bad
        if fresh.any():
            times = flight.seconds(gnss.time_ns[fresh])
            place = f"{times[0]:.1f} to {times[-1]:.1f} s"
            findings.append(Finding("warn", code, f"{text}: not compared", gnss.topic, place, int(fresh.sum())))
        bad |= mask
    return bad, findings


def _steps(table: Table, limit_m: float) -> Int64Array:
    """Rows whose position is further from the row before than the mean velocity explains."""
    if len(table) < 2 or not table.has("latitude_deg", "longitude_deg"):
        return np.zeros(0, dtype=np.int64)
    known = np.flatnonzero(table.valid("latitude_deg", "longitude_deg"))
    latitude, longitude = table.values("latitude_deg")[known], table.values("longitude_deg")[known]
    seconds = np.diff(table.time_ns[known]) / NS_PER_S
    north = np.deg2rad(np.diff(latitude)) * SEMI_MAJOR_M
    east = np.deg2rad(wrap_180(np.diff(longitude))) * SEMI_MAJOR_M * np.cos(np.deg2rad(latitude[1:]))
    unexplained = np.zeros(len(seconds))
    for moved, name in ((north, "velocity_north_mps"), (east, "velocity_east_mps")):
        velocity = table.values(name)[known]
        if not np.isfinite(velocity).any():  # the position's own rate before the step is the next best
            velocity = np.concatenate([moved[:1] / seconds[:1], moved / seconds])
            velocity[1:] = velocity[:-1].copy()
        mean = 0.5 * (velocity[1:] + velocity[:-1])
        spread = 0.5 * np.abs(velocity[1:] - velocity[:-1]) * seconds  # the velocity may turn in between
        slack = spread + np.where(seconds > 2.0, UNEXPLAINED, 0.01) * np.abs(moved)
        unexplained += np.square(np.maximum(np.abs(moved - mean * seconds) - slack, 0.0))
    is_step = (np.sqrt(unexplained) > limit_m) & (seconds <= LONGEST_STEP_S)
    return known[1:][is_step]


def _without_integrity(gnss: Table) -> BoolArray:
    if "integrity_ok" not in gnss:
        return np.zeros(len(gnss), dtype=bool)
    column = gnss.columns["integrity_ok"]
    return np.asarray(column.mask & ~np.asarray(column.values, dtype=bool))


def _frozen(flight: Flight, gnss: Table, ins: Table, settings: InertialSettings) -> BoolArray:
    """Find samples whose position repeats for longer than ``frozen_s`` while the INS moves."""
    out = np.zeros(len(gnss), dtype=bool)
    if len(gnss) < 2 or not gnss.has("latitude_deg", "longitude_deg"):
        return out
    latitude, longitude = gnss.values("latitude_deg"), gnss.values("longitude_deg")
    speed = np.hypot(ins.values("velocity_north_mps"), ins.values("velocity_east_mps"))
    same = (np.diff(latitude) == 0.0) & (np.diff(longitude) == 0.0) & (speed[1:] > settings.frozen_speed_mps)
    time_s = flight.seconds(gnss.time_ns)
    for first, end in runs(same):
        if time_s[end] - time_s[first] >= settings.frozen_s:
            out[first + 1 : end + 1] = True  # the first of them was still true
    return out


def _displaced(
    flight: Flight, gnss: Table, position_m: FloatArray, reset_ns: Int64Array, settings: InertialSettings
) -> BoolArray:
    """Find samples in stretches that begin or end with a jump of the difference.

    The INS did not make that jump. The longest stretch is believed; from there on, forwards and backwards, every other
    that continues the last believed difference within ``jump_m`` and a slow drift.
    """
    known = np.flatnonzero(np.isfinite(position_m).all(axis=1))
    out = np.zeros(len(gnss), dtype=bool)
    if len(known) < 2:
        return out
    time_s, difference = flight.seconds(gnss.time_ns[known]), position_m[known]
    step_s, moved = np.diff(time_s), np.hypot(*np.diff(difference, axis=0).T)
    jump_m = max(settings.jump_m, SIGMAS_OF_A_JUMP * float(np.median(moved)))  # a noisy receiver jumps all the time
    allowed = np.where(step_s > JUDGED_GAP_S, np.inf, jump_m + DRIFT_MPS * step_s)
    resets = np.searchsorted(gnss.time_ns[known], reset_ns)  # the INS jumped there: not the receiver's fault
    is_reset = np.zeros(len(known) + 1, dtype=bool)
    is_reset[resets] = True
    is_jump = (moved > allowed) & ~is_reset[1 : len(known)]
    if not is_jump.any():
        return out
    bounds = [0, *(np.flatnonzero(is_jump) + 1).tolist(), len(known)]
    pieces = list(pairwise(bounds))
    anchor = max(range(len(pieces)), key=lambda index: pieces[index][1] - pieces[index][0])
    believed = {anchor}
    for order in (range(anchor + 1, len(pieces)), range(anchor - 1, -1, -1)):
        last = anchor
        for index in order:
            forward = index > last
            here = pieces[index][0] if forward else pieces[index][1] - 1
            there = pieces[last][1] - 1 if forward else pieces[last][0]
            span = slice(min(here, there) + 1, max(here, there) + 1)
            if is_reset[span].any():
                believed.add(index)
                last = index
                continue
            away, apart_s = float(np.hypot(*(difference[here] - difference[there]))), abs(time_s[here] - time_s[there])
            if away <= jump_m + DRIFT_MPS * apart_s:
                believed.add(index)
                last = index
    for index, (first, end) in enumerate(pieces):
        if index not in believed:
            out[known[first:end]] = True
    return out
