"""Marks of alignment, stands and shutdown on the plots of the INS errors."""

import numpy as np

from groundstation.plots.marks import AnyMark, Limit, Spans
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.alignment_answer import GroundResult


def ground_marks(results: FlightResults, *, named: bool) -> list[AnyMark]:
    """Return spans of alignments and stands, and moments of set positions.

    Nothing for a flight without the answer. ``named``: they stand in the legend.
    """
    answer = results.answer(GroundResult)
    if answer is None:
        return []
    marks: list[AnyMark] = []
    before, standing, end = answer.alignment, answer.standing, answer.shutdown
    aligned = [(before.start_s, before.end_s), *((one.start_s, one.end_s) for one in answer.realignments)]
    stood = [(end.start_s, end.end_s)]
    if standing is not None:
        stood.insert(0, (standing.start_s, standing.end_s))
    for spans, name, role in ((aligned, "alignment", "limit"), (stood, "standing", "unused")):
        known = [(one[0], one[1]) for one in spans if one[0] is not None and one[1] is not None and one[1] > one[0]]
        if known:
            start, stop = np.array(known, dtype=np.float64).T
            kind = np.full(len(known), "")
            told = name if named else ""
            marks.append(Spans(start=start, end=stop, kind=kind, role=role, emphasis="faint", name=told))  # type: ignore[arg-type]
    marks += [
        Limit(value=one.end_s, is_upright=True, label="aligned" if one.is_aligned else "set")
        for one in answer.realignments
    ]
    return marks
