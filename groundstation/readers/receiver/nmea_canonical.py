"""Canonical topics from NMEA sentences.

``gnss`` comes by epochs, ``ins`` from the sentences that state the heading.
"""

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.records import BoolArray, Column, RecordBatch
from groundstation.base.sorted_values import distinct
from groundstation.base.units import MPS_PER_KMH, MPS_PER_KNOT
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.receiver.credible import HEADINGS, credible_attitude, credible_dilution, credible_position
from groundstation.readers.receiver.messages import Columns, merged, occupied
from groundstation.readers.receiver.nmea import SentenceEpochs
from groundstation.readers.receiver.nmea_dilution import dilution
from groundstation.readers.receiver.nmea_makers import makers_solution
from groundstation.readers.receiver.sentence_layouts import STANDARD_POSITIONS
from groundstation.readers.receiver.sentences import Sentences
from groundstation.readers.receiver.tally import ASTRAY, MOST_SEPARATION_M, NOT_MEASURED, StreamTally

HEADING_FORMATTERS = ("PASHR", "HDT", "THS", "HDM")  # the first of which a log tells a heading is ``ins``
_TWO_DIMENSIONS = 2
_HEIGHTS = ("altitude_msl_m", "altitude_ellipsoid_m", "vertical_sigma_m")
_FIXES = np.array(
    ["none", "3d", "dgnss", "rtk_fixed", "rtk_float", "ppp", "dead_reckoning", "manual", "simulated", "other", "2d"]
)
_NONE, _AUTONOMOUS, _DIFFERENTIAL, _FIXED, _FLOAT, _PPP, _ESTIMATED, _MANUAL, _SIMULATED, _OTHER, _FLAT = range(11)
_BY_GNSS = np.isin(np.arange(len(_FIXES)), (_AUTONOMOUS, _DIFFERENTIAL, _FIXED, _FLOAT, _PPP, _FLAT))
_PLAIN = np.isin(np.arange(len(_FIXES)), (_AUTONOMOUS, _DIFFERENTIAL))
_BY_HAND = np.isin(np.arange(len(_FIXES)), (_MANUAL, _SIMULATED))
_OF_QUALITY = np.full(12, _OTHER)  # by the quality of GGA, 0 to 10; others are unknown
_OF_QUALITY[:6] = _NONE, _AUTONOMOUS, _DIFFERENTIAL, _AUTONOMOUS, _FIXED, _FLOAT
_OF_QUALITY[6:11] = _ESTIMATED, _MANUAL, _SIMULATED, _DIFFERENTIAL, _PPP
# Letters of a mode by rank: GNS has one for each system, and the highest counts; 0 no letter, 2 one that is not known.
_KIND_OF_RANK = np.array(
    [_NONE, _NONE, _OTHER, _SIMULATED, _MANUAL, _ESTIMATED, _AUTONOMOUS, _AUTONOMOUS, _DIFFERENTIAL, _FLOAT, _FIXED]
)
_RANKS = np.full(128, 2)
_RANKS[[0, *map(ord, "NSMEAPDFR")]] = 0, 1, 3, 4, 5, 6, 7, 8, 9, 10


def gnss_batch(epochs: SentenceEpochs, time: Column, tally: StreamTally) -> RecordBatch | None:
    """Return one row for each epoch that has a fix, or says that it has none."""
    columns = makers_solution(epochs)
    for formatter in STANDARD_POSITIONS:  # the last that has a position gives it
        columns |= merged(columns, _position(epochs, formatter))
    _add_heights(epochs, columns, tally)
    columns |= _velocity(epochs)
    columns |= credible_dilution(_quality(epochs, tally)) | _signals(epochs)
    _add_solution(epochs, columns, tally)
    columns |= _age(epochs, columns["fix"])
    columns = credible_position(columns, "gnss", epochs.places, tally)
    columns = {name: column for name, column in columns.items() if column.mask.any()}
    if not len(epochs) or not columns:
        return None
    rows: BoolArray = np.logical_or.reduce([column.mask for column in columns.values()])
    return RecordBatch("gnss", epochs.places, time, columns).take(rows)


_VALIDITY = {"GGA": ("quality",), "RMC": ("status", "posMode"), "GLL": ("status", "posMode"), "GNS": ("posMode",)}


def _position(epochs: SentenceEpochs, formatter: str) -> Columns:
    found = epochs.values(formatter, ("lat", "lon", *_VALIDITY[formatter]))
    if not found:
        return {}
    present = found["lat"].mask & found["lon"].mask & _has_fix(formatter, found)
    return {
        "latitude_deg": Column(found["lat"].values, present),
        "longitude_deg": Column(found["lon"].values, present),
    }


