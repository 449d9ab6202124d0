"""Faults of units: own ones, by the reference, by parity, by difference of two."""

from collections.abc import Mapping, Sequence

from groundstation.base.words import clock_text, listed
from groundstation.systems.inertial.units_answer import FaultKind, InsFault, Measured
from groundstation.systems.inertial.units_compare import Judged, beyond
from groundstation.systems.inertial.units_faults import AXES, axes_in_words
from groundstation.systems.inertial.units_growth import Growth
from groundstation.systems.inertial.units_parity import by_parity, in_words
from groundstation.systems.inertial.units_prepare import Comparable, Prepared, Stepped
from groundstation.systems.inertial.units_track import ReferenceTrack

AGREE = 0.5  # of what they are over their limits against the reference: units that agree with each other
COVERS = 0.8  # of the hours of a pair that the reference must cover to acquit both
COMMON = "all are beyond their limits and agree with each other: the reference, or what they share, is wrong"
EXCHANGE_S = 5.0  # a step so near a change of serials is the other unit


def own_faults(found: Comparable, reference: ReferenceTrack | None) -> list[InsFault]:
    """Faults that a unit shows by itself or at one moment."""
    faults = []
    for one in found.units:
        if one.same_as:
            continue
        if one.swapped is not None:
            by = _named(one.swapped.by, reference)
            faults.append(InsFault("swapped_axis", one.swapped.topics, by, axes_in_words(one.swapped.matrix)))
        faults += _held_faults(one)
    exchanged = {one.topic: [at for at, _ in one.track.serials[1:]] for one in found.units}
    for step in found.steps:
        times = [at for topic in step.topics for at in exchanged[topic]]
        if not any(abs(step.jump.time_s - at) < EXCHANGE_S for at in times):
            faults.append(_step_fault(step, reference))
    return faults


def _named(by: str, reference: ReferenceTrack | None) -> str:
    return by if reference is None else by.replace("the reference", reference.title)


def _held_faults(one: Prepared) -> list[InsFault]:
    faults = []
    for held in one.held:
        kind: FaultKind = "frozen" if held.is_frozen else "stuck"
        what = (
            "all outputs stand still" if held.is_frozen else f"velocity {listed([AXES[a] for a in held.axes])} sticks"
        )
        text = f"{what} from {clock_text(held.start_s)} for {held.end_s - held.start_s:.0f} s"
        faults.append(InsFault(kind, (one.topic,), "while the others move", text, held.start_s, held.end_s))
    return faults


def _step_fault(step: Stepped, reference: ReferenceTrack | None) -> InsFault:
    jump = step.jump
    what, places = ("position", 0) if jump.unit == "m" else ("velocity", 2)
    text = f"{what} jumps by {_with_half(jump.size, places, jump.unit)} at {clock_text(jump.time_s)}"
    by, size = _named(step.by, reference), jump.size
    return InsFault("step", step.topics, by, text, jump.time_s, jump.time_s, size.value, size.half95, jump.unit)


def _with_half(size: Measured, places: int, unit: str) -> str:
    half = f" ± {size.half95:.{places}f}" if size.half95 >= 0.5 * 10.0**-places else ""
    return f"{size.value:.{places}f}{half} {unit}"


def growth_faults(
    found: Comparable, by_reference: Mapping[str, Judged], pairs: Sequence[Judged], reference: ReferenceTrack | None
) -> list[InsFault]:
    """Faults that show as growth beyond what honest units do.

    The reference names a unit. What it did not see, the pairs show: of three or more units the one in every pair that
    is beyond its limit, and of two none.
    """
    faults = []
    named = []
    common = is_common(by_reference, pairs)
    for topic, judged in by_reference.items():
        if judged.is_beyond and not common:
            faults.append(_growth_fault(judged, (topic,), f"against {'' if reference is None else reference.title}"))
            named.append(topic)
    left = [one for one in beyond(pairs, named) if not _are_acquitted(one, by_reference)]
    if not left:
        return faults
    topics = [one.topic for one in found.witnesses if one.topic not in named]
    overs = {one.topics: one.over for one in pairs if one.ratios}
    who = by_parity(topics, overs) if len(topics) > 2 else tuple(left[0].topics)
    worst = max((one for one in left if set(one.topics) & set(who)), key=lambda one: one.over)
    faults.append(_growth_fault(worst, who, in_words(max(len(topics), 2))))
    return faults


