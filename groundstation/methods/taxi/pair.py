"""Needs of a straight taxi: an INS heading and GNSS velocities."""

from groundstation.tables.sources import GNSS_VELOCITY, Need, PairNeed

HEADING_AND_VELOCITY = PairNeed(
    "heading",
    Need("ins", "INS heading", ("true_heading_deg",), or_else=("magnetic_heading_deg",), is_nose=True),
    GNSS_VELOCITY,
)
