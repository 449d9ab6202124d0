"""The plots of a flight as matplotlib figures, for notebooks; the only package that imports matplotlib."""