def is_common(by_reference: Mapping[str, Judged], pairs: Sequence[Judged]) -> bool:
    """Tell whether all units are off by the reference and agree with each other.

    Then the reference is wrong, or what the units share: the place or the levelling of their alignment.
    """
    judged = [one for one in by_reference.values() if one.ratios]
    between = [pair.over for pair in pairs if pair.ratios]
    if len(judged) < 2 or not between or not all(one.is_beyond for one in judged):
        return False
    return max(between) < AGREE * min(one.over for one in judged)


def _are_acquitted(pair: Judged, by_reference: Mapping[str, Judged]) -> bool:
    """Tell whether the reference saw both of a pair nearly all the time, within limits."""
    if pair.growth is None:
        return False
    both = [by_reference.get(topic) for topic in pair.topics]
    return all(
        one is not None and one.growth is not None and one.growth.hours >= COVERS * pair.growth.hours and one.ratios
        for one in both
    )


def _growth_fault(judged: Judged, topics: tuple[str, ...], by: str) -> InsFault:
    growth, limits = judged.growth, judged.limits
    assert growth is not None
    assert limits is not None
    rate, velocity = growth.rate_nmiph, growth.velocity_mps
    over_rate = 0.0 if rate is None else rate.value / limits.rate_nmiph
    over_velocity = 0.0 if velocity is None else velocity.value / limits.velocity_mps
    kind: FaultKind = "drift" if growth.is_drift else "tilt"
    of = "difference" if len(judged.topics) == 2 else "error"
    if rate is not None and (kind == "drift" or velocity is None or over_velocity <= 1.0) and over_rate > 1.0:
        text = f"radial {of} {_with_half(rate, 2, 'nmi/h')} (limit {limits.rate_nmiph:.2f})"
        return InsFault(kind, topics, by, text, None, None, rate.value, rate.half95, "nmi/h", limits.rate_nmiph)
    assert velocity is not None
    swing = "" if growth.schuler_mps is None else f", Schuler amplitude {_with_half(growth.schuler_mps, 2, 'm/s')}"
    text = f"velocity {of} {_with_half(velocity, 2, 'm/s')} RMS (limit {limits.velocity_mps:.2f}){swing}"
    return InsFault(kind, topics, by, text, None, None, velocity.value, velocity.half95, "m/s", limits.velocity_mps)


def sentence_of(
    faults: Sequence[InsFault],
    by_reference: Mapping[str, Judged],
    judged_pairs: int,
    reference: ReferenceTrack | None,
    *,
    common: bool = False,
) -> str:
    """Return the verdict in a sentence."""
    if not faults:
        told = _agreement(by_reference, judged_pairs, reference)
        return f"{told}; {COMMON}" if common else told
    sentences = []
    for topics in dict.fromkeys(fault.topics for fault in faults):
        own = [fault for fault in faults if fault.topics == topics]
        shown = sorted(own, key=lambda fault: fault.kind not in ("drift", "tilt"))
        more = f"; {len(shown) - 3} more" if len(shown) > 3 else ""
        told = "; ".join(f"{fault.text}{_others(fault, by_reference)}, {fault.by}" for fault in shown[:3])
        who = f"{topics[0]} is off" if len(topics) == 1 else f"one of {listed(topics)} is off"
        sentences.append(f"{who}: {told}{more}")
    return "; ".join(sentences)


def _others(fault: InsFault, by_reference: Mapping[str, Judged]) -> str:
    """Return the same figure of the other units against the reference."""
    if len(fault.topics) != 1 or fault.kind not in ("drift", "tilt") or fault.topics[0] not in by_reference:
        return ""
    others = [one for topic, one in by_reference.items() if topic != fault.topics[0]]
    values = [
        found.value
        for one in others
        if one.growth is not None
        and (found := one.growth.rate_nmiph if fault.unit == "nmi/h" else one.growth.velocity_mps) is not None
    ]
    return f" beside {listed([f'{value:.2f}' for value in values])}" if values else ""


def _agreement(by_reference: Mapping[str, Judged], judged_pairs: int, reference: ReferenceTrack | None) -> str:
    rates = [
        one.shown.rate_nmiph.value
        for one in by_reference.values()
        if one.shown is not None and one.shown.rate_nmiph is not None and one.ratios
    ]
    if reference is not None and rates:
        return f"no unit is off: {listed([f'{rate:.2f}' for rate in rates])} nmi/h against {reference.title}"
    if judged_pairs:
        return "no unit is off: they differ by no more than honest units of the class"
    return "no two units can be judged by each other"


def size_of(growth: Growth | None, name: str) -> Measured | None:
    """Return a measured value of a growth, None where there is none."""
    found = None if growth is None else getattr(growth, name)
    return found if isinstance(found, Measured) else None
