"""Pictures written from the description of a plot as SVG, without matplotlib."""
