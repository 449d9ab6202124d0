"""Plans: control of a session, placement of ground points, landing by ranges to reference points."""
