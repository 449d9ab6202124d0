"""Approaches of a folder of flights under a standard: the share that was unstable."""

import hashlib
from collections.abc import Sequence
from dataclasses import field

from groundstation.base.dataclasses import dataclass
from groundstation.base.shipped_toml import ShippedToml, TomlFile
from groundstation.base.toml_settings import check_ranges, number, settings_from
from groundstation.base.version import __version__
from groundstation.methods.intervals import wilson_interval
from groundstation.results.files import SavedFlight
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.settings import LIMITS, LandingSettings
from groundstation.systems.landing.stabilised import rejudge
from groundstation.systems.landing.unstable_answer import Decision, JudgedApproach, UnstableApproaches, UnstableShare
from groundstation.systems.landing.verdict_answer import NOTHING_JUDGED, failed_words

KIND = "landing"
SHIPPED = ShippedToml("groundstation.systems.landing", "standards", "standard")
UNSTABLE = "not stabilised"
NOT_STATED = "not stated"


@dataclass(frozen=True)
class ApproachStandard:
    """Standard of stabilised approaches, as its file has it.

    Parameters
    ----------
    kind : str
        ``landing``.
    check : {'low', 'high'}
        Check height whose verdict counts.
    share_at_most : float or None
        Greatest share of unstable approaches; None: nothing is decided.
    landing : LandingSettings
        Limits of the criteria, as in a settings file; those that the file leaves out are the shipped ones.
    """

    kind: str = KIND
    title: str = "Stabilised approaches"
    source: str = ""
    check: str = "low"
    confidence: float = number(0.95, 0.5, 0.9999)
    share_at_most: float | None = number(None, 0.0, 1.0)
    landing: LandingSettings = field(default_factory=LandingSettings)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.check not in ("low", "high"):
            from groundstation.base.errors import SettingsError

            raise SettingsError("check", repr(self.check), "'low' or 'high'")


def judge(flights: Sequence[SavedFlight], file: TomlFile, unread: Sequence[str] = ()) -> UnstableApproaches:
    """Hold the approaches of flights against a standard, from what they saved.

    A setting of the file that chooses data, not a limit, must be that of the run: else the flight is left out.

    Raises
    ------
    SettingsError
        For a standard that cannot be used.
    """
    standard = settings_from(ApproachStandard, file.table, file.where)
    stated = set(file.table.get("landing", {})) - LIMITS
    found: list[JudgedApproach] = []
    left_out, seen, with_answer = list(unread), dict[str, str](), 0
    for saved in flights:
        answer = saved.results.answer(LandingResult)
        reason = _not_judged(saved, answer, standard, stated, seen)
        if reason or answer is None:
            left_out.append(f"{saved.folder.name}: {reason}")
            continue
        seen.setdefault(saved.results.source.sha256, saved.folder.name)
        with_answer += 1
        found += _approaches(saved, answer, standard)
    shares = _shares(found, standard.confidence)
    return UnstableApproaches(
        name=file.name,
        title=standard.title,
        source=standard.source,
        sha256=hashlib.sha256(file.text.encode("utf-8")).hexdigest(),
        version=__version__,
        height_m=standard.landing.gate_low_m if standard.check == "low" else standard.landing.gate_high_m,
        confidence=standard.confidence,
        share_at_most=standard.share_at_most,
        decision=_decision(shares[0], standard.share_at_most),
        flights=with_answer,
        shares=shares,
        approaches=tuple(found),
        left_out=tuple(left_out),
    )


def _not_judged(
    saved: SavedFlight,
    answer: LandingResult | None,
    standard: ApproachStandard,
    stated: set[str],
    seen: dict[str, str],
) -> str:
    """Return why a flight does not count; empty where it does."""
    if answer is None:
        return "; ".join(saved.results.reasons(LandingResult.analysis)) or "no approach"
    twin = seen.get(saved.results.source.sha256)
    if twin is not None and twin != saved.folder.name:
        return f"the same log as {twin}"
    wanted = standard.landing.told()
    other = [name for name in sorted(stated) if wanted.get(name) != answer.settings.get(name)]
    return f"run with another {', '.join(other)}: run the log again with the standard's" if other else ""


def _approaches(saved: SavedFlight, answer: LandingResult, standard: ApproachStandard) -> list[JudgedApproach]:
    """Return every approach of a flight with its verdict under the standard."""
    place = -1 if standard.check == "low" else 0
    found = []
    rejudged = iter([one for one in rejudge(answer, standard.landing) if " from " in one.subject])
    for approach in answer.approaches:
        verdicts = [next(rejudged) for _ in approach.stabilised]
        if not verdicts:
            continue
        one = verdicts[place]
        places = approach.stabilised[place].places
        failed = [failed_words(gate, places) for gate in one.gates_after if gate.state == "failed"]
        is_judged = one.after != "not measured"
        reason = ", ".join(failed) if is_judged else approach.stabilised[place].reason or NOTHING_JUDGED
        found.append(
            JudgedApproach(
                saved.folder.name,
                saved.results.metadata.get("aircraft", "") or NOT_STATED,
                runway_name(approach),
                approach.number,
                approach.outcome,
                one.after if is_judged else "",
                reason,
            )
        )
    return found


def runway_name(approach: Approach) -> str:
    """Name of the runway, else its course to ten degrees."""
    return approach.runway.name or f"course {round(approach.runway.true_course_deg, -1) % 360:.0f} deg"


def _shares(found: Sequence[JudgedApproach], confidence: float) -> tuple[UnstableShare, ...]:
    """Return the share of all approaches, then by runway and by aircraft."""
    judged = [one for one in found if one.verdict]
    shares = [_share("all", "all approaches", judged, confidence)]
    for group in ("runway", "aircraft"):
        for name in sorted({getattr(one, group) for one in judged}):
            shares.append(_share(group, name, [one for one in judged if getattr(one, group) == name], confidence))
    return tuple(shares)


def _share(group: str, name: str, judged: Sequence[JudgedApproach], confidence: float) -> UnstableShare:
    unstable = [one for one in judged if one.verdict == UNSTABLE]
    low, high = wilson_interval(len(unstable), len(judged), confidence)
    gone_around = sum(one.outcome == "go-around" for one in unstable)
    share = len(unstable) / len(judged) if judged else float("nan")
    return UnstableShare(group, name, len(judged), len(unstable), gone_around, share, low, high)


def _decision(whole: UnstableShare, at_most: float | None) -> Decision:
    """Decide by the interval: all of it must lie on one side."""
    if at_most is None:
        return "no limit"
    if not whole.judged:
        return "not flown"
    return "pass" if whole.high <= at_most else "fail" if whole.low > at_most else "not enough flights"
