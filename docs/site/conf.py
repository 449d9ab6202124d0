"""Settings of Sphinx for the site; `make site` builds it."""

project = "groundstation"
extensions = ["myst_parser"]
html_theme = "furo"
html_title = "groundstation"
html_copy_source = False
myst_heading_anchors = 4
suppress_warnings = ["misc.highlighting_failure"]
highlight_language = "none"
