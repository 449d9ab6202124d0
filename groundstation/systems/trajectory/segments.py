"""Segments of a log, split at gaps of the unit.

Each is estimated, the noise fitted to the longest.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.systems.trajectory.aid_settings import AidSettings
from groundstation.systems.trajectory.aiding import aided, of_span, used_alone
from groundstation.systems.trajectory.aids_answer import AidRow
from groundstation.systems.trajectory.aids_input import Aids
from groundstation.systems.trajectory.estimate import Estimate, estimate
from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements

SUBJECT = "trajectory"
FEWEST_FIXES = 5


@dataclass(frozen=True)
class Segment:
    """Samples and fixes of a segment, and its estimate."""

    imu: ImuIncrements
    gnss: GnssFixes
    estimate: Estimate
    aids: tuple[AidRow, ...] = ()


def split(imu: ImuIncrements, gap_s: float) -> list[ImuIncrements]:
    """Split samples where none come for longer than ``gap_s``."""
    missing = np.diff(imu.time_s) - imu.interval_s[1:]
    edges = np.concatenate([[0], np.flatnonzero(missing > gap_s) + 1, [len(imu)]])
    return [
        replace(
            imu,
            time_s=imu.time_s[a:b],
            interval_s=imu.interval_s[a:b],
            delta_angle_rad=imu.delta_angle_rad[a:b],
            delta_velocity_mps=imu.delta_velocity_mps[a:b],
        )
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    ]


def moving_s(gnss: GnssFixes, start_s: float, end_s: float, moving_mps: float) -> float:
    """Return the seconds in which GNSS moves, between two times."""
    speed = np.linalg.norm(motion_of(gnss)[:, :2], axis=1)
    inside = (gnss.time_s >= start_s) & (gnss.time_s <= end_s)
    steps = np.minimum(np.diff(gnss.time_s, append=gnss.time_s[-1:]), 2.0)
    with np.errstate(invalid="ignore"):
        return float(steps[inside & (speed > moving_mps)].sum())


def of_segment(gnss: GnssFixes, imu: ImuIncrements) -> GnssFixes:
    """Return the fixes beside a segment.

    A second and a half is added on both sides for their latency.
    """
    near = (gnss.time_s >= imu.time_s[0] - 1.5) & (gnss.time_s <= imu.time_s[-1] + 1.5)
    return GnssFixes(**{name: getattr(gnss, name)[near] for name in gnss.__dataclass_fields__})


def is_usable(gnss: GnssFixes, imu: ImuIncrements) -> bool:
    """Tell whether a segment has fixes inside."""
    have = np.isfinite(gnss.latitude_deg) & np.isfinite(motion_of(gnss)[:, :2]).all(axis=1)
    inside = (gnss.time_s > imu.time_s[0]) & (gnss.time_s < imu.time_s[-1] - 1.0)
    return int((have & inside).sum()) >= FEWEST_FIXES


def estimate_segments(
    imu: ImuIncrements,
    gnss: GnssFixes,
    *,
    gap_s: float,
    least_s: float,
    may_roll: bool,
    may_stop: bool,
    latency_s: float = 0.0,
    aids: Aids | None = None,
    aid_settings: AidSettings | None = None,
    ambiguous_below: float = 10.0,
) -> tuple[Segment, ...]:
    """Estimate every segment that is long enough.

    Noise, latency and choice of aids are those of the longest.

    Raises
    ------
    NotAssessableError
        When no segment has enough samples and fixes.
    """
    parts = [(part, of_segment(gnss, part)) for part in split(imu, gap_s) if len(part) > 10]
    long = [
        (part, fixes) for part, fixes in parts if part.time_s[-1] - part.time_s[0] >= least_s and is_usable(fixes, part)
    ]
    if not long:
        longest = max((float(part.time_s[-1] - part.time_s[0]) for part, _ in parts), default=0.0)
        raise NotAssessableError(
            SUBJECT,
            f"no stretch of {least_s:.0f} s with an inertial unit and GNSS; the longest without a gap "
            f"of the unit above {gap_s:g} s has {longest:.0f} s",
        )
    order = sorted(range(len(long)), key=lambda i: long[i][0].time_s[0] - long[i][0].time_s[-1])
    found: dict[int, Segment] = {}
    for i in order:
        part, fixes = long[i]
        first = found[order[0]].estimate if found else None
        done = estimate(
            part,
            fixes,
            may_roll=may_roll,
            may_stop=may_stop,
            prior=None if first is None else first.model,
            fit=first is None,
            latency_s=latency_s if first is None else first.latency_s,
            lag_s=0.0 if first is None else first.lag_s,
        )
        rows: tuple[AidRow, ...] = ()
        if aids is not None:
            here = of_span(aids, float(part.time_s[0]), float(part.time_s[-1]))
            here = here if first is None else used_alone(here, found[order[0]].aids)
            done, rows = aided(
                done, here, aid_settings or AidSettings(), ambiguous_below=ambiguous_below, fit=first is None
            )
        found[i] = Segment(part, fixes, done, rows)
    return tuple(found[i] for i in range(len(long)))
