"""Chapters: what the answers of a flight say, told once, without markup."""
