"""Time of a touchdown by all that shows it.

Every witness is a likelihood over a grid of times, with a floor because any of them may be wrong. Their product gives
the time and its sigma; a witness whose own likelihood excludes that time disagrees.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.results.landing_categories import LINEAR_95
from groundstation.systems.landing.ground import Ground, Heights, ground_of, heights_of
from groundstation.systems.landing.height_witness import by_height
from groundstation.systems.landing.path import FlightPath
from groundstation.systems.landing.touchdown_answer import Witness, WitnessState
from groundstation.systems.landing.witnesses import (
    FLARE_S,
    Hint,
    LoadSamples,
    by_load,
    by_pitch,
    by_weight_on_wheels,
    by_wheel_speed,
    load_of,
    or_before,
)

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

EARLY_S, LATE_S = 12.0, 12.0  # a first guess is not farther off
STEP_S = 0.02
WRONG = 0.03  # probability that a witness says nothing of the touchdown
BOUNCES, BOUNCE_S = 0.2, 1.5  # share of landings that meet the ground once more, so long behind the contact
REACH_S = 30.0  # about the first guess, of what is read
LEAST_SIGMA_S = 0.05
DISAGREES = 0.005  # share of a witness's likelihood beyond the fused time on the farther side
SLOWEST_MPS = 8.0  # slower, nothing touches down on wheels: it is set down
ROUNDS, SETTLED_S = 4, 0.5  # the ground behind the touchdown is found again until that moves less


@dataclass(frozen=True, eq=False)
class Evidence:
    """Time of a touchdown with its witnesses, and what was found on the way."""

    time_s: float
    sigma_s: float
    confidence95_s: tuple[float, float]
    witnesses: tuple[Witness, ...]
    load: LoadSamples | None
    heights: tuple[tuple[Heights, Ground | None], ...]

    @property
    def found_by(self) -> str:
        """Witnesses that agree, the surest first."""
        agreeing = [one for one in self.witnesses if one.state == "agrees"]
        return ", ".join(one.name for one in sorted(agreeing, key=lambda one: one.sigma_s or np.inf))


def evidence_of(flight: "Flight", path: FlightPath, guess_s: float, until_s: float = np.inf) -> Evidence | None:
    """Find a touchdown near a first guess; None where nothing shows it or nothing rolls.

    ``until_s`` is when the aircraft flies again.
    """
    first_s, last_s = guess_s - REACH_S, min(guess_s + REACH_S, until_s)
    load = load_of(flight, first_s - FLARE_S, last_s)
    heights = heights_of(flight, lambda time_s: _motion_at(path, time_s), first_s, last_s)
    found: Evidence | None = None
    for _ in range(ROUNDS):
        found = _once(flight, path, guess_s, load, heights)
        if found is None:
            return None
        moved_s, guess_s = abs(found.time_s - guess_s), found.time_s
        if moved_s < SETTLED_S:
            break
    speed_mps = _speed_at(path, guess_s)
    return None if np.isfinite(speed_mps) and speed_mps < SLOWEST_MPS else found


def _speed_at(path: FlightPath, time_s: float) -> float:
    known = np.isfinite(path.ground_speed_mps)
    return float(np.interp(time_s, path.time_s[known], path.ground_speed_mps[known])) if known.any() else np.nan


def _once(
    flight: "Flight", path: FlightPath, guess_s: float, load: LoadSamples | None, heights: tuple[Heights, ...]
) -> Evidence | None:
    grid_s = guess_s + np.arange(-EARLY_S, LATE_S + 0.5 * STEP_S, STEP_S)
    grounds, by_heights = [], list[Hint]()
    for one in heights:
        ground = ground_of(one, guess_s)
        grounds.append((one, ground))
        by_heights.append(by_height(one, ground, grid_s))
    hints = [
        by_load(load, grid_s),
        by_wheel_speed(flight, _speed_at(path, guess_s), grid_s),
        *(by_heights or [Hint("height", "", None, None, "not logged")]),
        by_pitch(flight, grid_s),
        by_weight_on_wheels(flight, grid_s),
    ]
    others = [_with_floor(one.likelihood) for one in hints if one.likelihood is not None and one not in by_heights]
    together = [_with_floor(one.likelihood) for one in by_heights if one.likelihood is not None]
    if together:  # a height may show the last contact of several, and all of them the same one
        others.append(or_before(_normalised(np.prod(together, axis=0)), BOUNCES, BOUNCE_S, STEP_S))
    if not others:
        return None
    product = _normalised(np.prod(others, axis=0))
    time_s, sigma_s, interval_s = _middle(product, grid_s)
    return Evidence(
        time_s, sigma_s, interval_s, tuple(_told(one, grid_s, time_s) for one in hints), load, tuple(grounds)
    )


def _middle(density: FloatArray, grid_s: FloatArray) -> tuple[float, float, tuple[float, float]]:
    """Median of a likelihood, the sigma of its wider side, and its 95 % interval."""
    total = np.cumsum(density)
    low_s, time_s, high_s = (float(one) for one in np.interp((0.025, 0.5, 0.975), total, grid_s))
    least_s = LINEAR_95 * LEAST_SIGMA_S
    low_s, high_s = min(low_s, time_s - least_s), max(high_s, time_s + least_s)
    return time_s, max(high_s - time_s, time_s - low_s) / LINEAR_95, (low_s, high_s)


def _normalised(likelihood: FloatArray) -> FloatArray:
    total = likelihood.sum()
    return np.asarray(likelihood / total if total > 0.0 else np.full(len(likelihood), 1.0 / len(likelihood)))


def _with_floor(likelihood: FloatArray) -> FloatArray:
    return np.asarray((1.0 - WRONG) * _normalised(likelihood) + WRONG / len(likelihood))


def _told(hint: Hint, grid_s: FloatArray, fused_s: float) -> Witness:
    """Return a witness with its own time, and whether that allows the fused one."""
    plain = Witness(hint.name, hint.topic, hint.rate_hz, None, None, "not used", hint.reason)
    if hint.likelihood is None:
        return plain
    own = _normalised(hint.likelihood)
    low_s, time_s, high_s = (float(one) for one in np.interp((0.16, 0.5, 0.84), np.cumsum(own), grid_s))
    sigma_s = max(0.5 * (high_s - low_s), LEAST_SIGMA_S)
    beyond = float(own[grid_s <= fused_s].sum())
    state: WitnessState = "agrees" if DISAGREES < beyond < 1.0 - DISAGREES else "disagrees"
    return replace(plain, time_s=time_s, sigma_s=sigma_s, state=state, reason="")


def _motion_at(path: FlightPath, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance flown and ground speed at given times."""
    known = np.isfinite(path.ground_speed_mps)
    if not known.any():
        return np.zeros(len(time_s)), np.full(len(time_s), np.nan)
    at, speed = path.time_s[known], path.ground_speed_mps[known]
    along = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(at))])
    return np.interp(time_s, at, along), np.interp(time_s, at, speed)
