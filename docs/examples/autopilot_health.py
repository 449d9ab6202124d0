"""Health of an autopilot by its log: checks, and parameters off their defaults or changed in flight."""

import groundstation

flight = groundstation.open("flight.ulg", without=["trajectory"])  # PX4 ULog, ArduPilot DataFlash or tlog
print(flight.metadata.to_string())

health = flight.health()
print(f"\n{health.verdict}: {health.sentence}")
checks = health.to_frame("checks")
print(checks.loc[checks["verdict"] != "not_logged", ["key", "verdict", "reason"]].to_string(index=False))

measures = health.to_frame("measures")  # the figures behind each check, with unit and limits
measures.to_csv("health_measures.csv", index=False)

parameters = flight.parameters
print("\noff their defaults")
print(parameters.loc[parameters["differs"], ["value", "default"]].to_string())
print("\nchanged while the log was recorded")
print(parameters.loc[parameters["changed"], ["first", "value"]].to_string())
