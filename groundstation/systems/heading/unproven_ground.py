"""Straight epochs that are left out because nothing proves ground contact.

A vehicle that is found to roll was on the ground at them too: what they say against the answer is heard.
"""

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.methods.taxi.gating import NOT_PROVEN, is_straight_and_fast
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import HeadingResult, UnprovenGround
from groundstation.systems.heading.gates_answer import CURED_BY_MORE_DATA
from groundstation.systems.heading.reason_answer import BETWEEN
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.wording import left_out_told, told
from groundstation.tables.phases import Phases

FOUND_TO_ROLL = "taken as ground throughout: the vehicle is found to roll"


@dataclass(frozen=True)
class Throughout:
    """Ground contact at every epoch, as of a vehicle that only rolls."""

    mask: BoolArray
    method: str = FOUND_TO_ROLL


def on_ground_throughout(time_ns: Int64Array) -> Throughout:
    """Take every epoch as one on the ground."""
    return Throughout(np.ones(len(time_ns), dtype=bool))


def is_found_to_roll(phases: Phases | None) -> bool:
    """Tell whether the vehicle rolls as found, and nobody states it."""
    return phases is not None and phases.vehicle.kind == "rolls" and not phases.vehicle.is_stated


def is_left_out(samples: TaxiSamples, settings: HeadingSettings) -> BoolArray:
    """Tell which straight epochs are left out as ground is not proven, shape (n,)."""
    return np.asarray(is_straight_and_fast(samples, settings) & (samples.gate == NOT_PROVEN))


def count_left_out(
    samples: TaxiSamples, settings: HeadingSettings, whole: HeadingResult | None
) -> UnprovenGround | None:
    """Count the straight epochs left out, beside the error by all of them.

    None where there is none.
    """
    left = int(np.sum(is_left_out(samples, settings)))
    if not left:
        return None
    return UnprovenGround(left, left + int(samples.is_used.sum()), None if whole is None else whole.error_deg)


def reason_of(left: UnprovenGround, found: "Objections | None") -> str:
    """Return how many are left out, and what they say."""
    told_left = left_out_told(left)
    if left.error_deg is None:
        return f"{told_left}, of a vehicle that is not found to roll"
    with_them = f"{told_left}, with them {left.error_deg:+.3f} deg"
    return f"{with_them}: {found.told}" if found is not None and found.count else with_them


@dataclass(frozen=True)
class Objections:
    """Objections of the epochs left out to the answer without them, how many and in words."""

    count: int
    told: str
    is_curable: bool = False  # all of them only ask for more data


def objections(
    without: tuple[Gate, ...], interval_deg: tuple[float, float], whole: HeadingResult | None
) -> Objections | None:
    """Return what fails with every straight epoch and not without those left out.

    The other error outside the interval of the answer is one more.

    Parameters
    ----------
    without : tuple of Gate
        Gates of the answer by proven ground alone.
    interval_deg : (low, high)
        Its whole 95 % interval.
    whole : HeadingResult or None
        Answer by every straight epoch; None where it was not asked for.
    """
    if whole is None:
        return None
    before = {gate.name for gate in without if gate.state == "failed"}
    failed = (gate for gate in whole.gates if gate.required and gate.state == "failed")
    further = tuple(gate for gate in failed if gate.name not in before)
    middle, half = 0.5 * (interval_deg[0] + interval_deg[1]), 0.5 * (interval_deg[1] - interval_deg[0])
    is_outside = abs(float(wrap_180(whole.error_deg - middle))) > half
    outside = "the error lies outside the 95 % interval" if is_outside else ""
    parts = (outside, told(further).replace(BETWEEN, ", "))
    is_curable = not is_outside and all(gate.name in CURED_BY_MORE_DATA for gate in further)
    return Objections(len(further) + is_outside, ", ".join(filter(None, parts)), bool(further) and is_curable)
