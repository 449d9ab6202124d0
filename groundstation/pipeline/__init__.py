"""One flight, a folder of flights: from log to MCAP, results, recording and report."""
