"""Advice of the approaches: what mends the reasons for which there are none."""

from groundstation.chapters.chapter import Remedies

REMEDIES: Remedies = (("no position of the aircraft", ("Record", "positions")),)
