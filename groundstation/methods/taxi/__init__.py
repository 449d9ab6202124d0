"""Taxi: pairs of INS heading and GNSS velocity on the ground, and the gates on them."""
