"""Quantities of the trajectory: units, and errors of a filter that are worth telling."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

Quantity = Literal[
    "heading",
    "roll",
    "pitch",
    "tilt",
    "horizontal position",
    "vertical position",
    "horizontal velocity",
    "vertical velocity",
]


UNITS: Mapping[Quantity, str] = MappingProxyType(
    {
        "heading": "deg",
        "roll": "deg",
        "pitch": "deg",
        "tilt": "deg",
        "horizontal position": "m",
        "vertical position": "m",
        "horizontal velocity": "m/s",
        "vertical velocity": "m/s",
    }
)


# Least error of the on-board filter that is one, however small our sigma; and that a report opens with.
LEAST_ERROR: Mapping[Quantity, float] = MappingProxyType(
    {
        "heading": 0.3,
        "roll": 0.2,
        "pitch": 0.2,
        "horizontal position": 1.0,
        "vertical position": 2.0,
        "horizontal velocity": 0.2,
        "vertical velocity": 0.2,
    }
)


OPENING_ERROR: Mapping[Quantity, float] = MappingProxyType(
    {
        "heading": 1.5,
        "roll": 1.0,
        "pitch": 1.0,
        "horizontal position": 5.0,
        "vertical position": 10.0,
        "horizontal velocity": 1.0,
        "vertical velocity": 1.0,
    }
)


SURE_DEG = 5.0  # sigma of our attitude above which it judges nobody
