"""Several INS of one flight: each against the reference, in pairs, and which one is off."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from groundstation.base.errors import NotAssessableError
from groundstation.systems.inertial.units_answer import (
    LEAST_S,
    InsFault,
    InsPair,
    InsUnit,
    UnitsResult,
    UnitState,
    Verdict,
)
from groundstation.systems.inertial.units_compare import Judged, against_reference, in_pairs
from groundstation.systems.inertial.units_figures import figures_of
from groundstation.systems.inertial.units_growth import Noise
from groundstation.systems.inertial.units_heading import heading_faults
from groundstation.systems.inertial.units_limits import limits_of, share_of_limits
from groundstation.systems.inertial.units_prepare import Comparable, Prepared, prepare
from groundstation.systems.inertial.units_short import WHY_NOT, differ_in_short, together_s
from groundstation.systems.inertial.units_track import ReferenceTrack, UnitTrack
from groundstation.systems.inertial.units_verdict import growth_faults, is_common, own_faults, sentence_of, size_of
from groundstation.tables.sources import AIDED

DEFAULT_LIMITS = "navigation"  # of a class that was not simulated


def judge_units(
    units: Sequence[UnitTrack],
    reference: ReferenceTrack | None = None,
    *,
    ins_class: str = DEFAULT_LIMITS,
    ins_class_origin: str = "default",
) -> UnitsResult:
    """Hold several INS of one flight against a reference and against each other.

    Parameters
    ----------
    units : sequence of UnitTrack
        Two or more.
    reference : ReferenceTrack, optional
        GNSS or the best trajectory; it may have gaps.
    ins_class : str
        Class whose simulated units are the reference distribution of what honest units do, for units that state none of
        their own; limits are those of the class navigation where it was not simulated.
    ins_class_origin : str
        Who chose it.

    Raises
    ------
    NotAssessableError
        When there are fewer than two units with samples, or no two overlap. Units that do so for less than
        :data:`LEAST_S` are not judged: their differences are told.

    Notes
    -----
    Clocks, exchanged axes, held outputs and steps are found first and taken out. What is left grows: the radial rate
    (slope through the origin) and the RMS of velocity of each unit against the reference, and of each pair, are held
    against what honest units of the class do in the same time, Schuler oscillations and all: a limit is exceeded in
    ``false_alarm_share`` of simulated flights. A unit that GNSS corrects, or one that repeats another, is no witness.
    """
    tracks = [one for one in units if len(one.time_s) > 1]
    if len(tracks) < 2:
        raise NotAssessableError("ins_units", f"{len(tracks)} INS with samples", "two or more")
    limits_class = _limits_class(ins_class)
    class_origin = ins_class_origin if limits_class == ins_class else f"{ins_class} was not simulated"
    longest_s = max(together_s(*pair) for pair in combinations(tracks, 2))
    if longest_s < LEAST_S:
        short = differ_in_short(tracks, ins_class=limits_class, ins_class_origin=class_origin)
        if short is None:
            told = "no time" if longest_s < 0.0 else f"{longest_s:.2g} s"
            raise NotAssessableError("ins_units", f"{told} of two INS together", f"at least {LEAST_S:.0f} s")
        return short
    classes = {one.topic: _limits_class(one.ins_class) if one.ins_class else limits_class for one in tracks}
    found = prepare(tracks, reference)
    by_reference = against_reference(found, _noise(reference), classes)
    pairs = in_pairs(found, classes)
    if all(one.shown is None for one in (*pairs, *by_reference.values())):
        raise NotAssessableError("ins_units", "no two INS with values at the same time")
    faults = own_faults(found, reference) + growth_faults(found, by_reference, pairs, reference) + heading_faults(pairs)
    judged = sum(bool(one.ratios) for one in pairs)
    states = _states(found, faults, by_reference, pairs)
    common = is_common(by_reference, pairs)
    return UnitsResult(
        verdict=_verdict(faults, states),
        sentence=sentence_of(faults, by_reference, judged, reference, common=common),
        is_common=common,
        off=tuple(topic for topic, state in states.items() if state in ("off", "one_of")),
        units=tuple(
            _unit(one, states[one.topic], by_reference.get(one.topic), classes[one.topic]) for one in found.units
        ),
        pairs=tuple(_told(found, pair) for pair in pairs),
        faults=tuple(faults),
        against="" if reference is None else reference.topic,
        against_title="" if reference is None else reference.title,
        ins_class=limits_class,
        ins_class_origin=class_origin,
        false_alarm_share=share_of_limits(),
        figures=figures_of(found),
    )


def _limits_class(ins_class: str) -> str:
    """Return the class itself where it has limits."""
    return ins_class if limits_of(ins_class, 1.0, is_start_known=True) is not None else DEFAULT_LIMITS


def _noise(reference: ReferenceTrack | None) -> Noise:
    if reference is None:
        return Noise()
    return Noise(
        reference.position_sigma_m,
        reference.velocity_sigma_mps,
        reference.position_correlation_s,
        reference.velocity_correlation_s,
    )


def _states(
    found: Comparable, faults: Sequence[InsFault], by_reference: Mapping[str, Judged], pairs: Sequence[Judged]
) -> dict[str, UnitState]:
    states: dict[str, UnitState] = {}
    off = {fault.topics[0] for fault in faults if len(fault.topics) == 1}
    one_of = {topic for fault in faults if len(fault.topics) > 1 for topic in fault.topics}
    for one in found.units:
        topic = one.topic
        told = [pair for pair in pairs if topic in pair.topics and pair.ratios]
        own = by_reference.get(topic)
        is_judged = bool(told) or (own is not None and bool(own.ratios))
        states[topic] = (
            "copy"
            if one.same_as
            else "off"
            if topic in off
            else "one_of"
            if topic in one_of
            else "aided"
            if one.track.kind == AIDED
            else "good"
            if is_judged
            else "not_judged"
        )
    return states


def _verdict(faults: Sequence[InsFault], states: Mapping[str, UnitState]) -> Verdict:
    if any(len(fault.topics) == 1 for fault in faults):
        return "off"
    if faults:
        return "one_of"
    return "agree" if "good" in states.values() else "not_judged"


def _unit(one: Prepared, state: UnitState, judged: Judged | None, ins_class: str) -> InsUnit:
    growth = None if judged is None else judged.shown
    track = one.track
    return InsUnit(
        topic=one.topic,
        kind=track.kind,
        kind_reason=track.kind_reason,
        has_position=bool(np.isfinite(track.latitude_deg).any()),
        state=state,
        serials=tuple(serial for _, serial in track.serials),
        start_s=track.start_s,
        compared_hours=None if growth is None else growth.hours,
        rate_fit_nmiph=size_of(growth, "rate_nmiph"),
        rate_50_nmiph=None if growth is None or track.start_s is None else growth.rate_50_nmiph,
        rate_95_nmiph=None if growth is None or track.start_s is None else growth.rate_95_nmiph,
        velocity_rms_mps=size_of(growth, "velocity_mps"),
        schuler_mps=size_of(growth, "schuler_mps"),
        largest_m=size_of(growth, "largest_m"),
        largest_at_s=None
        if growth is None or growth.largest_at_s is None
        else growth.largest_at_s + (track.start_s or 0.0),
        heading_difference_deg=None if judged is None else judged.against_deg,
        lag_s=one.late_s,
        same_as=one.same_as,
        ins_class=ins_class,
    )


def _told(found: Comparable, pair: Judged) -> InsPair:
    first, second = (next(one for one in found.units if one.topic == topic) for topic in pair.topics)
    growth, limits = pair.shown, pair.limits
    return InsPair(
        first=first.topic,
        second=second.topic,
        hours=0.0 if growth is None else growth.hours,
        rate_fit_nmiph=size_of(growth, "rate_nmiph"),
        velocity_rms_mps=size_of(growth, "velocity_mps"),
        schuler_mps=size_of(growth, "schuler_mps"),
        largest_m=size_of(growth, "largest_m"),
        heading_difference_deg=pair.heading,
        is_start_known=pair.is_start_known,
        rate_limit_nmiph=None if limits is None else limits.rate_nmiph,
        velocity_limit_mps=None if limits is None else limits.velocity_mps,
        heading_limit_deg=None if limits is None or pair.heading is None else limits.heading_deg,
        is_beyond=pair.is_beyond or (pair.heading_over or 0.0) > 1.0,
        why_not=_why_not(first, second) if not pair.ratios else "",
    )


def _why_not(first: Prepared, second: Prepared) -> str:
    for one in (first, second):
        if one.same_as:
            return f"{one.topic} repeats {one.same_as}"
        if one.track.kind == AIDED:
            return f"GNSS corrects {one.topic}"
    return WHY_NOT
