"""Tables and results of a flight as a Rerun recording; the only room that imports rerun. Imports nothing heavy."""