def _has_fix(formatter: str, found: Columns) -> BoolArray:
    """Tell whether a sentence says that its fix is valid.

    Mode N says that it is not, whatever the status.
    """
    if formatter == "GGA":
        return np.asarray(found["quality"].mask & (found["quality"].values > 0))
    mode = found["posMode"]
    if formatter == "GNS":
        return np.asarray(mode.mask & (np.char.strip(mode.values.astype(str), "N") != ""))
    status = found["status"]
    return np.asarray(status.mask & (status.values == "A") & ~(mode.mask & (mode.values == "N")))


def _add_heights(epochs: SentenceEpochs, columns: Columns, tally: StreamTally) -> None:
    """Add the heights of GGA or GNS, metres above the sea and above the ellipsoid.

    The latter needs the separation. Where the separation cannot be one the sum is the height above the ellipsoid all
    the same, and the height above the sea is left out.
    """
    for formatter in ("GNS", "GGA"):
        units = ("altUnit", "sepUnit") if formatter == "GGA" else ()
        found = epochs.values(formatter, ("alt", "sep", *_VALIDITY[formatter], *units))
        if not found:
            continue
        valid = _has_fix(formatter, found)
        for unit in units:
            valid &= ~found[unit].mask | (found[unit].values == "M")
        has_height, has_both = found["alt"].mask & valid, found["alt"].mask & found["sep"].mask & valid
        is_astray = has_both & (np.abs(found["sep"].values) > MOST_SEPARATION_M)
        values = {name: found[name].values[is_astray] for name in ("alt", "sep")}
        tally.add(ASTRAY, "gnss", epochs.places[is_astray], **values)
        heights = {
            "altitude_msl_m": Column(found["alt"].values, has_height & ~is_astray),
            "altitude_ellipsoid_m": Column(found["alt"].values + found["sep"].values, has_both),
        }
        columns |= merged(columns, heights)


def _velocity(epochs: SentenceEpochs) -> Columns:
    """Return speed and track of RMC, which has a time, or of VTG where RMC has none.

    Absent where an epoch has no valid fix.
    """
    told: Columns = {}
    invalid: BoolArray = np.zeros(len(epochs), dtype=bool)
    found = epochs.values("RMC", ("spd", "cog", *_VALIDITY["RMC"]))
    if found:
        invalid = found["status"].mask & ~_has_fix("RMC", found)
        told["ground_speed_mps"] = Column(found["spd"].values * MPS_PER_KNOT, found["spd"].mask & ~invalid)
        told["track_deg"] = Column(found["cog"].values, found["cog"].mask & ~invalid)
    elif quality := epochs.values("GGA", ("quality",)):
        invalid = quality["quality"].mask & (quality["quality"].values == 0)
    if not all((one.mask | invalid).all() for one in told.values()) or not told:
        made_good = _of_track_made_good(epochs.values("VTG", _TRACK_MADE_GOOD))
        told = made_good | merged(made_good, told)
    if not told:
        return {}
    speed, track = (Column(told[name].values, told[name].mask & ~invalid) for name in ("ground_speed_mps", "track_deg"))
    north, east = velocity_from_track(track.values, speed.values)
    moving = speed.mask & track.mask
    return {
        "ground_speed_mps": speed,
        "track_deg": Column(wrap_360(track.values), track.mask),
        "velocity_north_mps": Column(north, moving),
        "velocity_east_mps": Column(east, moving),
    }


_TRACK_MADE_GOOD = ("cogt", "cogtUnit", "cogm", "cogmUnit", "sogn", "sognUnit", "sogk", "sogkUnit", "posMode")
_SPEED_UNITS = {"N": MPS_PER_KNOT, "K": MPS_PER_KMH}


def _of_track_made_good(found: Columns) -> Columns:
    """Return speed and true track of VTG by the units that it states.

    A sentence without units has each value in its usual place.
    """
    if not found:
        return {}
    valid = ~(found["posMode"].mask & (found["posMode"].values == "N"))
    in_knots, in_kmh = _speed(found["sogn"], found["sognUnit"], "N"), _speed(found["sogk"], found["sogkUnit"], "K")
    first, second = _true(found["cogt"], found["cogtUnit"], "T"), _true(found["cogm"], found["cogmUnit"], "M")
    speed, track = merged({"": in_kmh}, {"": in_knots})[""], merged({"": second}, {"": first})[""]
    return {
        "ground_speed_mps": Column(speed.values, speed.mask & valid),
        "track_deg": Column(track.values, track.mask & valid),
    }


