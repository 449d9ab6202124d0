"""Advice of the magnetic deviation: what mends the reasons for which there is none."""

from groundstation.chapters.chapter import Remedies

REMEDIES: Remedies = (
    ("no turn of steady bank", ("Fly", "a full circle to either side at equal bank")),
    ("no three-axis magnetometer", ("Record", "a three-axis magnetometer")),
    ("trusts_aided_heading", ("Check", "where the INS heading comes from (setting trusts_aided_heading)")),
)
