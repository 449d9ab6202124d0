"""Worker processes: side by side, each apart with limits, or on a cluster."""
