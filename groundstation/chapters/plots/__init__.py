"""Plots of chapters: each figure is described once, beside the chapter that mentions it."""

from collections.abc import Mapping

from groundstation.chapters.generic import SERIES as GENERIC_SERIES
from groundstation.chapters.plots import flight, generic, quality
from groundstation.plots.plot import Describe

# Of every flight, by the name that a chapter gives, or a tab alone; a figure that is one of several alike gets which.
PLOTS: Mapping[str, Describe] = {
    GENERIC_SERIES: generic.series,
    "overview.track": flight.track_map,
    "overview.profile": flight.profile,
    "overview.attitude": flight.attitude,
    "overview.states": flight.states,
    "quality.gaps": quality.gaps,
}
