"""Second interval of the heading error.

The INS heading minus that of states of their own, on the straights used.
"""

import numpy as np

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.findings import Finding
from groundstation.base.quantiles import NORMAL_95
from groundstation.methods.intervals import effective_samples
from groundstation.results.arrays.typed import found_in
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.heading.answer import HeadingByStates, HeadingResult
from groundstation.systems.heading.arrays import HeadingSamples
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.known import AircraftData

FEWEST = 30  # epochs with states beside them


def by_states(
    found: HeadingResult, states: StatesAlongTheFlight | None, settings: HeadingSettings, aircraft: AircraftData
) -> HeadingByStates | None:
    """Return the heading error by the heading of states.

    At the epochs that the taxi number rests on.

    Parameters
    ----------
    found : HeadingResult
        With its samples; those before the last step of the INS heading are left out.
    states : StatesAlongTheFlight or None
        Used where their checks hold.
    settings, aircraft
        The sigma of the mounting of the INS stands for that of the unit that the states are of.

    Returns
    -------
    HeadingByStates, or None without states at 30 epochs.

    Notes
    -----
    The error of the states is taken as one and the same over the taxi: it lasts for minutes, averaging makes it no
    smaller. Both numbers rest on the INS heading and on the velocity of GNSS, so they are never combined. They disagree
    where their intervals do not meet: whatever their correlation, the sigma of their difference is no more than the
    sum of both.
    """
    samples = found_in(found.figures, HeadingSamples)
    kept = None if states is None or not states.is_reference else states.body_states()
    if samples is None or states is None or kept is None:
        return None
    is_meant = samples.is_used & (samples.time_s >= max((step.time_s for step in found.steps), default=-np.inf))
    at = kept.at(samples.time_s[is_meant])
    known = np.isfinite(at.true_heading_deg) & np.isfinite(at.true_heading_sigma_deg)
    if np.count_nonzero(known) < FEWEST:
        return None
    error = _centred(samples.heading_deg[is_meant][known] - at.true_heading_deg[known])
    mounting = aircraft.mounting_sigma_deg
    sigma = float(
        np.sqrt(
            float(np.median(at.true_heading_sigma_deg[known])) ** 2
            + (settings.mounting_sigma_deg if mounting is None else mounting) ** 2
            + float(np.var(error)) / effective_samples(error)
        )
    )
    value = float(wrap_180(np.mean(error)))
    low, high = found.confidence95_deg
    half, apart = NORMAL_95 * sigma, float(wrap_180(found.error_deg - value))
    reach = half + (found.error_deg - low if apart > 0.0 else high - found.error_deg)
    return HeadingByStates(
        by=states.by_it,
        error_deg=value,
        sigma_deg=sigma,
        confidence95_deg=(value - half, value + half),
        samples=int(np.count_nonzero(known)),
        correlation=_correlation(error, _centred(samples.difference_deg[is_meant][known])),
        difference_deg=apart,
        agrees=abs(apart) <= reach,
    )


def disagreement(found: HeadingResult) -> tuple[Finding, ...]:
    """Return a warning where both intervals do not meet."""
    second = found.by_states
    if second is None or second.agrees:
        return ()
    (low, high), (least, most) = found.confidence95_deg, second.confidence95_deg
    text = (
        f"heading error {found.error_deg:+.2f} deg by taxi (95 % {low:+.2f} to {high:+.2f}) and "
        f"{second.error_deg:+.2f} deg {second.by} (95 % {least:+.2f} to {most:+.2f}): their intervals do not meet; "
        "sideslip on taxi, or the mounting of the inertial unit"
    )
    return (Finding("warn", "heading.by_states", text, found.ins_topic),)


def _centred(difference_deg: FloatArray) -> FloatArray:
    """Return differences without a jump at +-180 deg."""
    centre = float(wrap_180(mean_heading(difference_deg)))
    return np.asarray(centre + wrap_180(difference_deg - centre))


def _correlation(one: FloatArray, other: FloatArray) -> float | None:
    """Return the correlation of two series over the epochs; None where one does not vary."""
    both = np.isfinite(one) & np.isfinite(other)
    if np.count_nonzero(both) < FEWEST or not (np.ptp(one[both]) > 0.0 and np.ptp(other[both]) > 0.0):
        return None
    return float(np.corrcoef(one[both], other[both])[0, 1])
