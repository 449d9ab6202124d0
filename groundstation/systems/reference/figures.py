"""Arrays behind the figures of the comparison with a reference.

They are thinned to what a page or a viewer can show.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.results.arrays.typed import joined
from groundstation.systems.reference.arrays import ReferenceChecks, ReferenceErrors, ReferenceTrack
from groundstation.systems.reference.errors import SIGMAS, Errors
from groundstation.systems.reference.judging import CheckedClaim

ROWS = 2_000  # of each subject


def errors_figure(listed: Sequence[Errors]) -> ReferenceErrors:
    """Return the errors of every subject over time and their claimed sigmas.

    The sigmas are those that the subject and the reference claim together.
    """
    parts = []
    for errors in listed:
        rows = _thinned(len(errors))
        north_m, east_m, up_m = errors.position_m[rows].T
        north_mps, east_mps, up_mps = errors.velocity_mps[rows].T
        roll_deg, pitch_deg, heading_deg = errors.angles_deg[rows].T
        horizontal, vertical, velocity, roll, pitch, heading = (_total(errors, name)[rows] for name in SIGMAS)
        parts.append(
            ReferenceErrors(
                subject=np.full(len(rows), errors.subject),
                time_s=errors.time_s[rows],
                north_error_m=north_m,
                east_error_m=east_m,
                up_error_m=up_m,
                north_error_mps=north_mps,
                east_error_mps=east_mps,
                up_error_mps=up_mps,
                roll_error_deg=roll_deg,
                pitch_error_deg=pitch_deg,
                heading_error_deg=heading_deg,
                horizontal_sigma_m=horizontal,
                vertical_sigma_m=vertical,
                velocity_sigma_mps=velocity,
                roll_sigma_deg=roll,
                pitch_sigma_deg=pitch,
                true_heading_sigma_deg=heading,
            )
        )
    return joined(parts)


def _total(errors: Errors, name: str) -> FloatArray:
    claimed, own = errors.claimed.get(name), errors.reference.get(name)
    if claimed is None:
        return np.full(len(errors), np.nan)
    return claimed if own is None else np.hypot(claimed, np.nan_to_num(own))


def track_figure(listed: Sequence[Errors]) -> ReferenceTrack | None:
    """Return the plan view of the reference and of every subject with positions.

    Metres from where the reference begins.
    """
    with_place = [one for one in listed if np.isfinite(one.position_m[:, :2]).any()]
    if not with_place:
        return None
    longest = max(with_place, key=lambda one: float(np.ptp(one.time_s)))
    parts = []
    tracks = [("reference", longest, 0.0), *((one.subject, one, 1.0) for one in with_place)]
    for name, errors, share in tracks:
        rows = _thinned(len(errors))
        place = errors.place_m[rows] + share * np.nan_to_num(errors.position_m[rows, :2], nan=np.nan if share else 0.0)
        subject, time_s = np.full(len(rows), name), errors.time_s[rows]
        north_m, east_m = place.T
        parts.append(ReferenceTrack(subject=subject, time_s=time_s, place_north_m=north_m, place_east_m=east_m))
    return joined(parts)


def checks_figure(listed: Sequence[CheckedClaim]) -> ReferenceChecks | None:
    """Return as many evenly spaced samples of every claim as are independent.

    These are what a fleet may count.
    """
    parts = []
    for one in listed:
        rows = np.unique(np.linspace(0, len(one.z) - 1, max(int(one.row.effective_samples), 1)).round().astype(int))
        parts.append(
            ReferenceChecks(
                subject=np.full(len(rows), one.row.subject),
                quantity=np.full(len(rows), one.row.quantity),
                axis=np.full(len(rows), one.row.axis),
                time_s=one.time_s[rows],
                z=one.z[rows],
                is_inside=one.is_inside[rows],
            )
        )
    return joined(parts) if parts else None


def _thinned(count: int) -> Int64Array:
    return np.unique(np.linspace(0, count - 1, min(count, ROWS)).round().astype(np.int64))
