"""Outages in the log itself: what was missing, and the forecast through each.

It is told how the forecast came out.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.units import NS_PER_S
from groundstation.systems.inertial.answer import RealOutage
from groundstation.systems.inertial.coupled import CoupledRun, run_coupled
from groundstation.systems.inertial.coupled_forecast import coupled_variance, hindcast_coupled
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.hindcast import hindcast
from groundstation.systems.inertial.leads import leads_of
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.skill import WITH_SIGMA, scale_of
from groundstation.systems.inertial.start_covariance import lead_growth, start_covariance
from groundstation.tables.gaps import largest_step_s
from groundstation.tables.table import Flight

PRESENT_SHARE = 0.5  # of the seconds of an outage in which a source has samples, to count as there


@dataclass(frozen=True)
class Bridged:
    """Outages, and the position error to take off the INS at every epoch, shape (n, c).

    It is forecast through the outages. With the coupled run, where one was made for it.
    """

    outages: tuple[RealOutage, ...]
    error_m: FloatArray
    coupled: CoupledRun | None = None


def bridge_outages(flight: Flight, compared: InsDifferences, run: ChannelsRun, settings: InertialSettings) -> Bridged:
    """Find the outages and forecast through each with the method and model of the settings.

    ``jump_m`` compares that very forecast with the first GNSS position after it.
    """
    epochs = run.epochs
    seen = np.flatnonzero(epochs.has_gnss)
    error_m, found = np.array(run.x[:, POSITION]), []
    if not len(seen):
        return Bridged((), error_m)
    usual = largest_step_s(np.round(epochs.time_s[seen] * NS_PER_S).astype(np.int64))
    limit_s = max(settings.outage_s, usual if np.isfinite(usual) else 0.0)
    long = [
        (last, back) for last, back in pairwise(seen.tolist()) if epochs.time_s[back] - epochs.time_s[last] > limit_s
    ]
    is_coupled = settings.model == "coupled" and settings.default_method == "last_estimate"
    coupled = run_coupled(compared, run.noise, settings) if is_coupled and long else None
    for last, back in long:
        outage = _empty(flight, compared, float(epochs.time_s[last]), float(epochs.time_s[back]))
        grown, own_m2 = _grown(run, last, back, coupled, settings)
        error_m[last + 1 : back] = run.x[last, POSITION] + grown[:-1]
        measured = epochs.position_m[back]
        if np.isfinite(measured).all() and not epochs.is_reset[last + 1 : back + 1].any():
            away = float(np.hypot(*(measured - run.x[last, POSITION] - grown[-1])))
            outage = replace(outage, jump_m=away, sigma_m=_sigma(run, last, outage.length_s, own_m2, settings))
        found.append(outage)
    if epochs.time_s[-1] - epochs.time_s[seen[-1]] > limit_s:
        found.append(_empty(flight, compared, float(epochs.time_s[seen[-1]]), float(epochs.time_s[-1])))
    return Bridged(tuple(found), error_m, coupled)


def _grown(
    run: ChannelsRun, last: int, back: int, coupled: CoupledRun | None, settings: InertialSettings
) -> tuple[FloatArray, FloatArray | None]:
    """Return the forecast growth of position error since epoch ``last``, shape (k, c).

    It is given at the epochs behind it up to ``back``, with its variance at the last of them, (c,), where the method
    has one of its own.
    """
    elapsed = run.epochs.time_s[last + 1 : back + 1] - run.epochs.time_s[last]
    step_s = min(settings.forecast_step_s, float(elapsed[-1]))
    lead_s = leads_of(step_s, float(elapsed[-1]) + step_s)
    at, method = np.array([last]), settings.default_method
    own_m2 = None
    if coupled is not None:
        built = hindcast_coupled(coupled, at, lead_s, settings)[0]
        own_m2 = coupled_variance(coupled, at, elapsed[-1:])[0, 0]
    else:
        replay = hindcast(run, at, lead_s, (method,), settings)
        built = replay.forecast_m[method][0]
        if method in replay.variance_m2:
            own_m2 = _at(elapsed[-1:], lead_s, replay.variance_m2[method][0])[0]
    return _at(elapsed, lead_s, built), own_m2


def _at(elapsed_s: FloatArray, lead_s: FloatArray, values: FloatArray) -> FloatArray:
    """Interpolate what grows from nothing over the leads, (l, c), to other times."""
    times = np.concatenate([[0.0], lead_s])
    columns = [np.interp(elapsed_s, times, np.concatenate([[0.0], column])) for column in values.T]
    return np.stack(columns, axis=1)


def _sigma(
    run: ChannelsRun, last: int, length_s: float, own_m2: FloatArray | None, settings: InertialSettings
) -> float | None:
    """Return the radial sigma of the forecast at the end of an outage.

    The error of the first GNSS position is included.
    """
    method = settings.default_method
    if method not in WITH_SIGMA:
        return None
    lead_s = np.array([length_s])
    growth, scale = (
        lead_growth(run, lead_s),
        float(run.noise.calibration.at(lead_s, scale_of(method, is_own=own_m2 is not None))[0]),
    )
    total = 0.0
    for channel in range(run.x.shape[2]):
        if own_m2 is None:
            start = start_covariance(method, run, np.array([last]), channel, settings)
            total += scale**2 * float(growth.variance(start)[0, 0])
        else:
            total += scale**2 * float(own_m2[channel])
        total += float(run.covariance(channel)[last, POSITION, POSITION]) + float(growth.judge_m2[0])
    return float(np.sqrt(total))


def _empty(flight: Flight, compared: InsDifferences, start_s: float, end_s: float) -> RealOutage:
    """Return an outage whose forecast could not be judged; the tables tell what was missing."""
    present = {}
    for kind, topic in (("ins", compared.ins_topic), ("gnss", compared.gnss_topic)):
        table = flight[topic]
        times = flight.seconds(table.time_ns[table.valid("latitude_deg", "longitude_deg")])
        inside = times[(times > start_s) & (times < end_s)]
        present[kind] = len(np.unique(np.floor(inside))) > PRESENT_SHARE * (end_s - start_s)
    missing = "both" if not any(present.values()) else "gnss" if present["ins"] else "ins"
    return RealOutage(start_s, end_s, end_s - start_s, None, None, missing)
