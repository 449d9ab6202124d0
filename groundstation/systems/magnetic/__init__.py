"""Magnetic deviation in flight and on ground runs, steer card, corrected headings."""
