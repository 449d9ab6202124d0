"""Taxi: pairs of INS heading and GNSS velocity on the ground, and why each is used or not."""
