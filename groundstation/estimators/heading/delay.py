"""The latency of GNSS behind the INS where it is known before the turns of the taxi are looked at."""

from dataclasses import dataclass, replace

from groundstation.estimators.heading.settings import HeadingSettings
from groundstation.estimators.known import AircraftData
from groundstation.methods.intervals import BOUND95
from groundstation.results.latency import Latencies


@dataclass(frozen=True)
class KnownDelay:
    """By how much GNSS is later than the INS, its sigma, and whence: ``aircraft file`` or ``motion``."""

    latency_s: float
    sigma_s: float
    origin: str

    def narrowed(self, settings: HeadingSettings) -> HeadingSettings:
        """Settings whose prior of the time offset is what this latency leaves of it."""
        return replace(settings, offset_prior_sigma_s=min(settings.offset_prior_sigma_s, self.sigma_s))


def known_delay(
    pair: tuple[str, str], latencies: Latencies | None, aircraft: AircraftData, settings: HeadingSettings
) -> KnownDelay | None:
    """The latency to take out of a pair of INS and GNSS; None where nothing is known, or the estimate not wanted."""
    if aircraft.gnss_latency_s is not None:
        return KnownDelay(aircraft.gnss_latency_s, aircraft.gnss_latency_sigma_s, "aircraft file")
    found = latencies.observed(*pair) if latencies and settings.use_latency == "when_observed" else None
    if found is None or found.latency_s is None or found.confidence95_s is None:
        return None
    low, high = found.confidence95_s
    return KnownDelay(found.latency_s, 0.5 * (high - low) / BOUND95, "motion")
