"""Factors by which sigmas are raised, never lowered, and the state of an answer."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.checks_answer import AgainstOwnTrack, OutageRow, RaisedSigma
from groundstation.systems.trajectory.outages import LENGTHS_S, Outages
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates

WANTED = 0.95
LEAST_WANTED = 0.9  # of the outages of one length
FEW = 5  # outages below which nothing is told of sigmas
LONG_S = 30.0  # outages that show an attitude


@dataclass(frozen=True)
class Factors:
    """Factors on the sigmas."""

    position: float = 1.0
    velocity: float = 1.0
    tilt: float = 1.0
    heading: float = 1.0
    height: float = 1.0


def position_factor(outages: Outages, ratio: FloatArray, *, is_horizontal: bool) -> float:
    """Return the factor that puts 95 % of all outages inside.

    Of each length that has ten it puts 90 % inside, and the RMS error at most at the RMS sigma.

    Parameters
    ----------
    ratio : ndarray, shape (n,)
        Error of each outage over its 95 % bound.
    is_horizontal : bool
        The ratio is that of the horizontal error, whose RMS counts too.
    """
    if len(outages) < FEW:
        return 1.0
    factor = max(1.0, _quantile(ratio, WANTED))
    for length_s in LENGTHS_S:
        of = ratio[outages.of_length(length_s)]
        if len(of) >= 2 * FEW:
            factor = max(factor, _quantile(of, LEAST_WANTED))
            if is_horizontal:
                factor = max(factor, _rms_over_sigma(outages, outages.of_length(length_s)))
    return factor


def _rms_over_sigma(outages: Outages, of: BoolArray) -> float:
    return float(np.sqrt(np.mean(outages.error_m[of] ** 2) / np.mean(outages.sigma_m[of] ** 2)))


def _quantile(values: FloatArray, share: float) -> float:
    """Return the smallest value that ``share`` of the values do not exceed."""
    return float(np.sort(values)[int(np.ceil(share * len(values))) - 1])


def raised(
    outages: Outages, own: AgainstOwnTrack | None, heading_sigma_deg: float, *, rolls: bool
) -> tuple[Factors, tuple[RaisedSigma, ...]]:
    """Return the factors, and what asked for each.

    Parameters
    ----------
    heading_sigma_deg : float
        Median of the sigma on straights, as the filter has it.
    """
    position = position_factor(outages, outages.ratio, is_horizontal=True)
    height = max(position, position_factor(outages, outages.down_ratio, is_horizontal=False))
    velocity = tilt = heading = 1.0
    why_tilt = why_heading = ""
    if len(outages) >= FEW:
        ratio = np.abs(outages.velocity_ratio).ravel()
        velocity = max(1.0, _quantile(ratio, WANTED) / NORMAL_95)
        long = outages.length_s >= LONG_S
        if long.sum() >= FEW:
            changes, expected = outages.attitude[long] ** 2, outages.attitude_variance[long]
            changed = np.sqrt(changes.sum(axis=0) / np.maximum(expected.sum(axis=0), 1e-18))
            tilt = max(1.0, float(np.sqrt(np.mean(changed[:2] ** 2))))
            heading = max(1.0, float(changed[2]))
            why = "leaving out GNSS moved it by {:.1f} times what its sigma says"
            why_tilt, why_heading = why.format(tilt), why.format(heading)
    if rolls and own is not None and own.scatter_100_s_deg is not None and heading_sigma_deg > 0.0:
        by_track = own.scatter_100_s_deg / heading_sigma_deg
        if by_track > heading:
            heading = by_track
            why_heading = (
                f"heading minus own track scatters by {own.scatter_100_s_deg:.2f} deg over 100 s "
                f"where {heading_sigma_deg:.2f} was expected"
            )
    rows = (
        RaisedSigma("position", position, _why_position(outages) if position > 1 else ""),
        RaisedSigma(
            "height",
            height,
            (
                f"{np.mean(outages.down_ratio <= 1.0):.0%} of them inside in height"
                if height > position
                else "as position"
            )
            if height > 1
            else "",
        ),
        RaisedSigma("velocity", velocity, "by replayed outages" if velocity > 1 else ""),
        RaisedSigma("tilt", tilt, why_tilt if tilt > 1 else ""),
        RaisedSigma("heading", heading, why_heading if heading > 1 else ""),
    )
    return Factors(position, velocity, tilt, heading, height), rows


def _why_position(outages: Outages) -> str:
    inside = f"{np.mean(outages.ratio <= 1.0):.0%} of {len(outages)} replayed outages inside 95 %"
    many = [one for one in LENGTHS_S if outages.of_length(one).sum() >= 2 * FEW]
    share, length_s = max(((_rms_over_sigma(outages, outages.of_length(one)), one) for one in many), default=(0.0, 0.0))
    return (
        f"{inside}; in those of {length_s:g} s the RMS error is {share:.2f} times its sigma" if share > 1.0 else inside
    )


def with_factors(track: TrackOfStates, factors: Factors, constant_m: FloatArray) -> TrackOfStates:
    """Return the states with raised sigmas.

    Parameters
    ----------
    constant_m : ndarray, shape (3,)
        Sigma of an error of GNSS that lasts all through the log: no check on the log itself shows it.
    """
    return replace(
        track,
        position_sigma_m=np.hypot(
            track.position_sigma_m * np.array([factors.position, factors.position, factors.height]), constant_m
        ),
        velocity_sigma_mps=track.velocity_sigma_mps * factors.velocity,
        attitude_sigma_deg=track.attitude_sigma_deg * np.array([factors.tilt, factors.tilt, factors.heading]),
    )


def outage_rows(outages: Outages, factor: float, height: float) -> tuple[OutageRow, ...]:
    """Return the outages by length, sigmas raised by the factors of position and height."""
    rows = []
    for length_s in LENGTHS_S:
        of = outages.of_length(length_s)
        if not of.any():
            continue
        error = float(np.sqrt(np.mean(outages.error_m[of] ** 2)))
        rows.append(
            OutageRow(
                length_s,
                int(of.sum()),
                error,
                float(np.sqrt(np.mean(outages.forward_end_m[of] ** 2))),
                float(np.mean(outages.ratio[of] <= factor)),
                _rms_over_sigma(outages, of) / factor,
                float(length_s * of.sum()),
                float(np.sqrt(np.mean(outages.down_m[of] ** 2))),
                float(np.mean(outages.down_ratio[of] <= height)),
                float(np.max(outages.error_m[of])),
                float(np.max(outages.forward_end_m[of])),
                outages.left_out(length_s, standing=True),
                outages.left_out(length_s, standing=False),
            )
        )
    return tuple(rows)
