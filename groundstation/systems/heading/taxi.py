"""Straight taxi of a flight: the epochs that the heading is estimated from."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.words import counted
from groundstation.methods.taxi.delay import KnownDelay, known_delay
from groundstation.methods.taxi.gating import gate_samples
from groundstation.methods.taxi.samples import HEADING_AND_VELOCITY, HeadingOf, OnGround, TaxiSamples, pair_samples
from groundstation.results.roles import Delays
from groundstation.systems.heading.answer import seconds_of_epochs
from groundstation.systems.heading.settings import HeadingRequest, HeadingSettings
from groundstation.systems.heading.standstill import StandstillData, find_standstill
from groundstation.systems.known import AircraftData
from groundstation.tables.phases import Phases
from groundstation.tables.sources import choose_pair
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class StraightTaxi:
    """Straight taxi of a flight and the standstill before it.

    ``topics`` are those of INS and GNSS; ``delay`` of the latter is taken out of ``samples``, whose velocities are
    those of the antenna.
    """

    topics: tuple[str, str]
    delay: KnownDelay | None
    samples: TaxiSamples
    standstill: StandstillData


def taxi_of_flight(
    flight: Flight,
    *,
    settings: HeadingSettings,
    aircraft: AircraftData,
    request: HeadingRequest,
    on_ground: OnGround | None,
    heading: HeadingOf | None,
    latencies: Delays | None,
    phases: Phases | None,
) -> StraightTaxi:
    """Choose the pair, take the delay out, and find straight taxi and standstill.

    Raises
    ------
    NotAssessableError
        Where nothing can be estimated, with the reason.
    """
    topics = choose_pair(flight, HEADING_AND_VELOCITY, request.ins_topic, request.gnss_topic)
    delay = _delay_of(topics, latencies, aircraft, settings)
    samples = straight_taxi(
        *(flight, *topics),
        settings=settings,
        request=request,
        on_ground=on_ground,
        heading=heading,
        phases=phases,
        gnss_latency_s=delay.latency_s if delay else 0.0,
    )
    return StraightTaxi(topics, delay, samples, find_standstill(samples, settings))


def straight_taxi(
    flight: Flight,
    ins_topic: str,
    gnss_topic: str,
    *,
    settings: HeadingSettings,
    request: HeadingRequest,
    on_ground: OnGround | None = None,
    heading: HeadingOf | None = None,
    phases: Phases | None = None,
    gnss_latency_s: float = 0.0,
) -> TaxiSamples:
    """Pair GNSS epochs with the INS heading and say which are used.

    Used are those before take-off, all where these are too few.

    Raises
    ------
    NotAssessableError
        When fewer than two are used, with the reason.
    """

    def gated(with_later_runs: bool) -> TaxiSamples:
        paired = pair_samples(
            *(flight, ins_topic, gnss_topic),
            settings=settings,
            on_ground=on_ground,
            heading=heading,
            with_later_runs=with_later_runs,
            gnss_latency_s=gnss_latency_s,
        )
        return gate_samples(paired, settings, request.intervals, phases)

    antenna = gated(with_later_runs=settings.runs == "all_ground")
    if settings.runs == "auto" and seconds_of_epochs(antenna.is_used, antenna.interval_s) < settings.taxi_min_s:
        # Too little before take-off: what the whole flight says is worth more, though never a number to type.
        whole = gated(with_later_runs=True)
        antenna = whole if whole.is_used.sum() > antenna.is_used.sum() else antenna
    if antenna.is_used.sum() < 2:
        raise NotAssessableError("heading", _why_nothing_is_used(antenna, settings))
    _refuse_too_little(antenna, settings)
    return antenna


def _delay_of(
    pair: tuple[str, str], latencies: Delays | None, aircraft: AircraftData, settings: HeadingSettings
) -> KnownDelay | None:
    """Return the latency of GNSS behind the INS to take out.

    None where nothing is known, or the estimate is not wanted.
    """
    found = latencies if settings.use_latency == "when_observed" else None
    return known_delay(pair, found, aircraft.gnss_latency_s, aircraft.gnss_latency_sigma_s)


def _refuse_too_little(samples: TaxiSamples, settings: HeadingSettings) -> None:
    """Refuse an estimate with next to no straight taxi before take-off."""
    is_wanted = samples.is_used if settings.runs == "all_ground" else samples.is_used & ~samples.is_after_lift_off
    seconds, later = (seconds_of_epochs(mask, samples.interval_s) for mask in (is_wanted, samples.is_used & ~is_wanted))
    if seconds >= settings.taxi_least_s - 0.5 * samples.interval_s:
        return
    found = f"{seconds:.1f} s of straight taxi" if seconds else "no straight taxi"
    where = "" if settings.runs == "all_ground" else " before take-off"
    text = f"{found}{where}, {settings.taxi_least_s:g} s needed for an estimate"
    raise NotAssessableError("heading", f"{text} ({later:.0f} s after the flight do not count)" if later else text)


def _why_nothing_is_used(samples: TaxiSamples, settings: HeadingSettings) -> str:
    limit = settings.taxi_speed_min_mps
    highest = float(np.max(samples.speed_mps)) if len(samples) else 0.0
    if not np.isfinite(samples.heading_deg).any():
        return "no INS heading at the times of the GNSS velocities on the ground"
    if highest <= limit:
        return f"ground speed never above {limit:g} m/s before lift-off: highest {highest:.1f} m/s"
    fast = samples.gate[samples.speed_mps > limit]
    names, counts = np.unique(fast, return_counts=True)
    shares = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
    return f"no straight taxi: of {counted(len(fast), 'epoch')} above {limit:g} m/s before lift-off: {shares}"
