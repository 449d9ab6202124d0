"""Chapters: what the answers of a flight say, told once, without markup; :mod:`.by_answer` lists them."""
