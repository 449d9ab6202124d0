"""Magnetic deviation in flight: found from turns of opposite bank, compensated, judged.

This is system 3.
"""
