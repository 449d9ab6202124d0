"""Plots of the heading correction of two flights over each other."""

from groundstation.chapters.plots.comparison import Compared, Overlay, TimeLine, overlaid
from groundstation.systems.heading.arrays import HeadingRunning, HeadingSamples


def _mean(data: HeadingRunning) -> TimeLine:
    return TimeLine(data.time_s, data.mean_deg, data.honest_half_width_deg)


def _speed_at_samples(data: HeadingSamples) -> TimeLine:
    return TimeLine(data.time_s, data.ground_speed_mps)


COMPARED = Compared(
    "heading",
    "Heading",
    overlaid(
        Overlay(HeadingRunning, "mean_deg", _mean, "mean heading error, °", "Heading error, running mean"),
        Overlay(
            HeadingSamples,
            "ground_speed_mps",
            _speed_at_samples,
            "speed at the samples, m/s",
            "Ground speed at the samples",
        ),
    ),
    (("heading_running-mean_deg",), ("heading_samples-ground_speed_mps",)),
)
