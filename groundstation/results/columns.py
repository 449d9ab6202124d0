"""Columns of the tables of flights: index.json, index.csv and fleet.parquet."""

from collections.abc import Callable, Mapping
from typing import Any, Generic, Literal, TypeVar

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.roles import LETTERS

Kind = Literal["text", "category", "number", "count", "time", "flag"]
AnswerT = TypeVar("AnswerT", bound=Answer)


# What statistics and pages of all flights read of the columns that systems give, empty where no system gives them.
READ_BY_FLEETS: Mapping[str, Kind] = {
    **dict.fromkeys(("verdict", "ins_kind", "magnetic_verdict", "magnetic_method"), "category"),
    **dict.fromkeys(("flux_verdict", "flux_method", "units_verdict"), "category"),
    "units_off": "text",
    **dict.fromkeys(("health_verdict", "trajectory_state"), "category"),
    **dict.fromkeys(("verdict_reason", "landing_criteria_not_met", "health_sentence"), "text"),
    **dict.fromkeys(("samples", "landing_approaches", "landing_unstable_approaches"), "count"),
    **dict.fromkeys(
        (
            *("error_deg", "standard_error_deg", "confidence95_low_deg", "confidence95_high_deg", "correction_deg"),
            *("estimate_sd_deg", "sample_mean_deg", "sample_m2_deg2", "onboard_difference_deg"),
            *("reference_residual_arcmin", "radial_error_rate_fit_nmiph", "forecast_60min_rms_m"),
            *("forecast_60min_p95_m", "raw_60min_p95_m"),
            *("magnetic_before_rms_deg", "magnetic_after_rms_deg", "flux_before_rms_deg", "flux_after_rms_deg"),
            *("health_vibration_mps2", "health_hdop", "health_test_ratio"),
            *("health_vibration_limit_mps2", "health_hdop_limit"),
            *("onboard_heading_rms_deg", "onboard_tilt_rms_deg"),
            *(
                f"{sensor}{letter.lower()}{end}_deg"
                for sensor in ("magnetic_", "flux_")
                for letter in LETTERS
                for end in ("", "_sigma")
            ),
        ),
        "number",
    ),
}


@dataclass(frozen=True)
class FlightColumn:
    """Column of the table of flights: name with unit, kind, and description in plain words.

    In memory ``number`` and ``count`` are float64 (NaN where missing), ``flag`` is bool, ``time`` datetime64[ns] in UTC
    (NaT where missing), the rest text (empty where missing). In fleet.parquet a missing value is null.
    """

    name: str
    kind: Kind
    meaning: str


@dataclass(frozen=True)
class AnswerColumn(FlightColumn, Generic[AnswerT]):
    """A column that an analysis fills from its answer.

    Parameters
    ----------
    of : callable, optional
        ``of(answer)``: its value, None where there is none. Left out: the field of the answer that has its name.
    is_indexed : bool
        True where it stands in index.json and index.csv as well as in fleet.parquet.
    """

    of: Callable[[AnswerT], Any] | None = None
    is_indexed: bool = True

    def value(self, answer: AnswerT) -> Any:
        """Return the column's value for an answer."""
        return getattr(answer, self.name) if self.of is None else self.of(answer)
