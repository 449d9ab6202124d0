"""Frozen answers: findings, verdicts and the arrays behind each figure; saved and loaded."""
