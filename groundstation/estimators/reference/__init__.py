"""Judging by a reference: errors of what was recorded and estimated, and claimed against seen."""
