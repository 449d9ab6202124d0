"""Fixes of makers' own sentences, for a log without a standard position sentence."""

import re

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.records import Column
from groundstation.base.units import MPS_PER_KMH
from groundstation.readers.layout import velocity_from_track
from groundstation.readers.receiver.messages import Columns
from groundstation.readers.receiver.nmea import SentenceEpochs

# Status of u-blox's PUBX 00; NF (no fix) and TT (time only) are none.
_UBX_STATUS = {"DR": "dead_reckoning", "G2": "2d", "G3": "3d", "D2": "2d", "D3": "dgnss", "RK": "gnss_ins"}
_CORRECTED = ("D2", "D3")
# Trimble's quality of PTNL GGK and Ashtech's kind of PASHR POS; other numbers are kinds of their own.
_GGK_QUALITY = {0: "none", 1: "3d", 2: "rtk_float", 3: "rtk_fixed", 4: "dgnss", 5: "dgnss"}
_ABOVE_ELLIPSOID = re.compile(r"EHT([+-]?\d{1,6}(?:\.\d{1,6})?)")
_POS_KIND = {0: "3d", 1: "dgnss", 2: "rtk_float", 3: "rtk_fixed"}


def makers_solution(epochs: SentenceEpochs) -> Columns:
    """Return columns of ``gnss`` from the maker's sentence that was chosen.

    There are none where a standard sentence states the position.
    """
    match epochs.choice.maker:
        case "PUBX.00":
            return _of_ublox(epochs)
        case "PTNL.GGK":
            return _of_trimble(epochs)
        case "PASHR.POS":
            return _of_ashtech(epochs)
    return {}


def _of_ublox(epochs: SentenceEpochs) -> Columns:
    """Return columns of PUBX 00: heights above the ellipsoid, km/h, down positive."""
    numbers = ("altRef", "hAcc", "vAcc", "SOG", "COG", "vVel", "HDOP", "numSVs", "diffAge")
    found = epochs.values("PUBX.00", ("lat", "lon", "navStat", *numbers))
    if not found:
        return {}
    status = found["navStat"]
    fix = np.array([_UBX_STATUS.get(word, "none") for word in status.values.tolist()], dtype="<U16")
    has_fix = status.mask & (fix != "none")
    present = {name: found[name].mask & has_fix for name in ("lat", "lon", *numbers)}
    place, upright = present["lat"] & present["lon"], fix != "2d"
    speed, track = found["SOG"].values * MPS_PER_KMH, found["COG"].values
    north, east = velocity_from_track(track, speed)
    moving = present["SOG"] & present["COG"]
    return {
        "latitude_deg": Column(found["lat"].values, place),
        "longitude_deg": Column(found["lon"].values, place),
        "altitude_ellipsoid_m": Column(found["altRef"].values, present["altRef"] & upright),
        "horizontal_sigma_m": Column(found["hAcc"].values, present["hAcc"]),
        "vertical_sigma_m": Column(found["vAcc"].values, present["vAcc"] & upright),
        "ground_speed_mps": Column(speed, present["SOG"]),
        "track_deg": Column(wrap_360(track), present["COG"]),
        "velocity_north_mps": Column(north, moving),
        "velocity_east_mps": Column(east, moving),
        "velocity_down_mps": Column(found["vVel"].values, present["vVel"] & upright),
        "hdop": Column(found["HDOP"].values, present["HDOP"]),
        "satellites_used": Column(found["numSVs"].values, found["numSVs"].mask),
        "integrity_ok": Column(~np.isin(fix, ("none", "dead_reckoning")), status.mask & upright),
        "fix": Column(fix, status.mask),
        "age_of_corrections_s": Column(
            found["diffAge"].values, present["diffAge"] & np.isin(status.values, _CORRECTED)
        ),
    }


def _of_trimble(epochs: SentenceEpochs) -> Columns:
    """Return columns of PTNL GGK.

    A height of the kind EHT is above the ellipsoid; others are above another surface and stay raw.
    """
    found = epochs.values("PTNL.GGK", ("lat", "lon", "gpsQual", "sip", "DOP", "height"))
    if not found:
        return {}
    heights = [_ABOVE_ELLIPSOID.fullmatch(word) for word in found["height"].values.tolist()]
    height_m = np.array([float(match[1]) if match else np.nan for match in heights])
    columns = _place(found, _kinds(found["gpsQual"], _GGK_QUALITY))
    has_fix = columns["latitude_deg"].mask
    return columns | {
        "altitude_ellipsoid_m": Column(height_m, found["height"].mask & has_fix & np.isfinite(height_m)),
        "pdop": Column(found["DOP"].values, found["DOP"].mask),
        "satellites_used": Column(found["sip"].values, found["sip"].mask),
    }


def _of_ashtech(epochs: SentenceEpochs) -> Columns:
    """Return columns of PASHR POS.

    Its height and speed are of several kinds and units by the device, and stay raw.
    """
    found = epochs.values("PASHR.POS", ("lat", "lon", "solnType", "sip", "PDOP", "HDOP", "corrAge"))
    if not found:
        return {}
    age, kind = found["corrAge"], found["solnType"]
    return _place(found, _kinds(kind, _POS_KIND)) | {
        "age_of_corrections_s": Column(age.values, age.mask & kind.mask & (kind.values > 0)),
        "pdop": found["PDOP"],
        "hdop": found["HDOP"],
        "satellites_used": found["sip"],
    }


def _kinds(told: Column, names: dict[int, str]) -> Column:
    return Column(np.array([names.get(number, "other") for number in told.values.tolist()], dtype="<U16"), told.mask)


def _place(found: Columns, fix: Column) -> Columns:
    present = found["lat"].mask & found["lon"].mask & fix.mask & (fix.values != "none")
    return {
        "latitude_deg": Column(found["lat"].values, present),
        "longitude_deg": Column(found["lon"].values, present),
        "integrity_ok": Column(fix.values != "none", fix.mask & (fix.values != "other")),
        "fix": fix,
    }
