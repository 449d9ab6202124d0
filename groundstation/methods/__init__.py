"""Mathematics that several systems share: filters, fits, intervals; no files, no wall clock, no prints."""
