"""Landing by two locators and an additional beacon.

Relative bearings give the deviations from course and glide path.
"""
