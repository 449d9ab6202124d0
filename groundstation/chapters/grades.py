"""Words that a claim is graded by, of every system, and what each means to its reader."""

from collections.abc import Iterable, Mapping

from groundstation.chapters.parts import Claim, Mark

MEANINGS: Mapping[str, str] = {
    "Accept": "every required check passed: the result may be used",
    "Advisory": "good to the interval that stands beside it; a check that is not required is open",
    "Reject": "a required check failed: do not use the result",
    "Extend": "nothing failed, but more data of the same kind are needed",
    "Undecided": "nothing failed, but this log does not decide it",
    "Not accepted": "a check failed, or one is open",
    "Measured": "a value found in the log; no limit judges it",
    "No rate": "errors were measured, but nothing shows since when they grow: neither good nor bad",
    "Doubtful": "a value was found, and a check speaks against it: its chapter says which",
    "Ambiguous": "the log allows more than one solution",
    "Good": "every check that the log allows passed",
    "Warnings": "usable, and a check is beyond its warning limit",
    "Bad": "a check failed: do not rely on it before it is looked at",
    "Not judged": "the log has nothing to judge it by",
    "Not measured": "the log does not have what the criteria ask for",
    "Aided": "GNSS corrects this INS, so its own errors do not show",
    "Left GNSS": "INS and GNSS were far apart for a time; which of them was wrong it does not say",
    "Filter wrong": "the filter on board was surely off, by a better solution of the same log",
    "Filter changed": "an error of the filter on board changed in flight",
    "Off": "an INS differs from the others by more than its class allows",
    "They differ": "two INS differ by more than their class allows; which is off is not known",
    "Agree": "all INS agree within what their class allows",
    "Moved while aligning": "the aircraft moved while the INS aligned: align again",
    "Drifts while standing": "the ground speed at a standstill is above what the class allows",
    "Consistent": "the errors are as large as claimed",
    "Too sure": "the errors are larger than claimed",
    "Not consistent": "the errors are larger or smaller than claimed",
    "Diverges": "the errors grow without limit",
    "Stabilised": "every criterion that was judged is met from its height on",
    "Not stabilised": "a criterion is not met from its height on",
    "Joined": "the clocks of the logs agree well enough for every analysis",
    "Joined roughly": "the clocks of the logs agree, but not well enough for fast motion",
    "By file time": "how well the clocks of the logs agree is not known",
    "Answered": "an analysis without a verdict",
    "Recorded": "the log was read; no analysis had what it needs",
    "Data lost": "much of the log is missing or unreadable: see this before any result",
}


def meaning_of(mark: Mark) -> str:
    """Return what the word of a mark means; empty for a word of a system that is not ours.

    Examples
    --------
    >>> meaning_of(Mark("unknown", "Undecided"))
    'nothing failed, but this log does not decide it'
    """
    return MEANINGS.get(mark.text, "")


def legend(verdict: Mark | None, claims: Iterable[Claim]) -> tuple[tuple[Mark, str], ...]:
    """Return the words that stand at the top of a page with their meanings, each once."""
    marks = (*(() if verdict is None else (verdict,)), *(claim.mark for claim in claims))
    told = {mark.text: (mark, meaning_of(mark)) for mark in reversed(marks) if meaning_of(mark)}
    return tuple(reversed(told.values()))
