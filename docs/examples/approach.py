"""Touchdown and criteria of each approach of a flight."""

import groundstation

flight = groundstation.open("approach.csv", site="site.toml")  # the site file names runway and glide path
landing = flight.landing()

for approach in landing.approaches:
    print(f"approach {approach.number}: {approach.outcome} on runway {approach.runway.name}")
    touchdown = approach.touchdown
    if touchdown is not None:
        (at,) = flight.utc(touchdown.time_s)
        print(f"  touchdown {at:%H:%M:%S}, found by {touchdown.found_by}")
        if touchdown.past_threshold_m is not None:
            print(f"  {touchdown.past_threshold_m:.0f} m beyond the threshold")

criteria = landing.to_frame("criteria")
measured = criteria[criteria["value"].notna()]
print(measured[["approach", "title", "value", "unit", "at_most", "state"]].to_string(index=False))
print(landing.to_frame("events")[["time_s", "event", "what"]].to_string(index=False))
