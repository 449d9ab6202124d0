"""Answer of the heading analysis with what earlier flights taught of the installation."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.installations import LearnedHeading


@dataclass(frozen=True)
class InstallationResult(LearnedHeading, Answer):
    """Heading error with the knowledge from earlier flights (INS heading - true heading).

    Parameters
    ----------
    ins_serial, aircraft : str
    flights : int
        Earlier flights that taught.
    why_not : str
        Why nothing was learned: the answer is then that of the taxi alone. Empty otherwise.
    verdict, verdict_reason, correction_deg
        As of the heading correction, the gate on the whole half width with what was learned.
    error_deg, standard_error_deg, confidence95_deg
        The airframe's: this is typed.
    interval_parts : tuple of IntervalPart
        This taxi, wind, installation.
    platform_error_deg, platform_standard_error_deg, platform_confidence95_deg
        Azimuth of the INS itself, the learned mounting taken off.
    platform_parts : tuple of IntervalPart
    alone_error_deg, alone_half_width_deg
        The answer of this taxi alone, for comparison.
    half_width_deg : float
        Half width of the airframe's interval: from the number to the farther end.
    installed : Installed
        Posterior of the earlier flights.
    odd, changed : tuple of str
        Earlier flights that were taken for flights of another unit, and those from which on it sits otherwise.
    residual_deg, residual_sigma_deg : float, optional
        The platform's error less the azimuth that the same flight showed later, and the sigma of that difference:
        nothing of that azimuth is in the number.
    """

    analysis: ClassVar[str] = "installation"

    figures: tuple[FigureData, ...] = ()
