"""Runs of many logs: listed, run, put into OUT, continued."""
