"""Plots told once, without a painter: page, paper, recording and notebook draw the same description."""
