"""Canonical topics from UBX messages.

``gnss`` comes by epochs, ``ins`` where the receiver knows the vehicle's heading.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.receiver.credible import credible_attitude, credible_dilution, credible_position
from groundstation.readers.receiver.messages import Columns, MessagesByName, occupied
from groundstation.readers.receiver.tally import MOVING_MPS, StreamTally
from groundstation.readers.receiver.times import Anchors
from groundstation.readers.receiver.ubx import time_of
from groundstation.readers.receiver.ubx_signals import signals

DEAD_RECKONING, FIX_2D, FIX_3D, WITH_SENSORS = 1, 2, 3, 4
FLOAT, FIXED = 1, 2
MM = 1e-3
FIRST_SOLUTION = ("NAV-PVT", "NAV-PVAT", "NAV-HPPOSLLH", "NAV-POSLLH")
OTHER_SOLUTIONS = ("HNR-PVT", "NAV2-PVT", "NAV2-PVAT", "NAV2-POSLLH")
POSITION_SOURCES = (*FIRST_SOLUTION, *OTHER_SOLUTIONS)  # the first that a log has leads
ATTITUDE_SOURCES = ("NAV-PVAT", "NAV-ATT", "NAV-RELPOSNED", "NAV-PVT", "HNR-ATT", "HNR-PVT")
_FIXES = np.array(["none", "dead_reckoning", "2d", "3d", "gnss_ins", "none", "other"])  # the last but one: time only
# Upper ends of the classes of NAV-PVT.flags3.lastCorrectionAge: 0 is unknown, the last is 120 s and more.
_CORRECTION_AGE_S = np.array([0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 120.0])
_UPRIGHT = {"altitude_ellipsoid_m", "altitude_msl_m", "vertical_sigma_m", "velocity_down_mps"}
_MOVING = {
    *("latitude_deg", "longitude_deg", "horizontal_sigma_m", "velocity_north_mps", "velocity_east_mps"),
    *("ground_speed_mps", "track_deg", "velocity_sigma_mps"),
}
SAME_DEG = 2e-5
INS_MODE = "gnss_aided"


def gnss_batch(block: MessagesByName, leader: str, anchors: Anchors, tally: StreamTally) -> RecordBatch | None:
    """Return one row for each epoch, from the leading message and others.

    The others are of the same solution and time of the week.
    """
    messages, fields = block.get(leader), block.fields(leader)
    if messages is None or fields is None:
        return None
    family = "NAV2" if leader.startswith("NAV2-") else "NAV"
    columns = _SOLUTIONS[leader](fields) if leader in _SOLUTIONS else _position(fields, _is_valid(fields))
    if leader not in _SOLUTIONS:
        columns |= _added(block, f"{family}-VELNED", fields, _velocity_ned)
        columns |= _added(block, f"{family}-SOL", fields, _old_solution)
        columns |= _added(block, f"{family}-STATUS", fields, _status)
        columns = _where_a_fix_is(columns)
    if family == "NAV":
        columns |= _precise(block, fields, columns)
        columns |= _added(block, "NAV-COV", fields, _spreads)
    columns = _added(block, f"{family}-DOP", fields, _dilution) | columns
    columns |= signals(block, family, fields)
    columns = credible_position(credible_dilution(columns), "gnss", messages.places, tally)
    return occupied("gnss", messages.places, time_of(messages, anchors), columns)


def ins_batch(block: MessagesByName, source: str, anchors: Anchors, tally: StreamTally) -> RecordBatch | None:
    """Return the attitude of the vehicle from the message that states it.

    Position and velocity stay those of ``gnss``.
    """
    messages, fields = block.get(source), block.fields(source)
    if messages is None or fields is None:
        return None
    columns = credible_attitude(_ATTITUDES[source](fields), messages.places, tally)
    heading = columns.get("true_heading_deg")
    if source in _RATES:
        columns |= _added(block, _RATES[source], fields, _rates)
    if heading is not None:
        columns["mode"] = Column(np.full(len(messages), INS_MODE), heading.present)
    return occupied("ins", messages.places, time_of(messages, anchors), columns)


def has_attitude(block: MessagesByName, source: str) -> bool:
    """Tell whether a message states the vehicle's heading at least once in a block."""
    fields = block.fields(source)
    heading = None if fields is None else _ATTITUDES[source](fields).get("true_heading_deg")
    return heading is not None and bool(heading.mask.any())


