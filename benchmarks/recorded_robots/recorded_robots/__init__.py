"""UTIAS, MILUV and MURP for groundstation: readers of the sets, and a study of the algorithms on them."""