def _speed(value: Column, unit: Column, usual: str) -> Column:
    letters = np.where(unit.mask, unit.values, usual)
    factor = np.select([letters == letter for letter in _SPEED_UNITS], list(_SPEED_UNITS.values()), 0.0)
    return Column(value.values * factor, value.mask & (factor > 0.0))


def _true(value: Column, unit: Column, usual: str) -> Column:
    return Column(value.values, value.mask & (np.where(unit.mask, unit.values, usual) == "T"))


def _quality(epochs: SentenceEpochs, tally: StreamTally) -> Columns:
    columns = dilution(epochs, tally)
    for formatter in ("GNS", "GGA"):
        found = epochs.values(formatter, ("numSV",))
        if found:
            columns |= merged(columns, {"satellites_used": found["numSV"]})
    spread = epochs.values("GST", ("stdLat", "stdLong", "stdAlt"))
    if spread:
        both = spread["stdLat"].mask & spread["stdLong"].mask
        columns["horizontal_sigma_m"] = Column(np.hypot(spread["stdLat"].values, spread["stdLong"].values), both)
        columns["vertical_sigma_m"] = spread["stdAlt"]
        columns |= {"position_north_sigma_m": spread["stdLat"], "position_east_sigma_m": spread["stdLong"]}
    return columns


