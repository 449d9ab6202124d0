"""What autopilots log of their own filter: one sign and one shape for each of them."""

import numpy as np
import pytest

from groundstation.base.records import Column
from groundstation.tables.own_filter import own_innovations
from groundstation.tables.table import Flight, Table
from tests.systems.inertial.flights import table_of

TIME_S = np.arange(5.0)
PX4 = ("gps_hpos[0]", "gps_hpos[1]", "gps_hvel[0]", "gps_hvel[1]")
LAYOUTS = {
    "raw.estimator_innovations": PX4,
    "raw.ekf2_innovations": tuple(f"vel_pos_innov[{place}]" for place in (3, 4, 0, 1)),
    "raw.XKF3": ("IPN", "IPE", "IVN", "IVE"),
    "raw.EKF3": ("IPN", "IPE", "IVN", "IVE"),
}


def logged(topic: str, names: tuple[str, ...], values: tuple[float, ...]) -> Table:
    return table_of(topic, TIME_S, {name: np.full(5, value) for name, value in zip(names, values, strict=True)})


@pytest.mark.parametrize("topic", LAYOUTS)
def test_autopilots_log_predicted_minus_measured(topic: str) -> None:
    table = logged(topic, LAYOUTS[topic], (1.0, 2.0, 0.3, 0.4))
    found = own_innovations(Flight({topic: table}))
    assert found is not None and found.topic == topic
    assert found.innovation[0].tolist() == [[-1.0, -2.0], [-0.3, -0.4]]
    assert np.isnan(found.variance).all() and np.isnan(found.gate_ratio).all()


def test_variances_and_gates_are_joined_on_time() -> None:
    flight = Flight({"raw.NKF3": logged("raw.NKF3", LAYOUTS["raw.EKF3"], (1.0, 1.0, 0.1, 0.1))})
    gate = table_of("raw.NKF4", TIME_S + 0.01, {"SP": np.full(5, 1.2), "SV": np.full(5, 0.5)})
    found = own_innovations(Flight({**flight.tables, "raw.NKF4": gate}))
    assert found is not None and found.gate_ratio[1].tolist() == [[1.2, 1.2], [0.5, 0.5]]
    px4 = {
        topic: logged(topic, PX4, values)
        for topic, values in (
            ("raw.estimator_innovations", (1.0, 1.0, 0.1, 0.1)),
            ("raw.estimator_innovation_variances", (4.0, 4.0, 0.01, 0.0)),
        )
    }
    found = own_innovations(Flight(px4))
    assert found is not None and found.variance[0].tolist() == [[4.0, 4.0], [0.01, 0.0]]
    assert np.isnan(found.innovation[0, 1, 1])  # no variance: GNSS was not used


def test_of_several_filters_the_first_is_read_and_an_idle_one_tells_nothing() -> None:
    table = logged("raw.XKF3", LAYOUTS["raw.XKF3"], (1.0, 1.0, 0.1, 0.1))
    core = {"C": Column(np.array([0, 1, 0, 1, 0]))}
    two = Table("raw.XKF3", table.time_ns, {**table.columns, **core}, table.record_index, table.device_time_ns)
    found = own_innovations(Flight({"raw.XKF3": two}))
    assert found is not None and len(found.time_ns) == 3
    assert own_innovations(Flight({"raw.EKF3": logged("raw.EKF3", LAYOUTS["raw.EKF3"], (0.0,) * 4)})) is None
    assert own_innovations(Flight({})) is None
