"""Descriptions of plots, without a painter.

Page, paper, recording and notebook draw the same description.
"""
