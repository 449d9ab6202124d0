"""Tabs of the recording: each module logs the content of its tab and returns its layout."""
