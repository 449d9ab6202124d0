"""Words for a receiver's reception: the sentence, lengths, shares, times."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

from groundstation.base.words import counted, never_a_fix
from groundstation.systems.gnss.answer import (
    NO_FIXES,
    STATE_NAMES,
    WITHOUT_FIX,
    GnssReceiver,
    ReceiverTexts,
    StandstillScatter,
    VelocityAgainstPosition,
)

FIXED = frozenset(STATE_NAMES) - {*NO_FIXES}
THROUGHOUT = "throughout"
WHOLE = 0.9995  # share that is all
STEP_TOLD = 0.5  # of the scatter: a coarser step of the logged places is told
BY_ACCURACY = ("rtk_fixed", "rtk_float", "dgnss", "3d")  # kinds of fix whose order of accuracy is known
SAME_CLAIM = 1.1  # times the sigma of a better kind: a worse one claims as much
LATE_S = 0.1  # a delay between position and velocity that is worth a line
FEW = 4  # states that the sentence names
CENTIMETRES_BELOW_M = 0.995


def never_had(one: GnssReceiver) -> str:
    """Return the sentence of a receiver that never had a fix."""
    most = one.satellites_tracked if one.satellites_used is None else one.satellites_used
    return never_a_fix(one.rows, most)


def sentence_of(one: GnssReceiver) -> str:
    """Return one sentence on a receiver."""
    if one.first_fix_s is None:
        return never_had(one)
    told = [_first_fix(one) + listed((_states(one), _lost(one)))]
    if one.satellites_used is not None:
        told.append(counted(round(one.satellites_used), "satellite"))
    stood = one.told_standstill
    if stood is not None and (scatter := scatter_of(stood, len(one.fixes) > 1)):
        told.append(scatter)
    return "; ".join(told)


def _states(one: GnssReceiver) -> str:
    """Return the kinds of fix with their share.

    One alone is "throughout", which says that it was never lost.
    """
    fixes = [(state.state, one.share_after_first_fix(state.state)) for state in one.states]
    fixes = sorted((pair for pair in fixes if pair[0] in FIXED), key=lambda pair: -pair[1])
    if len(fixes) == 1 and (fixes[0][1] >= WHOLE or one.start_s == one.end_s):
        name = name_of(fixes[0][0])
        return name if one.start_s == one.end_s else f"{name} {THROUGHOUT}"
    return ", ".join(f"{name_of(state)} {share_text(share)}" for state, share in fixes[:FEW])


def _first_fix(one: GnssReceiver) -> str:
    waited_s = (one.first_fix_s or 0.0) - one.start_s
    return f"first fix after {seconds_text(waited_s)}, then " if waited_s >= 1.0 else ""


def _lost(one: GnssReceiver) -> str:
    if one.start_s == one.end_s:
        return ""
    lost = [loss.seconds for loss in one.losses if loss.state in WITHOUT_FIX]
    gaps = [loss.seconds for loss in one.losses if loss.state not in WITHOUT_FIX]
    told = [_times("lost", lost), gaps_text(gaps)]
    if not lost and one.lost_s > 0.0:
        told[0] = f"lost for {seconds_text(one.lost_s)}"
    never = "" if _states(one).endswith(THROUGHOUT) else "fix never lost"
    return listed(told) or listed((never, missing_of(one) if one.missed_epochs else ""))


def missing_of(one: GnssReceiver) -> str:
    """Return how many epochs are missing, of how many that the rate expects."""
    missed = one.missed_epochs or 0
    expected = one.rows - one.repeated_rows + missed
    return f"{missed} of {expected} epochs missing"


def gaps_text(seconds: Sequence[float]) -> str:
    """Return the gaps in words, as the ledger has them: each from row to row.

    Examples
    --------
    >>> gaps_text([3.42]), gaps_text([0.6, 3.42, 1.0]), gaps_text([])
    ('nothing recorded for 3.4 s', '3 gaps, 5 s together, the longest 3.4 s', '')
    """
    if len(seconds) < 2:
        return "".join(f"nothing recorded for {seconds_text(one)}" for one in seconds)
    return f"{len(seconds)} gaps, {seconds_text(sum(seconds))} together, the longest {seconds_text(max(seconds))}"


def _times(what: str, seconds: list[float]) -> str:
    if not seconds:
        return ""
    longest = seconds_text(max(seconds))
    return f"{what} for {longest}" if len(seconds) == 1 else f"{what} {len(seconds)} times, at most {longest}"


def scatter_of(stood: StandstillScatter, names_kind: bool) -> str:
    """Return scatter at standstill beside the claim, with the kind of fix where asked.

    Empty where the receiver holds its place.
    """
    if stood.is_held:
        return ""
    if names_kind:
        seen = f"below {length_text(stood.resolution_m)}" if stood.is_coarse else length_text(stood.scatter_m)
        claimed = "" if stood.claimed_m is None else f", {length_text(stood.claimed_m)} claimed"
        return f"scatter {seen} while {name_of(stood.state)}{claimed}"
    claimed = "" if stood.claimed_m is None else f" where {length_text(stood.claimed_m)} is claimed"
    if stood.is_coarse:
        return f"scatter below {length_text(stood.resolution_m)}{claimed}"
    return f"scatter {length_text(stood.scatter_m)}{claimed}"


def same_claims(one: GnssReceiver) -> str:
    """Return that a worse kind of fix claims no larger sigma than a better one; else empty."""
    fixes = [state for state in one.states if state.state in BY_ACCURACY and state.claimed_m is not None]
    for better, worse in pairwise(fixes):
        assert better.claimed_m is not None and worse.claimed_m is not None
        if worse.claimed_m <= SAME_CLAIM * better.claimed_m:
            worse_text, better_text = length_text(worse.claimed_m), length_text(better.claimed_m)
            where = "as" if worse_text == better_text else f"and {better_text} is claimed while"
            same = f"{name_of(worse.state)} claims {worse_text}, {where} {name_of(better.state)}"
            return f"{same}{' does' * (where == 'as')}: the claimed σ does not tell them apart"
    return ""


def meaning_of(motion: VelocityAgainstPosition, too_sure: float) -> str:
    """Return what the difference between velocity and position means beside the claimed sigma."""
    rms, claimed = motion.difference_rms_mps, motion.claimed_mps
    if claimed is None or not claimed > 0.0:
        return "no σ of the velocity is claimed: the difference is not judged"
    if rms <= claimed:
        return "the difference is within the claimed σ"
    told = f"the difference is {rms / claimed:.1f} times the claimed σ"
    if motion.lag_s is not None and abs(motion.lag_s) > LATE_S and motion.left_rms_mps <= claimed:
        return f"{told}: the delay of {abs(motion.lag_s):.2f} s explains it, {motion.left_rms_mps:.2f} m/s is left"
    lasting = motion.lasting_rms_mps
    if lasting is None:
        return f"{told}: the log is too short to say whether it is noise from fix to fix"
    if lasting <= claimed:
        return f"{told}: noise from fix to fix explains it, means over 10 s differ by {lasting:.2f} m/s"
    beyond = "noise from fix to fix does not explain all of it"
    if lasting > too_sure * claimed:
        beyond = "neither a delay nor noise from fix to fix explains it: the velocity is worse than claimed, or drifts"
    return f"{told}: {beyond}, means over 10 s differ by {lasting:.2f} m/s"


def texts_text(one: ReceiverTexts) -> str:
    """Return how many texts a receiver sent, and the first one."""
    topic = one.topic.removeprefix("raw.")
    if one.count == 1:
        return f'1 text of the receiver ({topic}): "{one.first}"'
    which = "each" if one.different == 1 else "the first"
    return f'{one.count} texts of the receiver ({topic}), {which}: "{one.first}"'


def memory_of(stood: StandstillScatter) -> str:
    """Return how long errors last, and what that says of the scatter."""
    length_s = stood.end_s - stood.start_s
    if stood.is_held:
        return "the receiver repeats one position while it stands: its scatter says nothing"
    step = f"places are logged in steps of {length_text(stood.resolution_m)}"
    if stood.is_coarse:
        return f"{step}: finer scatter is not seen"
    if stood.correlation_s is None:
        return (
            f"it stood for {seconds_text(length_s)} and errors last longer than {seconds_text(length_s / 10.0)}: "
            "the scatter understates the error"
        )
    return (
        f"it stood for {seconds_text(length_s)}, errors last about {seconds_text(stood.correlation_s)}: "
        f"{counted(round(stood.independent), 'independent value')}{_worth(stood)}"
    ) + (f"; {step}" if stood.resolution_m > STEP_TOLD * stood.scatter_m else "")


def _worth(stood: StandstillScatter) -> str:
    """Return what a mean over the longest time is worth."""
    if stood.averaged_s is None or stood.averaged_scatter_m is None:
        return ""
    return f"; means over {seconds_text(stood.averaged_s)} scatter by {length_text(stood.averaged_scatter_m)}"


def name_of(state: str) -> str:
    """Return a state in words."""
    return STATE_NAMES.get(state, state)


def share_text(share: float) -> str:
    """Return a share in per cent.

    Examples
    --------
    >>> share_text(0.651), share_text(0.0042), share_text(0.9961), share_text(0.00001)
    ('65 %', '0.4 %', '99.6 %', '< 0.1 %')
    """
    percent = 100.0 * share
    if 0.0 < percent < 0.1:
        return "< 0.1 %"
    return f"{percent:.1f} %" if percent < 1.0 or 99.0 < percent < 100.0 else f"{percent:.0f} %"


def length_text(metres: float) -> str:
    """Return a length with two digits, in centimetres below a metre.

    Examples
    --------
    >>> length_text(0.0094), length_text(0.31), length_text(1.34), length_text(181.2)
    ('0.9 cm', '31 cm', '1.3 m', '181 m')
    """
    if metres < CENTIMETRES_BELOW_M:
        return f"{100.0 * metres:.1f} cm" if metres < 0.0995 else f"{100.0 * metres:.0f} cm"
    return f"{metres:.1f} m" if metres < 10.0 else f"{metres:.0f} m"


def seconds_text(seconds: float) -> str:
    """Return a time.

    Examples
    --------
    >>> seconds_text(0.25), seconds_text(12.4), seconds_text(134.0), seconds_text(3725.0)
    ('0.25 s', '12 s', '2:14 min', '1:02 h')
    """
    if seconds < 9.95:
        return f"{seconds:.2g} s"
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0) if seconds >= 3600.0 else int(seconds // 60.0)
    if seconds >= 3600.0:
        return f"{minutes // 60}:{minutes % 60:02d} h"
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min"


def listed(parts: Iterable[str]) -> str:
    """Join parts by commas, leaving out empty ones."""
    return ", ".join(filter(None, parts))
