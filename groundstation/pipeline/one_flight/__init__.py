"""One flight: from a log to MCAP, answers, recording and report."""
