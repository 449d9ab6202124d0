"""One log under two settings, then a folder of flights by aircraft."""

import groundstation

flight = groundstation.open("flight.csv")
slower = flight.with_settings(heading={"taxi_speed_min_mps": 5.0})  # the log is not read again
for name, one in {"as shipped": flight, "above 5 m/s": slower}.items():
    heading = one.heading()
    print(f"{name:12} {heading.verdict:9} {heading.error_deg:+.3f} deg, {heading.samples} samples")

fleet = groundstation.open_fleet("out")  # what `groundstation run logs -o out` left; a pandas frame
print(fleet.groupby("aircraft")["error_deg"].agg(["count", "mean", "std"]))

worst = fleet.loc[fleet["error_deg"].abs().idxmax(), "flight_id"]
opened = fleet.flight(worst)  # read only now
print(f"largest heading error: {worst}")
print(opened.findings[["severity", "text"]].to_string(index=False))
