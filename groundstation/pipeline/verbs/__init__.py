"""What single verbs do beside running flights."""
