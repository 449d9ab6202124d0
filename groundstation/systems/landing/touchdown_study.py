"""Monte Carlo study of the touchdown: does its interval hold the contact?

The family is that of docs/evidence/approaches.md, written down before it was run; the other families each break one
assumption.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.simulation.touchdown import (
    SimulatedTouchdown,
    TouchdownChannels,
    TouchdownMotion,
    simulate_touchdown,
)
from groundstation.systems.landing.evidence import Evidence, evidence_of
from groundstation.systems.landing.path import path_of
from groundstation.systems.landing.second_contact import second_contacts
from groundstation.systems.landing.settings import LandingSettings
from groundstation.systems.landing.sink import sink_rate_of
from groundstation.systems.study import StudyResult, judged_families, section, share_inside, table, table_of

Progress = Callable[[str], None]
MISSING = 0.35  # probability that a log lacks a channel
EARLY_S, LATE_S = 6.0, 3.0  # ends of the flight by the phases, before and after the contact
NEAR_S = 1.0  # a second contact found within that of the true one
Change = Callable[[TouchdownMotion, TouchdownChannels, np.random.Generator], tuple[TouchdownMotion, TouchdownChannels]]


@dataclass(frozen=True)
class TouchdownFamily:
    """Family of touchdowns: its change to those of the plain family."""

    name: str
    what: str
    change: Change


def _flown(**ranges: tuple[float, float] | None) -> Change:
    """Make a change of the motion: each field drawn evenly from its range, None for none."""

    def change(
        motion: TouchdownMotion, channels: TouchdownChannels, rng: np.random.Generator
    ) -> tuple[TouchdownMotion, TouchdownChannels]:
        drawn = {name: None if ends is None else float(rng.uniform(*ends)) for name, ends in ranges.items()}
        return replace(motion, **drawn), channels  # type: ignore[arg-type]

    return change


def _late_wheels(
    motion: TouchdownMotion, channels: TouchdownChannels, rng: np.random.Generator
) -> tuple[TouchdownMotion, TouchdownChannels]:
    return motion, replace(channels, wheels_hz=channels.wheels_hz or 1.0, wheels_late_s=float(rng.uniform(2.0, 5.0)))


def _late_receiver(
    motion: TouchdownMotion, channels: TouchdownChannels, _rng: np.random.Generator
) -> tuple[TouchdownMotion, TouchdownChannels]:
    return motion, replace(channels, receiver_late_s=1.2)


def _floats(
    motion: TouchdownMotion, channels: TouchdownChannels, rng: np.random.Generator
) -> tuple[TouchdownMotion, TouchdownChannels]:
    float_s = float(rng.uniform(5.0, 10.0))
    return replace(motion, float_s=float_s, sink_mps=0.5 / float_s), channels


FAMILIES: tuple[TouchdownFamily, ...] = (
    TouchdownFamily("plain", "as assumed", lambda motion, channels, rng: (motion, channels)),
    TouchdownFamily(
        "gust",
        "0.15 g of turbulence, one of 0.3 g",
        _flown(turbulence_g=(0.15, 0.15), gust_g=(0.3, 0.3), gust_s=(1, 4)),
    ),
    TouchdownFamily("hard", "3 to 4 m/s at the contact", _flown(sink_mps=(3.0, 4.0))),
    TouchdownFamily("soft", "0.05 to 0.2 m/s at the contact", _flown(sink_mps=(0.05, 0.2))),
    TouchdownFamily("float", "5 to 10 s from 0.5 m down", _floats),
    TouchdownFamily("late switch", "weight on wheels 2 to 5 s late", _late_wheels),
    TouchdownFamily("bounce", "1 to 2 s in the air once more", _flown(bounce_s=(1.0, 2.0), sink_mps=(0.8, 2.0))),
    TouchdownFamily(
        "rising", "runway rising 3 %, 1 % less behind the contact", _flown(slope=(0.03, 0.03), kink=(-0.01, -0.01))
    ),
    TouchdownFamily("tail dragger", "the nose never falls", _flown(nose_after_s=None)),
    TouchdownFamily("late receiver", "receiver 1.2 s late", _late_receiver),
)


def study_touchdown(
    runs: int = 200,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    families: tuple[TouchdownFamily, ...] = FAMILIES,
) -> StudyResult:
    """Land in every family and judge times, sink rates and second contacts against the truth.

    Parameters
    ----------
    runs : int
        Landings of each family; 1000 give the coverage to 0.7 %.
    seed : int
        Run k of every family has the seed (seed, k): families differ by what they change alone.
    progress : callable, optional
        Called with one line for each family.
    families : tuple of TouchdownFamily
    """
    rows = judged_families(
        families,
        lambda one: _judged(one, runs, seed),
        progress,
        lambda row: f"{row['measured']:.0f} of {runs} measured",
    )
    found = table_of("touchdown_coverage", rows, DIGITS)
    return StudyResult("touchdown", (found,), _page(found, families, runs, seed))


DIGITS = {
    "measured": 0,
    "coverage": 3,
    "coverage_sigma": 3,
    "rms_of_error_over_sigma": 2,
    "median_sigma_s": 2,
    "median_abs_error_s": 2,
    "median_error_s": 2,
    "phases_abs_error_s": 2,
    "sink_coverage": 3,
    "median_sink_sigma_mps": 2,
    "second_contact_share": 3,
}


def drawn(rng: np.random.Generator) -> tuple[TouchdownMotion, TouchdownChannels]:
    """Return a member of the plain family."""
    speed = float(rng.uniform(28.0, 75.0))

    def logged(rates: tuple[float, ...]) -> float:
        rate = float(rng.choice(rates))
        return rate if rng.random() >= MISSING else 0.0

    motion = TouchdownMotion(
        speed_mps=speed,
        sink_mps=float(rng.uniform(0.2, min(2.0, 0.8 * speed * np.tan(np.deg2rad(3.0))))),
        flare_s=float(rng.uniform(3.0, 6.0)),
        float_s=float(rng.uniform(0.0, 1.5)),
        slope=float(rng.normal(0.0, 0.006)),
        flare_pitch_deg=float(rng.uniform(2.0, 6.0)),
        nose_after_s=float(rng.exponential(1.0)),
    )
    channels = TouchdownChannels(
        load_hz=logged((1.0, 2.0, 4.0, 8.0, 16.0)),
        pitch_hz=logged((1.0, 2.0, 4.0, 10.0)),
        wheels_hz=logged((1.0, 2.0, 4.0)),
        wheels_late_s=float(rng.exponential(0.4)),
        wheel_speed_hz=4.0 if rng.random() < 0.1 else 0.0,
        receiver_hz=float(rng.choice((1.0, 2.0, 5.0, 10.0))),
        has_altitude=bool(rng.random() >= MISSING),
        has_vertical_speed=bool(rng.random() >= MISSING),
        receiver_late_s=float(rng.uniform(0.0, 0.6)),
        radio_hz=logged((0.5, 1.0, 2.0, 4.0)),
        radio_step_m=float(rng.choice((0.1, 0.3))),
    )
    return motion, channels


def _judged(family: TouchdownFamily, runs: int, seed: int) -> dict[str, object]:
    errors, held, scaled, sigmas, guesses, sinks, sink_sigmas, seconds = (list[float]() for _ in range(8))
    for run in range(runs):
        rng = np.random.default_rng((seed, run))
        motion, channels = family.change(*drawn(rng), rng)
        made = simulate_touchdown(motion, channels, rng)
        guess_s = made.contact_s + float(rng.uniform(-EARLY_S, LATE_S))
        path = path_of(made.flight, LandingSettings())
        found = evidence_of(made.flight, path, guess_s)
        if found is None:
            continue
        errors.append(found.time_s - made.contact_s)
        scaled.append(errors[-1] / found.sigma_s)
        held.append(float(found.confidence95_s[0] <= made.contact_s <= found.confidence95_s[1]))
        sigmas.append(found.sigma_s)
        guesses.append(guess_s - made.contact_s)
        sink = sink_rate_of(found)
        if sink is not None and sink.sigma_mps is not None:
            sinks.append((sink.rate_mps - _mean_sink(motion)) / sink.sigma_mps)
            sink_sigmas.append(sink.sigma_mps)
        seconds.append(_second(found, made))
    share = float(np.mean(held)) if held else np.nan
    return {
        "family": family.name,
        "measured": float(len(errors)),
        "coverage": share,
        "coverage_sigma": float(np.sqrt(share * (1.0 - share) / max(len(errors), 1))),
        "rms_of_error_over_sigma": float(np.sqrt(np.mean(np.square(scaled)))) if scaled else np.nan,
        "median_sigma_s": _median(sigmas),
        "median_abs_error_s": _median(np.abs(errors)),
        "median_error_s": _median(errors),
        "phases_abs_error_s": _median(np.abs(guesses)),
        "sink_coverage": share_inside(sinks, 1.96),
        "median_sink_sigma_mps": _median(sink_sigmas),
        "second_contact_share": float(np.nanmean(seconds)) if np.isfinite(seconds).any() else float("nan"),
    }


def _mean_sink(motion: TouchdownMotion) -> float:
    """Return the true mean sink rate over the last second, relative to the runway."""
    flared = max(1.0 - motion.float_s, 0.0)
    growth = (motion.speed_mps * np.tan(np.deg2rad(3.0)) - motion.sink_mps) / motion.flare_s
    return float(motion.sink_mps + 0.5 * growth * flared**2)


def _second(found: Evidence, made: SimulatedTouchdown) -> float:
    """Return 1 where a second contact was told, 0 where not; NaN without a fast load."""
    if found.load is None or found.load.rate_hz < 4.0:
        return float("nan")
    told = second_contacts(found)
    if made.second_contact_s is None:
        return float(bool(told))
    return float(any(abs(one.time_s - made.second_contact_s) < NEAR_S for one in told))


def _median(values: ArrayLike) -> float:
    """Return the median; NaN where nothing was measured."""
    return float(np.median(np.asarray(values, dtype=np.float64))) if np.size(values) else float("nan")


def _page(data: FigureData, families: tuple[TouchdownFamily, ...], runs: int, seed: int) -> tuple[Section, ...]:
    head = section(
        "Study: the touchdown by its witnesses",
        f"{runs} landings of each family of docs/evidence/approaches.md (seed {seed}); those without any witness are "
        "not measured. Coverage: share of runs whose 95 % interval holds the contact. Second contact: share of the "
        "logs with a fast load in which one is told (in the family of bounces: the true one).",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return (head,)
