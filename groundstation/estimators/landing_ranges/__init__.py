"""Landing by ranges to ground points and to a moving point: the filter of the approach."""
