"""One published figure of navigation between aircraft, and the session for it."""

from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.systems.cooperative.settings import Update

FACTOR = 2.0  # a figure of ours within so many times of the published one counts as the same
Metric = Literal["two_sigma_r_m", "sigma_r_m", "sigma_x_m", "sigma_y_m", "gain_over_ins", "correlation", "diverges"]
Verdict = Literal["reproduced", "under a stated condition", "refuted", "not reproducible", "beyond the source"]


@dataclass(frozen=True)
class PublishedCase:
    """One published figure.

    Parameters
    ----------
    name, title : str
    session : str
        Shipped session.
    algorithm : str
    metric : str
        What the figure is; ``two_sigma_r_m`` unless said.
    low, high : float
        Published; equal for a single figure, infinite where it says "or more", NaN where there is none.
    published : str
        As it is written there.
    aircraft : str
        The one that is judged.
    at_s : float, optional
        Time of the figure; None: the end.
    update : str
    against : str
        Second algorithm, for a gain over another than the INS.
    why : str
        Why ours may lie outside a factor of two, or what the figure depends on.
    verdict : Verdict
        Our judgement of the published figure, made by hand from the rows; ``why`` says the reason or the condition.
    """

    name: str
    title: str
    session: str
    algorithm: str
    metric: Metric
    low: float
    high: float
    published: str
    aircraft: str = "A"
    at_s: float | None = None
    update: Update = "sequential"
    against: str = "dead_reckoning"
    why: str = ""
    verdict: Verdict = "reproduced"

    @property
    def run(self) -> tuple[object, ...]:
        """Key of the runs: cases that differ in the metric alone share them."""
        against = self.against if self.metric == "gain_over_ins" else self.algorithm
        return self.session, self.algorithm, self.update, self.aircraft, self.at_s, against
