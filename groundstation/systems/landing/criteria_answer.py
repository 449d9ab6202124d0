"""Criteria of approaches and landings: what each bounds, its source, and what was found."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal, NamedTuple

from groundstation.base.dataclasses import dataclass

CriterionState = Literal["met", "not met", "undecided", "no limit", "not measured", "not logged"]
Group = Literal["approach", "threshold", "landing"]

_FSF, _EASA = "FSF 7.1, element", "GM2:"


class CriterionKind(NamedTuple):
    """Kind of criterion: its title, unit, and who names it."""

    title: str
    unit: str
    group: Group
    source: str


# Name -> kind, in the order they are told. EASA names events and leaves every limit to the operator.
KINDS: Mapping[str, CriterionKind] = MappingProxyType(
    {
        "lateral": CriterionKind("course deviation", "dots", "approach", f"{_FSF} 8"),
        "vertical": CriterionKind("glide path deviation", "dots", "approach", f"{_FSF} 8; {_EASA} glideslope"),
        "sink_rate": CriterionKind("sink rate", "m/s", "approach", f"{_FSF} 5; {_EASA} high rate of descent"),
        "bank": CriterionKind("bank", "deg", "approach", f"Airbus FOBN; {_EASA} bank angles"),
        "speed": CriterionKind("airspeed", "m/s", "approach", f"{_FSF} 3; {_EASA} approach speeds"),
        "flap": CriterionKind("landing flap set at", "m", "approach", f"{_FSF} 4; {_EASA} landing flap"),
        "gear": CriterionKind("gear down at", "m", "approach", f"{_FSF} 4"),
        "thrust": CriterionKind("lowest thrust", "%", "approach", f"{_FSF} 6; {_EASA} approach power"),
        "tailwind": CriterionKind("tailwind", "m/s", "approach", "flight manual; TC AC 525-008"),
        "crosswind": CriterionKind("crosswind", "m/s", "approach", "flight manual"),
        "threshold_height": CriterionKind("height over the threshold", "m", "threshold", "FSF 8.3"),
        "threshold_speed": CriterionKind("airspeed over the threshold", "m/s", "threshold", f"{_EASA} approach speeds"),
        "flare": CriterionKind("from 50 ft to the touchdown", "s", "landing", "FSF 8.3"),
        "floating": CriterionKind("from 20 ft to the touchdown", "m", "landing", "FSF 8.3"),
        "touchdown": CriterionKind("touchdown beyond the threshold", "m", "landing", "FAA glossary, touchdown zone"),
        "aiming_point": CriterionKind(
            "touchdown beyond the aiming point", "m", "landing", "ICAO Annex 14, I, table 5-1"
        ),
        "runway_remaining": CriterionKind("runway remaining at the touchdown", "m", "landing", "operator"),
        "centre_line": CriterionKind("off the centre line at the touchdown", "m", "landing", "operator"),
        "landing_flap": CriterionKind("flap at the touchdown", "deg", "landing", f"{_EASA} landing flap"),
        "landing_pitch": CriterionKind("pitch at the touchdown", "deg", "landing", f"{_EASA} landing pitch"),
        "landing_bank": CriterionKind("bank below 20 ft", "deg", "landing", f"{_EASA} bank angles"),
        "landing_sink": CriterionKind("sink rate at the touchdown", "m/s", "landing", "operator"),
        "landing_load": CriterionKind("peak load at the touchdown", "g", "landing", f"{_EASA} normal acceleration"),
    }
)
REVERSED = "read as its reverse: it says down in flight alone, and not on the wheels"
EDITIONS = (
    "FSF: ALAR Briefing Notes 7.1 and 8.3, Flight Safety Digest, August to November 2000. GM2: EASA GM2 ORO.AOC.130, "
    "ED Decision 2025/020/R; it lists events and leaves limits to operator and type. TC AC 525-008, issue 1 (2004), "
    "3.0: up to 10 kt no special tests. FAA Pilot/Controller Glossary: the first 3000 ft."
)


@dataclass(frozen=True)
class Place:
    """Instant of an approach: flight time, height and distance before the threshold."""

    time_s: float
    height_m: float | None = None  #: Height above the threshold.
    before_threshold_m: float | None = None  #: Distance before the threshold, negative behind it.


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """One criterion of an approach with what was found.

    Parameters
    ----------
    name : str
        As in the settings, ``[landing.criteria.<name>]``.
    state : {'met', 'not met', 'undecided', 'no limit', 'not measured', 'not logged'}
        Undecided: the limit lies within 1.96 ``sigma`` of the value. Not measured: ``reason`` says why.
    value, sigma : float or None
        None where there is none; sigma where one is known.
    at_least, at_most : float or None
        The limits; none of either is *no limit*.
    logged_by : str
        Fields that the value is from.
    reason : str
        Why there is no value, or what it is worth.
    """

    name: str
    state: CriterionState
    unit: str  #: Unit of value and limits.
    value: float | None = None  #: What the approach shows; null where there is none.
    sigma: float | None = None  #: Standard deviation of the value, where one is known.
    at_least: float | None = None  #: Least value allowed; null without such a limit.
    at_most: float | None = None  #: Greatest value allowed; null without such a limit.
    at: Place | None = None  #: Instant of the value.
    logged_by: str = ""
    reason: str = ""

    also_in_frames: ClassVar = ("title",)

    @property
    def title(self) -> str:
        """Name in words."""
        return self.kind.title

    @property
    def kind(self) -> CriterionKind:
        """Title, unit and source."""
        return KINDS[self.name]


@dataclass(frozen=True)
class Score:
    """Share of the user's own weights that was met, of those judged.

    ``judged`` and ``given`` are sums of weights; criteria without a weight do not count.
    """

    share: float  #: Weights met over weights judged.
    judged: float  #: Sum of the weights of criteria that were judged.
    given: float  #: Sum of all weights.
