"""Columns that the magnetic deviation gives to the tables of flights."""

from collections.abc import Callable, Mapping

from groundstation.results.columns import AnswerColumn
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import MagneticResult, Method
from groundstation.systems.magnetic.flux_answer import FluxDeviation


def _recommended(magnetic: MagneticResult) -> Method:
    return magnetic.method(magnetic.recommended_method)


def _of(letter: str, values: Callable[[Method], Mapping[str, float]]) -> Callable[[MagneticResult], float | None]:
    """The value of a coefficient, or its sigma, by the method that is recommended."""
    return lambda magnetic: values(_recommended(magnetic)).get(letter)


def _coefficient(letter: str) -> tuple[AnswerColumn[MagneticResult], AnswerColumn[MagneticResult]]:
    stem, meaning = f"magnetic_{letter.lower()}", f"coefficient {letter} of the magnetic heading error"
    return (
        AnswerColumn(f"{stem}_deg", "number", meaning, _of(letter, lambda method: method.coefficients_deg)),
        AnswerColumn(
            f"{stem}_sigma_deg", "number", "its sigma", _of(letter, lambda method: method.coefficients_sigma_deg)
        ),
    )


COLUMNS: tuple[AnswerColumn[MagneticResult], ...] = (
    AnswerColumn(
        "magnetic_verdict",
        "category",
        "of the magnetic deviation: accept, reject, undecided",
        lambda magnetic: magnetic.verdict,
    ),
    AnswerColumn(
        "magnetic_method",
        "category",
        "method recommended for the correction; the coefficients are from it",
        lambda magnetic: magnetic.recommended_method,
    ),
    AnswerColumn(
        "magnetic_before_rms_deg",
        "number",
        "magnetic heading error in level flight that no fit used, RMS",
        lambda magnetic: magnetic.residual_rms_deg.before if magnetic.residual_rms_deg else None,
    ),
    AnswerColumn(
        "magnetic_after_rms_deg",
        "number",
        "the same after correction",
        lambda magnetic: magnetic.residual_rms_deg.after if magnetic.residual_rms_deg else None,
    ),
    *(column for letter in LETTERS for column in _coefficient(letter)),
)


def _flux_coefficient(letter: str) -> tuple[AnswerColumn[FluxDeviation], AnswerColumn[FluxDeviation]]:
    stem, meaning = f"flux_{letter.lower()}", f"coefficient {letter} of the error of the flux valve in flight"
    return (
        AnswerColumn(f"{stem}_deg", "number", meaning, lambda flux: flux.coefficient(letter).value_deg),
        AnswerColumn(
            f"{stem}_sigma_deg",
            "number",
            "its sigma",
            lambda flux: None if flux.coefficient(letter).value_deg is None else flux.coefficient(letter).sigma_deg,
        ),
    )


FLUX_COLUMNS: tuple[AnswerColumn[FluxDeviation], ...] = (
    AnswerColumn(
        "flux_verdict", "category", "of the flux valve in flight: accept, reject, undecided", lambda flux: flux.verdict
    ),
    AnswerColumn(
        "flux_method",
        "category",
        "method recommended for the flux valve; the coefficients are from it",
        lambda flux: flux.recommended_method,
    ),
    AnswerColumn(
        "flux_before_rms_deg",
        "number",
        "error of the flux valve on straight legs, RMS",
        lambda flux: flux.residual_rms_deg.before if flux.residual_rms_deg else None,
    ),
    AnswerColumn(
        "flux_after_rms_deg",
        "number",
        "the same after correction by the legs of other directions",
        lambda flux: flux.residual_rms_deg.after if flux.residual_rms_deg else None,
    ),
    *(column for letter in LETTERS for column in _flux_coefficient(letter)),
)
