"""Landing by two locators and an additional beacon: deviations from course and glide path by relative bearings."""
