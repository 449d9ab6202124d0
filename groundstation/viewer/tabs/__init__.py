"""The tabs of the recording: each module logs what its tab shows and returns the layout of it."""
