"""Heading correction of one log: the number to type, its interval, and why."""

import groundstation

flight = groundstation.open("flight.csv")  # your log: .csv, .ulg, .bin, .tlog, .mcap ...
heading = flight.heading()  # NotAssessableError, with the reason, where the data do not allow it

low, high = heading.confidence95_deg or (float("nan"), float("nan"))
print(f"verdict     {heading.verdict}: {heading.verdict_reason}")
print(f"error       {heading.error_deg:+.2f} deg, 95 % {low:+.2f} to {high:+.2f}")
if heading.correction_deg is not None:
    print(f"enter       {heading.correction_deg:+.1f} deg")

gates = heading.to_frame("gates")
print(gates.loc[gates["state"] != "passed", ["title", "value", "limit", "unit", "state"]].to_string(index=False))
