"""Mathematics that several systems share: filters, fits, intervals.

No files, no wall clock, no prints.
"""
