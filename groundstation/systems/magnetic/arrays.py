"""Arrays of the magnetic deviation.

Headings and deviations are in degrees, fields in nanotesla.
"""

from groundstation.results.arrays.typed import Arrays, ByName, Counts, Flags, Floats, Part, Texts, family
from groundstation.systems.magnetic.answer import MethodName

_FOUR, _FIELD = {"*": 4}, {"*": 1, "time_s": 3}


class MagneticSamples(Arrays, figure="magnetic_samples", digits=_FOUR):
    """Heading errors of the compass over time, before correction and by each method."""

    time_s: Floats
    part: Texts
    bank_deg: Floats
    uncorrected_magnetic_heading_deg: Floats
    compass_error_deg: Floats
    error_before_deg: Floats
    error_compass_table_deg: Floats
    error_poisson_attitude_deg: Floats
    error_constant_modulus_deg: Floats

    def error_after_deg(self, method: MethodName) -> Floats:
        """Error of the heading as corrected by a method."""
        return {
            "compass_table": self.error_compass_table_deg,
            "poisson_attitude": self.error_poisson_attitude_deg,
            "constant_modulus": self.error_constant_modulus_deg,
        }[method]


class MagneticTable(Arrays, figure="magnetic_table", digits=_FOUR):
    """The deviation table by heading, of right and left turns and as fitted."""

    uncorrected_magnetic_heading_deg: Floats
    right_turn_deg: Floats
    left_turn_deg: Floats
    compass_error_deg: Floats
    is_interpolated: Flags
    fitted_error_deg: Floats
    deviation_deg: Floats
    bank_bias_deg: Floats


class MagneticCurves(Arrays, figure="magnetic_curves", digits=_FOUR):
    """Deviation in level flight and its sigma by each method, and what is to be added."""

    uncorrected_magnetic_heading_deg: Floats
    deviation_deg: ByName = family("deviation_{}_deg")
    sigma_deg: ByName = family("sigma_{}_deg")
    deviation_to_add_deg: Floats
    deviation_sigma_deg: Floats


class MagneticModulus(Arrays, figure="magnetic_modulus", digits=_FIELD):
    """Length of the field in the figures, as read and freed of the iron fitted by two methods."""

    time_s: Floats
    before_nt: Floats
    poisson_attitude_nt: Floats
    constant_modulus_nt: Floats

    def freed(self) -> dict[MethodName, Floats]:
        """Modulus freed of the iron by the name of the method."""
        return {"poisson_attitude": self.poisson_attitude_nt, "constant_modulus": self.constant_modulus_nt}


class BodyField(Part):
    """Field along the body axes, forward, right and down."""

    forward_nt: Floats
    right_nt: Floats
    down_nt: Floats


class MagneticField(Arrays, figure="magnetic_field", digits=_FIELD):
    """Field along the body axes in flight, as read and freed of the fitted iron."""

    time_s: Floats
    part: Texts
    before: BodyField
    after: BodyField


class GroundRunEpochs(Arrays, figure="magnetic_ground_epochs", digits={"*": 3}):
    """Epochs of straight ground runs: magnetic heading against track."""

    time_s: Floats
    run: Counts
    is_used: Flags
    magnetic_heading_deg: Floats
    track_deg: Floats
    speed_mps: Floats
    heading_error_deg: Floats


class GroundRunCurve(Arrays, figure="magnetic_ground_curve", digits=_FOUR):
    """Error of the magnetic heading by ground runs, fitted, with its sigma."""

    magnetic_heading_deg: Floats
    heading_error_deg: Floats
    heading_error_sigma_deg: Floats


class FluxEpochRows(Arrays, figure="magnetic_flux_epochs", digits={"*": 3}):
    """Epochs in the air: heading as read, its error, lean in turns, error by lean as fitted.

    ``leg`` counts from 1, 0 in none.
    """

    time_s: Floats
    leg: Counts
    magnetic_heading_deg: Floats
    heading_error_deg: Floats
    lean_deg: Floats
    bank_error_deg: Floats


class FluxCurve(Arrays, figure="magnetic_flux_curve", digits=_FOUR):
    """Error of a heading sensor in flight, fitted, with its sigma, and what is to be added."""

    uncorrected_magnetic_heading_deg: Floats
    heading_error_deg: Floats
    heading_error_sigma_deg: Floats
    deviation_to_add_deg: Floats
    deviation_sigma_deg: Floats
    is_interpolated: Flags


class CorrectedHeadingRows(Arrays, figure="corrected_heading", digits=_FOUR):
    """Magnetic heading with a deviation table applied."""

    time_s: Floats
    magnetic_heading_deg: Floats
    uncorrected_magnetic_heading_deg: Floats
    deviation_deg: Floats
    true_heading_deg: Floats
