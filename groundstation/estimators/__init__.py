"""Mathematics of the five systems: no files, no wall clock, no prints."""
