"""Errors of an INS that GNSS corrects, as an answer with states of its own knows them."""

from groundstation.base.dataclasses import dataclass
from groundstation.base.words import listed, places_of, span_text, with_half
from groundstation.results.answer import Answers, answer_meeting
from groundstation.results.roles import ErrorsOfFilter, FilterError, FilterWrong

TOLD = ("heading", "roll", "pitch", "horizontal velocity", "horizontal position", "vertical position")


@dataclass(frozen=True)
class JudgedFilter:
    """Errors of the INS by quantity, and words on what judges them: "by the best trajectory"."""

    by: str
    rows: tuple[FilterError, ...]

    @property
    def worst(self) -> tuple[FilterError, FilterWrong] | None:
        """Error that is furthest above the one that a report opens with; None where none is above."""
        spans = [(row, span) for row in self.rows for span in row.wrong if span.over >= 1.0]
        return max(spans, key=lambda one: one[1].over, default=None)

    @property
    def sentence(self) -> str:
        """The worst error where it is large, else the usual ones.

        "judged by the best trajectory: heading wrong by 2.1 +- 0.3 deg from 12:03 on (95 %)"
        """
        return f"judged {self.by}: {self.errors if self.worst is None else self.wrong}"

    @property
    def wrong(self) -> str:
        """Words on the worst error, empty where none is large."""
        if self.worst is None:
            return ""
        row, span = self.worst
        when = span_text(span.span_s, span.whole_s)
        return f"{row.quantity} wrong by {with_half(span.value, span.half95, row.unit)} {when} (95 %)"

    @property
    def errors(self) -> str:
        """Words on the usual errors.

        "heading 0.41 deg (sigma 0.15) and roll 0.09 deg (sigma 0.05), RMS".
        """
        told = [row for name in TOLD for row in self.rows if row.quantity == name]
        return f"{listed([_size(row) for row in told])}, RMS"

    @property
    def changes(self) -> tuple[str, ...]:
        """Words on constants that changed: wrong before or after."""
        return tuple(f"{row.quantity} {row.changed}" for row in self.rows if row.changed)

    @property
    def constants(self) -> tuple[str, ...]:
        """Words on what was constant all through the log, which is no error of the filter."""
        return tuple(row.constant for row in self.rows if row.constant)


def judged_filter(answers: Answers, ins_topic: str) -> JudgedFilter | None:
    """Return the errors of an INS topic; None where no answer knows them."""
    found = answer_meeting(answers, ErrorsOfFilter)
    rows = () if found is None else found.filter_errors(ins_topic)
    if found is None or not any(row.quantity in TOLD for row in rows):
        return None
    return JudgedFilter(found.by_it, rows)


def _size(row: FilterError) -> str:
    rms, sigma = (f"{value:.{places_of(value)}f}" for value in (row.rms, row.sigma_rms))
    return f"{row.quantity} {rms} {row.unit} (sigma {sigma})"
