"""Line that compares two analyses of one log."""

from groundstation.chapters.parts import Note, Tone
from groundstation.chapters.wording import interval, number, sentence
from groundstation.results.agreement import CONTRADICT_SIGMAS, Agreement, OneFinding

UNITS = {"deg": ("°", 2), "s": ("s", 3)}


def agreement_note(found: Agreement | None) -> Note | None:
    """Return both values with 95 % intervals and their difference in sigmas, or None.

    None where there is nothing to compare.
    """
    if found is None:
        return None
    unit, places = UNITS[found.unit]
    difference = number(abs(found.difference), places, unit)
    how = "agree: they differ by" if found.agrees else "differ by"
    told = f"{found.question} {_side(found.first, places, unit)} and {_side(found.second, places, unit)}"
    text = f"Two analyses: {told} {how} {difference}, {number(found.sigmas, 1)} σ"
    tone: Tone = "good" if found.agrees else "warn"
    if found.sigmas > CONTRADICT_SIGMAS:
        tone, text = "bad", f"{text}; at least one errs by more than its interval says"
    return Note(sentence(text), tone)


def _side(one: OneFinding, places: int, unit: str) -> str:
    return (
        f"{one.origin} {number(one.value, places, unit, signed=True)} (95 % {interval(one.interval95, places, unit)})"
    )
