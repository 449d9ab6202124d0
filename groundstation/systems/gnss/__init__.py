"""GNSS reception: what a receiver had, how good it was, and where it was lost."""
