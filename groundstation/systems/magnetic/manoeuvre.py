"""Figure in the log: turns of steady bank, opposite ones covering the circle together."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, unwrap, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.magnetic.answer import Turn
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.motion import runs

SMOOTHED_S = 1.0
BREAK_S = 3.0  # a longer step between readings ends a turn
WORTH_TELLING_DEG = 30.0  # shorter turns are everyday flying
BINS = 360


@dataclass(frozen=True)
class FoundTurn:
    """A turn and its readings, rows [first, last)."""

    turn: Turn
    first: int
    last: int

    @property
    def is_right(self) -> bool:
        return self.turn.bank_deg > 0.0


@dataclass(frozen=True)
class OppositeTurns:
    """Opposite turns of equal bank.

    ``covered_share`` is that of the circle which both branches cover.
    """

    turns: tuple[FoundTurn, ...]
    covered_share: float

    def rows(self, right: bool) -> NDArray[np.intp]:
        """Readings of one branch."""
        return np.concatenate([np.arange(one.first, one.last) for one in self.turns if one.is_right == right])

    @property
    def start_s(self) -> float:
        return min(one.turn.start_s for one in self.turns)

    @property
    def end_s(self) -> float:
        return max(one.turn.end_s for one in self.turns)

    def bank_deg(self, right: bool) -> float:
        """Mean bank of one branch, weighted by the readings."""
        ours = [one.turn for one in self.turns if one.is_right == right]
        return float(np.average([turn.bank_deg for turn in ours], weights=[turn.samples for turn in ours]))


def find_turns(readings: Readings, is_airborne: BoolArray, settings: MagneticSettings) -> list[FoundTurn]:
    """Find turns of about constant bank in order of time.

    A turn that is of no use has the reason.
    """
    roll = _smoothed(readings)
    together = np.concatenate([[0], np.cumsum(np.diff(readings.time_s) > BREAK_S)])
    found = []
    for sign in (1.0, -1.0):
        for first, last in runs(sign * roll >= settings.bank_min_deg):
            for begin, end in _unbroken(together, first, last):
                steady = np.abs(roll[begin:end] - np.median(roll[begin:end])) <= settings.bank_band_deg
                longest = max(runs(steady), key=lambda run: run[1] - run[0], default=(0, 0))
                if longest[1] - longest[0] > 1:
                    found.append(_turn(readings, is_airborne, begin + longest[0], begin + longest[1], settings))
    worth = [one for one in found if abs(one.turn.turned_deg) >= WORTH_TELLING_DEG]
    return sorted(worth, key=lambda one: one.first)


def find_figures(
    readings: Readings, turns: list[FoundTurn], settings: MagneticSettings
) -> tuple[list[OppositeTurns], list[FoundTurn]]:
    """Figures of opposite turns, and every turn with what became of it.

    Usable turns of about equal bank and near in time are gathered, in order of time, until right and left ones cover
    the circle of magnetic headings together. Where none does, the fullest gathering counts, if it covers
    ``coverage_usable``.
    """
    heading = readings.magnetic_heading_deg
    whole: list[OppositeTurns] = []
    partial: list[OppositeTurns] = []
    for candidate in (one for one in turns if one.turn.state == "used"):
        group = next((group for group in partial if _belongs(candidate, group, settings)), OppositeTurns((), 0.0))
        grown = _covered(OppositeTurns((*group.turns, candidate), 0.0), heading, settings)
        partial = [other for other in partial if other is not group]
        (whole if grown.covered_share >= settings.coverage_min else partial).append(grown)
    if not whole:
        usable = [figure for figure in partial if figure.covered_share >= settings.coverage_usable]
        whole = [max(usable, key=lambda figure: figure.covered_share)] if usable else []
    taken = {one.first for figure in whole for one in figure.turns}
    judged = [one if one.first in taken else _left_over(one, turns, partial, settings) for one in turns]
    return sorted(whole, key=lambda figure: figure.start_s), judged


def covered_bins(heading_deg: FloatArray, gap_deg: float) -> BoolArray:
    """Tell which bins of 1 deg on the circle, shape (360,), hold a heading.

    A gap no wider than ``gap_deg`` counts as covered.
    """
    held = np.zeros(BINS, dtype=bool)
    held[np.minimum(wrap_360(heading_deg).astype(np.intp), BINS - 1)] = True
    return ~_in_wide_gap(held, gap_deg)


def widest_gap_deg(held: BoolArray) -> float:
    """Width of the widest run of empty bins on the circle."""
    if not held.any():
        return float(BINS)
    turned = np.roll(held, -int(np.argmax(held)))
    return float(max((end - start for start, end in runs(~turned)), default=0))


def _in_wide_gap(held: BoolArray, gap_deg: float) -> BoolArray:
    if not held.any():
        return np.ones(BINS, dtype=bool)
    first = int(np.argmax(held))
    wide = np.zeros(BINS, dtype=bool)
    for start, end in runs(~np.roll(held, -first)):
        wide[start:end] = end - start > gap_deg
    return np.roll(wide, first)


def _smoothed(readings: Readings) -> FloatArray:
    """Roll averaged over about a second."""
    steps = np.diff(readings.time_s)
    width = max(1, round(SMOOTHED_S / float(np.median(steps)))) if steps.size and np.median(steps) > 0.0 else 1
    width = min(width | 1, max(len(readings) // 2, 1) | 1)
    padded = np.pad(readings.roll_deg, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def _unbroken(together: NDArray[np.intp], first: int, last: int) -> list[tuple[int, int]]:
    edges = [first, *(first + 1 + np.flatnonzero(np.diff(together[first:last]))), last]
    return [(int(begin), int(end)) for begin, end in pairwise(edges)]


def _turn(readings: Readings, is_airborne: BoolArray, first: int, last: int, settings: MagneticSettings) -> FoundTurn:
    rows = slice(first, last)
    bank, altitude = readings.roll_deg[rows], readings.altitude_m[rows]
    known = altitude[np.isfinite(altitude)]
    heading = unwrap(readings.true_heading_deg[rows])
    turn = Turn(
        float(readings.time_s[first]),
        float(readings.time_s[last - 1]),
        float(np.mean(bank)),
        float(np.std(bank)),
        float(heading[-1] - heading[0]),
        float(np.mean(known)) if known.size else None,
        float(np.ptp(known)) if known.size else None,
        last - first,
        "used",
    )
    reason = _objection(turn, bool(is_airborne[rows].all()), settings)
    return FoundTurn(replace(turn, state="rejected" if reason else "used", reason=reason), first, last)


def _objection(turn: Turn, is_airborne: bool, settings: MagneticSettings) -> str:
    """Return why a turn is of no use; empty when it is."""
    if not is_airborne:
        return "on the ground"
    if turn.turned_deg * turn.bank_deg < 0.0:
        return f"turned {turn.turned_deg:+.0f} deg against its bank of {turn.bank_deg:+.0f} deg"
    if abs(turn.turned_deg) < settings.turned_min_deg:
        return f"turned {abs(turn.turned_deg):.0f} deg, at least {settings.turned_min_deg:g}"
    if turn.samples < settings.turn_samples_min:
        return f"{turn.samples} readings, at least {settings.turn_samples_min}"
    if abs(turn.bank_deg) > settings.bank_max_deg:
        return f"bank {abs(turn.bank_deg):.0f} deg, at most {settings.bank_max_deg:g}"
    if turn.bank_sd_deg > settings.bank_sd_max_deg:
        return f"unsteady bank: standard deviation {turn.bank_sd_deg:.1f} deg, at most {settings.bank_sd_max_deg:g}"
    if turn.altitude_range_m is not None and turn.altitude_range_m > settings.altitude_range_max_m:
        return f"altitude changed by {turn.altitude_range_m:.0f} m, at most {settings.altitude_range_max_m:g}"
    return ""


def _belongs(candidate: FoundTurn, group: OppositeTurns, settings: MagneticSettings) -> bool:
    first = group.turns[0].turn
    is_equal = abs(abs(candidate.turn.bank_deg) - abs(first.bank_deg)) <= settings.bank_difference_max_deg
    return is_equal and candidate.turn.start_s - group.end_s <= settings.pair_gap_max_s


def _covered(figure: OppositeTurns, heading_deg: FloatArray, settings: MagneticSettings) -> OppositeTurns:
    if len({one.is_right for one in figure.turns}) < 2:
        return figure
    both = [covered_bins(heading_deg[figure.rows(right)], settings.bin_gap_max_deg) for right in (True, False)]
    return replace(figure, covered_share=float(np.mean(both[0] & both[1])))


def _left_over(
    one: FoundTurn, turns: list[FoundTurn], partial: list[OppositeTurns], settings: MagneticSettings
) -> FoundTurn:
    """A usable turn that no figure holds, with the reason."""
    if one.turn.state == "rejected":
        return one
    group = next((group for group in partial if any(other.first == one.first for other in group.turns)), None)
    if group is not None and group.covered_share > 0.0:
        reason = f"with its opposite turns it covers {group.covered_share:.0%} of the circle"
    else:
        banks = [abs(other.turn.bank_deg) for other in turns if other.is_right != one.is_right]
        nearest = min(banks, key=lambda bank: abs(bank - abs(one.turn.bank_deg)), default=None)
        reason = "no opposite turn" if nearest is None else (
            f"no opposite turn of equal bank within {settings.pair_gap_max_s:g} s: {abs(one.turn.bank_deg):.0f} deg, "
            f"opposite {nearest:.0f} deg, may differ by {settings.bank_difference_max_deg:g}"
        )  # fmt: skip
    return replace(one, turn=replace(one.turn, state="rejected", reason=reason))
