"""Latency of GNSS behind the INS that is known before the turns of the taxi are used."""

from groundstation.base.dataclasses import dataclass
from groundstation.methods.intervals import BOUND95
from groundstation.results.roles import Delays


@dataclass(frozen=True)
class KnownDelay:
    """Delay of GNSS behind the INS, its sigma, and its origin.

    The origin is ``aircraft file`` or ``motion``.
    """

    latency_s: float
    sigma_s: float
    origin: str


def known_delay(
    pair: tuple[str, str], latencies: Delays | None, stated_s: float | None, stated_sigma_s: float
) -> KnownDelay | None:
    """Return the latency to take out of a pair of INS and GNSS; None where none is known.

    Parameters
    ----------
    pair : INS and GNSS topic
    latencies : Delays, optional
        Those found on this flight.
    stated_s, stated_sigma_s : float or None, float
        Latency that the aircraft file states; it goes before them.
    """
    if stated_s is not None:
        return KnownDelay(stated_s, stated_sigma_s, "aircraft file")
    found = latencies.observed(*pair) if latencies else None
    if found is None or found.latency_s is None or found.confidence95_s is None:
        return None
    low, high = found.confidence95_s
    return KnownDelay(found.latency_s, 0.5 * (high - low) / BOUND95, "motion")
