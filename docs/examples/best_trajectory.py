"""Best trajectory of a log with raw inertial data: a table, and the error of the on-board filter."""

import groundstation

flight = groundstation.open("flight.ulg", without=["forecast"])
trajectory = flight.trajectory()
print(f"{trajectory.state}, {trajectory.moving_s:.0f} s in motion")
print(trajectory.to_frame("accuracy")[["quantity", "median_within95", "unit"]].to_string(index=False))

states = flight.states()  # position, velocity, attitude, each with its sigma
states.to_frame().to_csv("trajectory.csv")  # indexed by UTC, units in the names

figure = flight.figure("trajectory-sigmas")  # matplotlib; pip install 'groundstation[notebook]'
figure.savefig("trajectory_sigmas.png", dpi=150)

if trajectory.onboard is not None:  # what the aircraft computed itself, against the best trajectory
    print(trajectory.to_frame("onboard.rows").to_string(index=False))
