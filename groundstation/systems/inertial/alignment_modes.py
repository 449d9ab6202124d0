"""Alignment of an INS before it navigates: by mode, still output or standstill."""

import numpy as np

from groundstation.base.records import BoolArray
from groundstation.systems.inertial.alignment_answer import AlignmentBasis, AlignmentKind, InsAlignment
from groundstation.systems.inertial.alignment_stands import GroundMotion
from groundstation.systems.inertial.answer import NavigationStart
from groundstation.systems.inertial.differences import VELOCITY_FIELDS
from groundstation.systems.inertial.mode_spans import LEAST_ALIGNMENT_S, ModeSpans
from groundstation.tables.motion import runs
from groundstation.tables.sources import AIDED
from groundstation.tables.table import Flight

LEAST_STILL_S = 20.0  # velocities of exactly zero for so long are not navigation
LONGEST_STORED_S = 150.0  # with a stored heading only the level is found
SHORTEST_GYRO_S = 240.0  # at mid latitudes a gyrocompass needs minutes
LEAST_MOVED_S = 3
IN_MOTION = 0.5  # share of an alignment that is flown or driven


def still_until_s(flight: Flight, topic: str) -> tuple[float, float] | None:
    """Return the span at the beginning in which the INS writes velocities of exactly zero.

    None where it is short, or the INS never writes anything else.
    """
    table = flight[topic].unique_times()
    known, moves = table.valid(*VELOCITY_FIELDS), np.zeros(len(table), dtype=bool)
    for name in VELOCITY_FIELDS:
        moves |= table.values(name) != 0.0
    moves &= known
    if not moves.any():
        return None
    start_s, end_s = (float(flight.seconds(table.time_ns[int(np.argmax(rows))])) for rows in (known, moves))
    return (start_s, end_s) if end_s - start_s >= LEAST_STILL_S else None


def alignment_before(
    flight: Flight,
    topic: str,
    modes: ModeSpans,
    motion: GroundMotion,
    start: NavigationStart | None,
    kind: tuple[str, str],
    stated: str,
) -> InsAlignment:
    """Return the alignment before navigation.

    Parameters
    ----------
    stated : str
        How the INS is aligned, as the aircraft file or the log says it; empty where nobody does.
    kind : (str, str)
        Of the INS, and why.
    """
    first_s = float(flight.time_s(topic)[0])
    span, basis = _span(flight, topic, modes, start, first_s)
    if span is None:
        return _unseen(basis, motion, start, first_s, kind, stated)
    length_s = span[1] - span[0]
    # a recorder that was on before it would have shown another mode, or nothing
    is_cut = basis != "mode" or span[0] <= modes.first_s + 1.0
    moved, moved_m, moved_at_s, share = moved_within(motion, *span)
    name, reason = _kind_of(kind, stated, length_s, is_cut=is_cut, share=share)
    return InsAlignment(name, basis, reason, *span, length_s, is_cut, moved, moved_m, moved_at_s)


def _span(
    flight: Flight, topic: str, modes: ModeSpans, start: NavigationStart | None, first_s: float
) -> tuple[tuple[float, float] | None, AlignmentBasis]:
    start_s = None if start is None else start.time_s
    before = [one for one in modes.spans_s if start_s is None or one[0] <= start_s]
    if before and (start_s is not None or before[0][0] <= modes.first_s + LEAST_ALIGNMENT_S):
        return (before[-1] if start_s is not None else before[0]), "mode"
    still = None if modes.is_logged and modes.spans_s else still_until_s(flight, topic)
    if still is not None:
        return still, "still_output"
    if start is not None and start_s is not None and start.basis == "stated" and start_s > first_s:
        return (first_s, start_s), "stated"
    return None, "standstill" if start is not None and start.basis == "standstill" else "none"


def _unseen(
    basis: AlignmentBasis,
    motion: GroundMotion,
    start: NavigationStart | None,
    first_s: float,
    kind: tuple[str, str],
    stated: str,
) -> InsAlignment:
    """Return an alignment that ended before the log began."""
    name, reason = _kind_of(kind, stated, None, is_cut=True, share=None)
    if basis == "standstill":
        where = "it navigates already where the log begins, parked"
    elif motion.spans() and motion.spans()[0][0] <= first_s + LEAST_ALIGNMENT_S:
        where = "it navigates already where the log begins, at a stand"
    else:
        where = "the log begins in motion, after the alignment"
    return InsAlignment(name, basis, f"{reason}; {where}" if reason else where)


def _kind_of(
    kind: tuple[str, str], stated: str, length_s: float | None, *, is_cut: bool, share: float | None
) -> tuple[AlignmentKind, str]:
    """Return the kind of an alignment with its reason.

    Examples
    --------
    >>> _kind_of(("unaided", ""), "", 600.0, is_cut=False, share=0.0)
    ('gyrocompass', 'by its length of 10.0 min')
    >>> _kind_of(("unaided", ""), "stored heading", 600.0, is_cut=False, share=0.0)
    ('stored_heading', 'stated: stored heading')
    """
    if kind[0] == AIDED:
        return "gnss_aided", kind[1]
    told = stated.strip().lower()
    for word, name in (("gyro", "gyrocompass"), ("stored", "stored_heading"), ("motion", "in_motion")):
        if word in told:
            return name, f"stated: {stated.strip()}"  # type: ignore[return-value]
    if share is not None and share > IN_MOTION:
        return "in_motion", f"the aircraft moves in {100.0 * share:.0f} % of it"
    if length_s is None:
        return "unknown", ""
    if length_s >= SHORTEST_GYRO_S:
        return "gyrocompass", f"by its length of {length_s / 60.0:.1f} min"
    if is_cut:
        return "unknown", "the log begins within it"
    if length_s <= LONGEST_STORED_S:
        return "stored_heading", f"by its length of {length_s:.0f} s: too short to find north"
    return "unknown", f"{length_s:.0f} s: long for a stored heading, short for a gyrocompass"


def moved_within(
    motion: GroundMotion, start_s: float, end_s: float
) -> tuple[bool | None, float | None, float | None, float | None]:
    """Tell whether the aircraft moved in a span, by GNSS.

    Returns
    -------
    is_moved, distance, time of the first motion, share of the known time in motion
        None where GNSS tells nothing of half of the span.
    """
    rows = np.flatnonzero(motion.within(start_s, end_s))
    seen: BoolArray = np.asarray(np.isfinite(motion.gnss_mps[rows]).all(axis=1))
    if not len(rows) or seen.sum() < 0.5 * len(rows):
        return None, None, None, None
    moves = motion.moves[rows] & seen
    lasting = [(first, end) for first, end in runs(moves) if end - first >= LEAST_MOVED_S]
    share = float(np.sum(moves) / np.sum(seen))
    if not lasting:
        return False, None, None, share
    place = motion.place_m[rows]
    known = np.flatnonzero(np.isfinite(place).all(axis=1))
    distance = float(np.max(np.hypot(*(place[known] - place[known[0]]).T))) if len(known) else None
    return True, distance, float(motion.time_s[rows[lasting[0][0]]]), share
