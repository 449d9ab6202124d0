"""Pages and fleet tables made from saved results: nothing is computed here, every number shown exists in results."""
