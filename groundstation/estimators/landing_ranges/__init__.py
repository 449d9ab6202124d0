"""Landing by ranges to ground reference points and to a moving one: the filter of the approach."""
