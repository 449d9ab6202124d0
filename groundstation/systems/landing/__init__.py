"""Approaches flown: against a runway and its aids, and by two locators."""
