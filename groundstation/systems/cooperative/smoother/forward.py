"""First pass of the smoother: an extended filter over the knots gives the first reference.

It gates, and where no reading of a vehicle fits any more it opens what is in doubt there (a clock, a place), from the
first rejection on; then the pass is made again.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.chain import add_blocks, turned, updated
from groundstation.systems.cooperative.smoother.knots import Knots
from groundstation.systems.cooperative.smoother.layout import Layout
from groundstation.systems.cooperative.smoother.rows import Linearised, Rows
from groundstation.systems.cooperative.vehicles import PATIENCE

MOST_TRIMMED, TRIMMED = 10, 2.0  # rounds; medians beyond which a reading is left out
MOST_PASSES = 12  # one time of leaps more in each
Doubts = dict[tuple[int, int], int]  # vehicles opened at a knot, and how often


@dataclass(frozen=True)
class FirstPass:
    """Filtered states (t, N), and where vehicles were opened (knot, vehicle)."""

    x: FloatArray
    doubts: Doubts


def first_pass(
    prepared: Prepared, layout: Layout, knots: Knots, rows: Rows, settings: CooperativeSettings
) -> FirstPass:
    """Filter the session over its knots."""
    doubts: Doubts = {}
    for _ in range(MOST_PASSES):
        x, found = _Pass(prepared, layout, rows, settings, doubts).run(len(knots.time_s))
        fresh = set(found) - doubts.keys()
        if not fresh:
            break
        first = min(knot for knot, _ in fresh)  # what is rejected later may be because of it
        doubts = {**doubts, **{(knot, vehicle): 1 for knot, vehicle in fresh if knot == first}}
    return FirstPass(x, doubts)


def doubt_blocks(prepared: Prepared, layout: Layout, doubts: Doubts, knot: int, group: int) -> FloatArray | None:
    """Return the variances added before a knot to the vehicles of a group, (v, n, n)."""
    mine = [vehicle for at, vehicle in doubts if at == knot and layout.of_vehicle[vehicle, 0] == group]
    if not mine:
        return None
    blocks = np.zeros((layout.groups[group].count, layout.groups[group].size, layout.groups[group].size))
    for vehicle in mine:
        for state, variance in prepared.vehicles[vehicle].doubts.items():
            blocks[layout.of_vehicle[vehicle, 1], state, state] = variance
    return blocks


class _Pass:
    def __init__(
        self, prepared: Prepared, layout: Layout, rows: Rows, settings: CooperativeSettings, doubts: Doubts
    ) -> None:
        self._prepared, self._layout, self._rows, self._settings = prepared, layout, rows, settings
        self._doubts, self._at_doubt = doubts, {knot for knot, _ in doubts}
        self._rejected = np.zeros(len(prepared.vehicles), dtype=np.int64)
        self._since = np.zeros(len(prepared.vehicles), dtype=np.int64)  # knot of the first rejection in a row
        self._found: list[tuple[int, int]] = []
        events = prepared.events
        self._receiver = events.receiver[rows.event]
        self._source = np.where(rows.kind == PEER, events.source[rows.event], -1)

    def run(self, knots: int) -> tuple[FloatArray, list[tuple[int, int]]]:
        layout, rows = self._layout, self._rows
        m, P = layout.start.copy(), np.diag(layout.variance)
        x = np.empty((knots, layout.size))
        for knot in range(knots):
            if knot:
                m, P = m.copy(), P.copy()
                self._move(m, P, knot)
            part = slice(int(rows.first[knot]), int(rows.first[knot + 1]))
            if part.stop > part.start:
                seen = rows.linearise(m[None], knot, knot + 1)
                passes = self._judged(seen.residual, seen.values, P, part)
                self._count(passes, part, knot)
                if knot in self._at_doubt:
                    passes = self._agreeing(seen, P, part, passes)
                m_off, P = self._updated(seen, P, part, passes)
                m = m + m_off
            x[knot] = m
        return x, self._found

    def _move(self, m: FloatArray, P: FloatArray, knot: int) -> None:
        for number, group in enumerate(self._layout.groups):
            span = self._layout.span(number)
            moved, phi, noise = group.move(m[span].reshape(1, group.count, group.size), knot - 1, knot)
            m[span] = moved.ravel()
            turned(P, span, phi[0])
            add_blocks(P, span, noise[0])
            if knot in self._at_doubt:
                blocks = doubt_blocks(self._prepared, self._layout, self._doubts, knot, number)
                if blocks is not None:
                    add_blocks(P, span, blocks)

    def _judged(self, residual: FloatArray, values: FloatArray, P: FloatArray, part: slice) -> BoolArray:
        """Tell which rows are inside the gate, with what is known before."""
        rows, gate = self._rows, self._settings.gate_sigma
        passes = np.isfinite(residual)
        if gate > 0.0:
            columns = np.minimum(rows.columns[part], len(P) - 1)
            known = np.where(rows.columns[part] < len(P), values, 0.0)
            block = P[columns[:, :, None], columns[:, None, :]]
            spread = rows.variance[part] * rows.spread[part]
            total = spread + np.einsum("ri,rij,rj->r", known, block, known)
            with np.errstate(invalid="ignore"):
                passes &= residual**2 <= gate**2 * total
        return passes

    def _updated(self, seen: Linearised, P: FloatArray, part: slice, kept: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Return the step by the rows that are kept, and the covariance behind it."""
        rows = self._rows
        step, after, _ = updated(
            np.zeros(self._layout.size),
            P,
            rows.columns[part][kept],
            seen.values[kept],
            seen.residual[kept],
            1.0 / rows.variance[part][kept],
        )
        return step, after

    def _agreeing(self, seen: Linearised, P: FloatArray, part: slice, passes: BoolArray) -> BoolArray:
        """Return the rows that agree with one another where a clock or a place is open.

        Readings of one knot lie on both sides of a leap. What is open fits none of them, until the fewer are left out:
        those far beyond the median, again and again.
        """
        rows, kept = self._rows, passes.copy()
        sigma = np.sqrt(rows.variance[part] * rows.spread[part])
        for _ in range(MOST_TRIMMED):
            if not kept.any():
                return passes
            step, _after = self._updated(seen, P, part, kept)
            padded = np.concatenate([step, [0.0]])
            left = np.abs(seen.residual - (seen.values * padded[rows.columns[part]]).sum(axis=1)) / sigma
            limit = max(self._settings.gate_sigma, TRIMMED * float(np.median(left[kept])))
            agreeing = passes & (left <= limit)
            if (agreeing == kept).all():
                break
            kept = agreeing
        return kept

    def _count(self, passes: BoolArray, part: slice, knot: int) -> None:
        """Count rejections of each vehicle in a row."""
        receivers, sources = self._receiver[part], self._source[part]
        tells = self._rows.kind[part] != HEIGHT  # a height tells nothing of a clock or a place
        passes, receivers, sources = passes[tells], receivers[tells], sources[tells]
        if passes.all():
            self._rejected[receivers] = 0
            self._rejected[sources[sources >= 0]] = 0
            return
        for passed, receiver, source in zip(passes.tolist(), receivers.tolist(), sources.tolist(), strict=True):
            for who in (receiver, source) if source >= 0 else (receiver,):
                if passed:
                    self._rejected[who] = 0
                    continue
                if not self._rejected[who]:
                    self._since[who] = knot
                self._rejected[who] += 1
                if self._rejected[who] >= PATIENCE:
                    self._rejected[who] = 0
                    self._found.append((int(self._since[who]), who))
