"""Chapters: the answers of a flight in words, written once and without markup.

:mod:`.by_answer` lists them.
"""