def _signals(epochs: SentenceEpochs) -> Columns:
    """Return satellites tracked and the mean C/N0 of their signals, of the GSV of an epoch.

    A satellite without a C/N0 is in view and not tracked.
    """
    owners, satellites, strengths = [], [], []
    for number, (sentences, epoch) in enumerate(epochs.of("GSV")):
        for place in range(1, 5):
            name, strength = sentences.columns[f"svid_0{place}"], sentences.columns[f"cno_0{place}"]
            rows = (epoch >= 0) & name.mask & strength.mask & (strength.values > 0.0)
            owners.append(epoch[rows])
            satellites.append(number * 1_000.0 + np.clip(name.values[rows], 0.0, 999.0))
            strengths.append(strength.values[rows])
    if not owners or not sum(map(len, owners)):
        return {}
    owner, strength_dbhz = np.concatenate(owners), np.concatenate(strengths)
    pairs = distinct(owner * 1_000_000 + np.concatenate(satellites).astype(np.int64))
    tracked = np.bincount(pairs // 1_000_000, minlength=len(epochs)).astype(np.float64)
    number_of = np.bincount(owner, minlength=len(epochs))
    mean_dbhz = np.bincount(owner, weights=strength_dbhz, minlength=len(epochs)) / np.maximum(number_of, 1)
    return {"satellites_tracked": Column(tracked, number_of > 0), "cn0_dbhz": Column(mean_dbhz, number_of > 0)}


def _age(epochs: SentenceEpochs, fix: Column) -> Columns:
    """Return the age of the corrections by GGA or GNS.

    Without a fix that uses them it is a filler.
    """
    corrected = fix.mask & np.isin(fix.values, ("dgnss", "rtk_float", "rtk_fixed"))
    columns: Columns = {}
    for formatter in ("GNS", "GGA"):
        found = epochs.values(formatter, ("diffAge",))
        if found:
            age = found["diffAge"]
            columns |= merged(columns, {"age_of_corrections_s": Column(age.values, age.mask & corrected)})
    return columns


def _add_solution(epochs: SentenceEpochs, columns: Columns, tally: StreamTally) -> None:
    """Add the kind of the fix, and whether GNSS gives it.

    The latter is absent for a fix in two dimensions, which has no height either.
    """
    kind = _kind(epochs)
    tally.add(NOT_MEASURED, "gnss", epochs.places[kind.mask & _BY_HAND[kind.values]])
    trusted = Column(_BY_GNSS[kind.values], kind.mask & (kind.values != _OTHER))
    status = epochs.values("RMC", ("status",))
    if status:
        trusted = _and(Column(status["status"].values == "A", status["status"].mask), trusted)
    dimensions = epochs.values("GSA", ("navMode",))
    if dimensions:
        flat = dimensions["navMode"].mask & (dimensions["navMode"].values == _TWO_DIMENSIONS)
        kind = Column(np.where(flat & _PLAIN[kind.values], _FLAT, kind.values), kind.mask)
        for name in {*_HEIGHTS} & columns.keys():
            columns[name] = Column(columns[name].values, columns[name].mask & ~flat)
    else:
        flat = kind.mask & (kind.values == _FLAT)
    columns |= merged(columns, {"fix": Column(_FIXES[kind.values], kind.mask)})
    columns |= merged(columns, {"integrity_ok": Column(trusted.values, trusted.mask & ~(flat & trusted.values))})


def _kind(epochs: SentenceEpochs) -> Column:
    """Return the kind of solution of each epoch.

    It follows from the quality of GGA, else from the mode of GNS or RMC.
    """
    kind = Column(np.full(len(epochs), _NONE), np.zeros(len(epochs), dtype=bool))
    for formatter in ("RMC", "GNS"):
        found = epochs.values(formatter, ("posMode",))
        if found:
            modes = found["posMode"].values
            letters = np.ascontiguousarray(modes).view(np.uint32).reshape(len(modes), -1)
            of_mode = _KIND_OF_RANK[_RANKS[np.minimum(letters, len(_RANKS) - 1)].max(axis=1)]
            kind = merged({"": kind}, {"": Column(of_mode, found["posMode"].mask)})[""]
    found = epochs.values("GGA", ("quality",))
    if found:
        quality = found["quality"].values
        is_known = (quality >= 0) & (quality < len(_OF_QUALITY) - 1) & (quality == np.floor(quality))
        of_quality = _OF_QUALITY[np.where(is_known, quality, len(_OF_QUALITY) - 1).astype(np.int64)]
        kind = merged({"": kind}, {"": Column(of_quality, found["quality"].mask)})[""]
    return kind


def _and(one: Column, other: Column) -> Column:
    values = np.where(one.mask, one.values, True) & np.where(other.mask, other.values, True)
    return Column(np.asarray(values), one.mask | other.mask)


def has_heading(sentences: Sentences) -> bool:
    """Tell whether sentences state a heading at all."""
    if sentences.formatter not in HEADING_FORMATTERS:
        return False
    return any(one.mask.any() for name, one in _heading(sentences).items() if name in HEADINGS)


def _heading(sentences: Sentences) -> Columns:
    """Heading by HDT, THS (true), HDM (magnetic), and attitude by PASHR."""
    columns = sentences.columns
    match sentences.formatter:
        case "HDT":
            return {"true_heading_deg": _true(columns["headingT"], columns["headingTu"], "T")}
        case "THS":
            is_good = columns["mi"].mask & np.isin(columns["mi"].values, ("A", "E"))
            return {"true_heading_deg": Column(columns["headt"].values, columns["headt"].mask & is_good)}
        case "HDM":
            unit = columns["headingMag"]
            is_magnetic = ~unit.mask | (unit.values == "M")
            return {"magnetic_heading_deg": Column(columns["headingM"].values, columns["headingM"].mask & is_magnetic)}
        case "PASHR":
            return _attitude(columns)
    return {}


def _attitude(columns: Columns) -> Columns:
    """Return the attitude of PASHR, where it can be trusted.

    The sentence must have a time, call its heading true, and have a fix or aligned sensors.
    """
    quality, aligned = columns["gnssQual"], columns["imuAlign"]
    is_good = (quality.mask & (quality.values > 0)) | (aligned.mask & (aligned.values > 0))
    is_good |= ~quality.mask & ~aligned.mask
    is_good &= columns["utctime"].mask & columns["trueHdgInd"].mask & (columns["trueHdgInd"].values == "T")
    names = {"true_heading": ("trueHdg", "hdgAcc"), "roll": ("roll", "rollAcc"), "pitch": ("pitch", "pitchAcc")}
    found = {}
    for name, (angle, accuracy) in names.items():
        found[f"{name}_deg"] = Column(columns[angle].values, columns[angle].mask & is_good)
        found[f"{name}_sigma_deg"] = Column(columns[accuracy].values, columns[accuracy].mask & is_good)
    return found


def ins_batch(epochs: SentenceEpochs, address: str, time: Column, mode: str, tally: StreamTally) -> RecordBatch | None:
    """Attitude of the vehicle from the sentences with an address, one row each."""
    sentences = epochs.sentences.get(address)
    if sentences is None:
        return None
    columns = credible_attitude(_heading(sentences), sentences.places, tally)
    heading = next(columns[name] for name in HEADINGS if name in columns)
    columns["mode"] = Column(np.full(len(sentences), mode), heading.mask)
    return occupied("ins", sentences.places, epochs.time_of(address, time), columns)
