"""Kind of an INS: whether GNSS corrects it already; then there is nothing to forecast."""

from collections.abc import Mapping

import numpy as np

from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.tables.sources import AIDED, HALF, STATED, UNAIDED, UNKNOWN

WHY_NOT = {AIDED: "GNSS corrects this INS already", UNKNOWN: "it is not known whether GNSS corrects this INS"}
LEAST_AIDED_S = 20.0  # of an INS that GNSS corrects nothing is estimated: so little suffices to show the differences
MINUTE_S, LEAST_MINUTES = 60.0, 5.0
AT_REST_MPS = 5.0
DRIFT_MPS = 0.005  # an INS that stays below has not drifted: 0.01 nmi/h


def stated_kind(aircraft_kind: str, metadata: Mapping[str, str]) -> tuple[str, str]:
    """Return the INS kind stated by the aircraft file or the log head, and who said it.

    The aircraft file goes before ``ins_kind`` of the log; empty texts where neither says.

    Examples
    --------
    >>> stated_kind("", {"ins_kind": "GNSS_aided"}), stated_kind("unaided", {"ins_kind": "gnss_aided"})
    (('gnss_aided', 'the log header says so'), ('unaided', 'the aircraft file says so'))
    """
    logged = metadata.get("ins_kind", "").strip().lower()
    if aircraft_kind in STATED:
        return aircraft_kind, "the aircraft file says so"
    return (logged, "the log header says so") if logged in STATED else ("", "")


def kind_of(
    compared: InsDifferences, settings: InertialSettings, stated: tuple[str, str] = ("", "")
) -> tuple[str, str]:
    """Say whether GNSS corrects the INS, and why it is thought so.

    It is stated, its own mode says so, or it never drifts: 95 % of the minute means of the position difference lie
    nearer to their median than ``aided_radial_m``, and than an INS of 0.01 nmi/h would drift in the time. An INS at
    rest, or a few minutes, cannot tell.
    """
    if stated[0]:
        return stated
    if compared.aided_share > HALF:
        return AIDED, "its mode in the log is gnss_aided"
    epochs = compared.epochs
    known = np.isfinite(epochs.position_m).all(axis=1)
    minute = np.floor(epochs.time_s[known] / MINUTE_S).astype(np.int64)
    _, which, count = np.unique(minute, return_inverse=True, return_counts=True)
    if len(count) < LEAST_MINUTES:
        return UNKNOWN, f"{len(count)} min of positions, {LEAST_MINUTES:.0f} are needed to see it drift from GNSS"
    speed = np.hypot(*compared.velocity_mps.T)
    if np.isfinite(speed).any() and np.nanquantile(speed, 0.95) < AT_REST_MPS:
        return (
            UNKNOWN,
            f"95 % of the time below {AT_REST_MPS:.0f} m/s: an INS at rest need not drift",
        )
    means = np.stack([np.bincount(which, epochs.position_m[known, axis]) / count for axis in range(2)], axis=1)
    largest = float(np.quantile(np.hypot(*(means - np.median(means, axis=0)).T), 0.95))
    seconds = float(np.ptp(epochs.time_s[known]))
    if largest < min(settings.aided_radial_m, DRIFT_MPS * seconds):
        return AIDED, (
            f"it stays within {largest:.1f} m of GNSS for {seconds / MINUTE_S:.0f} min (95 % of the minute means "
            "about their median), as no unaided INS does"
        )
    return UNAIDED, f"it drifts from GNSS: minute means spread over {largest:.0f} m (95 %)"
