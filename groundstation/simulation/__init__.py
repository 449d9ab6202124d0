"""Truth flights and sensor models: seeded, quantised, written as the flat CSV every recorder can export."""
