"""The time by which one record of a motion is later than another: windows, their fit, its limits."""
