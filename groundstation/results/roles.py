"""Roles of answers: facts that one system reads from another's answer without naming it.

An answer that plays a role is derived from it. A reader finds it with
:func:`groundstation.results.answer.answer_meeting`, ``results.answer_meeting`` or ``known.answer_meeting``.
"""

from collections.abc import Mapping, Sequence
from typing import Protocol


class SettingsOfHeading:
    """Role of an answer with the heading error of an INS and the settings used.

    It is the INS whose heading is shown for the flight.
    """

    ins_topic: str
    settings: Mapping[str, float | str | bool]


class Outage(Protocol):
    """Interval of a log in which nothing could be compared.

    ``missing`` is ``gnss``, ``ins`` or ``both``.
    """

    @property
    def start_s(self) -> float: ...
    @property
    def missing(self) -> str: ...


class ErrorsAlongTheFlight:
    """Role of an answer with the errors of an INS along the flight.

    ``outages`` are the intervals of the log without GNSS or without the INS.
    """

    ins_topic: str
    outages: Sequence[Outage]