def heading_as_track(block: MessagesByName, source: str) -> tuple[int, int]:
    """Count the fixes of a moving vehicle whose heading equals its track, and all of them."""
    fields = block.fields(source)
    if fields is None or source != "NAV-PVAT":
        return 0, 0
    is_moving = fields["vehHeadingValid"] & (fields["gSpeed"] * MM > MOVING_MPS)
    apart_deg = wrap_180(fields["vehHeading"][is_moving] - fields["motHeading"][is_moving])
    return int((np.abs(apart_deg) <= SAME_DEG).sum()), int(is_moving.sum())


def _solution(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return columns of NAV-PVT and NAV-PVAT, also those of the second solution."""
    kind = fields["fixType"]
    is_ok = fields["gnssFixOk"] if "gnssFixOk" in fields else fields["gnssFixOK"]
    has_fix = (kind >= DEAD_RECKONING) & (kind <= WITH_SENSORS)
    has_height = has_fix & (kind != FIX_2D)
    has_place = has_fix & ~fields["invalidLlh"] if "invalidLlh" in fields else has_fix
    track = fields["headMot"] if "headMot" in fields else fields["motHeading"]
    columns = _position(fields, has_place, has_height & has_place)
    columns |= {
        "velocity_north_mps": Column(fields["velN"] * MM, has_fix),
        "velocity_east_mps": Column(fields["velE"] * MM, has_fix),
        "velocity_down_mps": Column(fields["velD"] * MM, has_height),
        "ground_speed_mps": Column(fields["gSpeed"] * MM, has_fix),
        "track_deg": Column(wrap_360(track), has_fix),
        "velocity_sigma_mps": Column(fields["sAcc"] * MM, has_fix),
        "satellites_used": Column(fields["numSV"].astype(np.float64)),
        "integrity_ok": _integrity(is_ok, kind),
        "fix": Column(_fix(kind, fields["carrSoln"], fields["diffSoln"])),
    }
    if "pDOP" in fields:
        columns["pdop"] = Column(fields["pDOP"], has_fix)
    if "lastCorrectionAge" in fields:
        age = fields["lastCorrectionAge"]
        known = has_fix & fields["diffSoln"] & (age > 0)
        columns["age_of_corrections_s"] = Column(_CORRECTION_AGE_S[np.minimum(age, len(_CORRECTION_AGE_S) - 1)], known)
    return columns


def _integrity(is_ok: NDArray[Any], kind: NDArray[Any]) -> Column:
    """Return the receiver's word on the fix.

    It is absent where a fix in two dimensions, whose height was assumed, is called good.
    """
    return Column(is_ok.copy(), ~(is_ok & (kind == FIX_2D)))


def _high_rate(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return columns of HNR-PVT: speed and track in place of velocities."""
    kind = fields["gpsFix"]
    has_fix = (kind >= DEAD_RECKONING) & (kind <= WITH_SENSORS)
    speed, track = fields["gSpeed"] * MM, wrap_360(fields["headMot"])
    north, east = velocity_from_track(track, speed)
    return _position(fields, has_fix, has_fix & (kind != FIX_2D)) | {
        "velocity_north_mps": Column(north, has_fix),
        "velocity_east_mps": Column(east, has_fix),
        "ground_speed_mps": Column(speed, has_fix),
        "track_deg": Column(track, has_fix),
        "velocity_sigma_mps": Column(fields["sAcc"] * MM, has_fix),
        "integrity_ok": _integrity(fields["GPSfixOK"], kind),
        "fix": Column(_fix(kind, np.zeros(len(kind), dtype=np.uint8), fields["DiffSoln"])),
    }


def _fix(kind: NDArray[Any], carrier: NDArray[Any], differential: BoolArray) -> NDArray[np.str_]:
    fixes: NDArray[np.str_] = _FIXES[np.minimum(kind, len(_FIXES) - 1)].astype("<U16")
    fixes[(kind == FIX_3D) & differential] = "dgnss"
    is_fix = (kind >= FIX_2D) & (kind <= WITH_SENSORS)
    fixes[is_fix & (carrier == FLOAT)] = "rtk_float"
    fixes[is_fix & (carrier == FIXED)] = "rtk_fixed"
    return fixes


def _is_valid(fields: Mapping[str, NDArray[Any]]) -> BoolArray:
    return np.asarray(~fields["invalidLlh"] if "invalidLlh" in fields else np.ones(len(fields["lat"]), dtype=bool))


def _position(fields: Mapping[str, NDArray[Any]], present: BoolArray, has_height: BoolArray | None = None) -> Columns:
    up = present if has_height is None else has_height
    return {
        "latitude_deg": Column(fields["lat"].astype(np.float64), present),
        "longitude_deg": Column(fields["lon"].astype(np.float64), present),
        "altitude_ellipsoid_m": Column(fields["height"] * MM, up),
        "altitude_msl_m": Column(fields["hMSL"] * MM, up),
        "horizontal_sigma_m": Column(fields["hAcc"] * MM, present),
        "vertical_sigma_m": Column(fields["vAcc"] * MM, up),
    }


def _precise(block: MessagesByName, fields: Mapping[str, NDArray[Any]], columns: Columns) -> Columns:
    """Return the finer position of NAV-HPPOSLLH where it is valid and of the same epoch.

    Elsewhere it is that of the leading message.
    """
    precise = block.fields("NAV-HPPOSLLH")
    if precise is None:
        return {}
    at, known = _same_epoch(fields, precise)
    finer = _position(precise, _is_valid(precise))
    mixed = {}
    for name, column in finer.items():
        used = known & column.mask[at] & columns[name].mask
        mixed[name] = Column(np.where(used, column.values[at], columns[name].values), columns[name].present)
    return mixed


def _velocity_ned(fields: Mapping[str, NDArray[Any]]) -> Columns:
    names = {"velocity_north_mps": "velN", "velocity_east_mps": "velE", "velocity_down_mps": "velD"}
    names |= {"ground_speed_mps": "gSpeed", "velocity_sigma_mps": "sAcc"}
    columns = {name: Column(fields[source] * 1e-2) for name, source in names.items()}  # cm/s
    return columns | {"track_deg": Column(wrap_360(fields["heading"]))}


def _status(fields: Mapping[str, NDArray[Any]]) -> Columns:
    fix = Column(_fix(fields["gpsFix"], fields["carrSoln"], fields["diffSoln"]))
    return {"integrity_ok": _integrity(fields["gpsFixOk"], fields["gpsFix"]), "fix": fix}


def _old_solution(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return columns of NAV-SOL, which receivers had before NAV-PVT."""
    no_carrier = np.zeros(len(fields["gpsFix"]), dtype=np.uint8)
    return {
        "integrity_ok": _integrity(fields["gpsfixOK"], fields["gpsFix"]),
        "fix": Column(_fix(fields["gpsFix"], no_carrier, fields["diffSoln"])),
        "satellites_used": Column(fields["numSV"].astype(np.float64)),
        "pdop": Column(fields["pDOP"]),
    }


def _where_a_fix_is(columns: Columns) -> Columns:
    """Drop values that the fix of the epoch does not support.

    For messages without a fix of their own; a fix in two dimensions has no height.
    """
    if "fix" not in columns:
        return columns
    fix = columns["fix"]
    none, flat = fix.mask & (fix.values == "none"), fix.mask & (fix.values == "2d")
    refused = dict.fromkeys(columns.keys() & _MOVING, none) | dict.fromkeys(columns.keys() & _UPRIGHT, none | flat)
    return columns | {name: Column(columns[name].values, columns[name].mask & ~rows) for name, rows in refused.items()}


def _spreads(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the roots of the diagonals of NAV-COV, where the receiver calls them valid."""
    found: Columns = {}
    for kind, names in _COVARIANCES.items():
        for pair, name in names.items():
            variance = fields[f"{kind}Cov{pair}"].astype(np.float64)
            known = (fields[f"{kind}CovValid"] != 0) & (variance > 0.0) & np.isfinite(variance)
            found[name] = Column(np.sqrt(np.where(known, variance, 0.0)), known)
    return found


_COVARIANCES: Mapping[str, Mapping[str, str]] = {
    "pos": {"NN": "position_north_sigma_m", "EE": "position_east_sigma_m"},
    "vel": {
        "NN": "velocity_north_sigma_mps",
        "EE": "velocity_east_sigma_mps",
        "DD": "velocity_down_sigma_mps",
    },
}


def _dilution(fields: Mapping[str, NDArray[Any]]) -> Columns:
    return {name: Column(fields[source]) for name, source in (("gdop", "gDOP"), ("pdop", "pDOP"), ("hdop", "hDOP"))}


def _rates(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the rates of ESF-INS.

    Its accelerations are without gravity, no specific force, and stay raw.
    """
    return {f"rate_{axis}_dps": Column(fields[f"{axis}AngRate"], fields[f"{axis}AngRateValid"]) for axis in "xyz"}


def _of_pvat(fields: Mapping[str, NDArray[Any]]) -> Columns:
    columns: Columns = {}
    for name, part in (("roll", "Roll"), ("pitch", "Pitch"), ("true_heading", "Heading")):
        present = fields[f"veh{part}Valid"]
        columns[f"{name}_deg"] = Column(fields[f"veh{part}"], present)
        columns[f"{name}_sigma_deg"] = Column(fields[f"acc{part}"], present)
    return columns


def _of_att(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the angles; an accuracy of zero says that an angle is not known."""
    columns: Columns = {}
    for name, source in (("roll", "roll"), ("pitch", "pitch"), ("true_heading", "heading")):
        sigma = fields[f"acc{source.capitalize()}"]
        columns[f"{name}_deg"] = Column(fields[source], sigma > 0.0)
        columns[f"{name}_sigma_deg"] = Column(sigma, sigma > 0.0)
    return columns


def _of_relative(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the heading of the line from one antenna to the other.

    Absent where the base does not move: it is then not on this vehicle.
    """
    present = fields["relPosHeadingValid"] & fields["relPosValid"] & fields["isMoving"] & fields["gnssFixOK"]
    return {
        "true_heading_deg": Column(fields["relPosHeading"], present),
        "true_heading_sigma_deg": Column(fields["accHeading"], present),
    }


def _of_pvt(fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return the vehicle's heading by sensor fusion; without it the field is the track."""
    if "headVeh" not in fields:
        return {}
    return {"true_heading_deg": Column(fields["headVeh"], fields["headVehValid"])}


_ATTITUDES: Mapping[str, Callable[[Mapping[str, NDArray[Any]]], Columns]] = {
    "NAV-PVAT": _of_pvat,
    "NAV-ATT": _of_att,
    "NAV-RELPOSNED": _of_relative,
    "NAV-PVT": _of_pvt,
    "HNR-ATT": _of_att,
    "HNR-PVT": _of_pvt,
}
_RATES = {"NAV-PVAT": "ESF-INS", "NAV-ATT": "ESF-INS", "HNR-ATT": "HNR-INS"}
_SOLUTIONS: Mapping[str, Callable[[Mapping[str, NDArray[Any]]], Columns]] = {
    "NAV-PVT": _solution,
    "NAV-PVAT": _solution,
    "NAV2-PVT": _solution,
    "NAV2-PVAT": _solution,
    "HNR-PVT": _high_rate,
}


def _added(
    block: MessagesByName,
    name: str,
    fields: Mapping[str, NDArray[Any]],
    columns_of: Callable[[Mapping[str, NDArray[Any]]], Columns],
) -> Columns:
    """Return columns of another message, on the rows of the same epoch."""
    other = block.fields(name)
    if other is None:
        return {}
    at, known = _same_epoch(fields, other)
    return {key: Column(one.values[at], known & one.mask[at]) for key, one in columns_of(other).items()}


def _same_epoch(fields: Mapping[str, NDArray[Any]], other: Mapping[str, NDArray[Any]]) -> tuple[Int64Array, BoolArray]:
    """Find, for each row, the last row of another message with its time of the week.

    The second array tells whether there is one.
    """
    order = np.argsort(other["iTOW"], kind="stable")
    at = np.searchsorted(other["iTOW"], fields["iTOW"], side="right", sorter=order) - 1
    at = order[np.maximum(at, 0)]
    return at, np.asarray(other["iTOW"][at] == fields["iTOW"])
