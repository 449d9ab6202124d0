"""INS errors of all logs of a folder in one CSV, a line for each channel and state."""

from pathlib import Path

import pandas as pd

import groundstation

frames = []
for log in sorted(Path("logs").glob("*.csv")):
    try:
        flight = groundstation.open(log, without=["forecast", "trajectory"])  # the slow ones
        states = flight.inertial().to_frame("states")
    except groundstation.GroundstationError as reason:  # one line: what is missing, or what is wrong
        print(f"{log.name}: {reason}")
        continue
    states.insert(0, "log", log.name)
    frames.append(states)

table = pd.concat(frames)
table.to_csv("ins_errors.csv", index=False)
print(table[["log", "channel", "name", "value", "sigma", "unit"]].to_string(index=False))
