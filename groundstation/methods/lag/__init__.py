"""Delay of one record of a motion behind another: windows, their fit, its limits."""
