//! Friction of a joint in the controller's law.

use crate::arrays;
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use supple_core::friction::{self, LoadTorque};

/// Friction of one joint: viscous and Coulomb, continuous over a band, with Stribeck effect and offset.
///
/// ``D(v) = [V + A p(v / delta)] v + O + O_s e(v) + [S + (S0 - S) e(v)] p(v / delta)`` with ``e(v) = exp(-(v / v_s)^2)`` and
/// ``p(x) = 2 x - sign(x) x^2`` inside the band and ``sign(x)`` outside. Immutable.
///
/// Parameters
/// ----------
/// viscous_nm_s_per_rad : float
///     ``V`` (N m s/rad), zero or more. Default 0.
/// viscous_asymmetry_nm_s_per_rad : float
///     ``A`` (N m s/rad), half of the difference between the viscous friction of the positive and the negative direction, at
///     most ``viscous_nm_s_per_rad`` in magnitude. Default 0.
/// coulomb_nm : float
///     ``S`` (N m), zero or more. Default 0.
/// breakaway_nm : float, optional
///     ``S0`` (N m), at least ``coulomb_nm``. Default: ``coulomb_nm``, no Stribeck effect.
/// stribeck_rad_per_s : float
///     ``v_s`` (rad/s), positive. Default 0.05.
/// offset_nm : float
///     ``O`` (N m), torque that does not depend on the velocity. Default 0.
/// stribeck_offset_nm : float
///     ``O_s`` (N m), torque at rest in addition to ``offset_nm``, which falls with the Stribeck effect; at most
///     ``breakaway_nm - coulomb_nm`` in magnitude. Default 0.
/// band_rad_per_s : float
///     ``delta`` (rad/s), positive. Default 0.01.
/// presliding_rad : float
///     Travel over which dry friction turns round after a reversal (rad), zero or more. Default 0: its direction is
///     that of the velocity.
/// load_coefficient : float
///     Dry friction that a torque on the gear adds, per torque, 0 to 0.5. Default 0: friction does not depend on the load.
/// load_torque : {"joint", "motor"}
///     Which torque that is: that which the joint carries, or that of the motor, which has to overcome friction as well.
/// coulomb_at_nm : float
///     Size of that torque at which dry friction is ``coulomb_nm`` (N m), zero or more. Default 0.
///
/// Raises
/// ------
/// ValueError
///     If the friction would supply energy to the joint.
///
/// Examples
/// --------
/// >>> import supple
/// >>> friction = supple.Friction(viscous_nm_s_per_rad=2.0, coulomb_nm=0.5)
/// >>> friction.torque_nm([-1.0, 0.0, 1.0])
/// array([-2.5,  0. ,  2.5])
#[pyclass(frozen, eq, module = "supple", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub struct Friction {
    pub inner: friction::Friction,
}

/// Function that a pickle calls, with its arguments.
type Pickle<'py> = (Bound<'py, PyAny>, ([f64; 11], &'static str));

#[pymethods]
impl Friction {
    #[new]
    #[pyo3(signature = (
        *,
        viscous_nm_s_per_rad = 0.0,
        viscous_asymmetry_nm_s_per_rad = 0.0,
        coulomb_nm = 0.0,
        breakaway_nm = None,
        stribeck_rad_per_s = friction::Friction::NONE.stribeck_rad_per_s,
        offset_nm = 0.0,
        stribeck_offset_nm = 0.0,
        band_rad_per_s = friction::Friction::NONE.band_rad_per_s,
        presliding_rad = 0.0,
        load_coefficient = 0.0,
        load_torque = "joint",
        coulomb_at_nm = 0.0,
    ), text_signature = "(*, viscous_nm_s_per_rad=0.0, viscous_asymmetry_nm_s_per_rad=0.0, \
        coulomb_nm=0.0, breakaway_nm=None, \
        stribeck_rad_per_s=0.05, offset_nm=0.0, stribeck_offset_nm=0.0, band_rad_per_s=0.01, \
        presliding_rad=0.0, load_coefficient=0.0, load_torque='joint', \
        coulomb_at_nm=0.0)")]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        viscous_nm_s_per_rad: f64,
        viscous_asymmetry_nm_s_per_rad: f64,
        coulomb_nm: f64,
        breakaway_nm: Option<f64>,
        stribeck_rad_per_s: f64,
        offset_nm: f64,
        stribeck_offset_nm: f64,
        band_rad_per_s: f64,
        presliding_rad: f64,
        load_coefficient: f64,
        load_torque: &str,
        coulomb_at_nm: f64,
    ) -> PyResult<Self> {
        let load_torque = match load_torque {
            "joint" => LoadTorque::Joint,
            "motor" => LoadTorque::Motor,
            other => {
                return Err(PyValueError::new_err(format!(
                    "load_torque: expected \"joint\" or \"motor\", got {other:?}"
                )));
            }
        };
        let inner = friction::Friction {
            viscous_nm_s_per_rad,
            viscous_asymmetry_nm_s_per_rad,
            coulomb_nm,
            breakaway_nm: breakaway_nm.unwrap_or(coulomb_nm),
            stribeck_rad_per_s,
            offset_nm,
            stribeck_offset_nm,
            band_rad_per_s,
            presliding_rad,
            load_coefficient,
            load_torque,
            coulomb_at_nm,
        };
        inner
            .validate()
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self { inner })
    }

    /// Viscous friction (N m s/rad).
    #[getter]
    fn viscous_nm_s_per_rad(&self) -> f64 {
        self.inner.viscous_nm_s_per_rad
    }

    /// Half of the difference between the viscous friction of the positive and the negative direction (N m s/rad).
    #[getter]
    fn viscous_asymmetry_nm_s_per_rad(&self) -> f64 {
        self.inner.viscous_asymmetry_nm_s_per_rad
    }

    /// Coulomb torque in steady sliding (N m).
    #[getter]
    fn coulomb_nm(&self) -> f64 {
        self.inner.coulomb_nm
    }

    /// Limit of the Stribeck curve at standstill (N m).
    #[getter]
    fn breakaway_nm(&self) -> f64 {
        self.inner.breakaway_nm
    }

    /// Stribeck speed (rad/s).
    #[getter]
    fn stribeck_rad_per_s(&self) -> f64 {
        self.inner.stribeck_rad_per_s
    }

    /// Travel over which dry friction turns round after a reversal (rad).
    #[getter]
    fn presliding_rad(&self) -> f64 {
        self.inner.presliding_rad
    }

    /// Dry friction that a torque on the gear adds, per torque.
    #[getter]
    fn load_coefficient(&self) -> f64 {
        self.inner.load_coefficient
    }

    /// Which torque that is, "joint" or "motor".
    #[getter]
    fn load_torque(&self) -> &'static str {
        match self.inner.load_torque {
            LoadTorque::Joint => "joint",
            LoadTorque::Motor => "motor",
        }
    }

    /// Size of that torque at which dry friction is ``coulomb_nm`` (N m).
    #[getter]
    fn coulomb_at_nm(&self) -> f64 {
        self.inner.coulomb_at_nm
    }

    /// Torque that does not depend on the velocity (N m).
    #[getter]
    fn offset_nm(&self) -> f64 {
        self.inner.offset_nm
    }

    /// Torque at rest in addition to ``offset_nm``, which falls with the Stribeck effect (N m).
    #[getter]
    fn stribeck_offset_nm(&self) -> f64 {
        self.inner.stribeck_offset_nm
    }

    /// Half-width of the band in which dry friction is a parabola (rad/s).
    #[getter]
    fn band_rad_per_s(&self) -> f64 {
        self.inner.band_rad_per_s
    }

    /// Torque that compensates friction (N m), of the shape of ``velocity_rad_per_s``.
    ///
    /// Parameters
    /// ----------
    /// velocity_rad_per_s : array_like
    ///     Joint velocities (rad/s), any shape.
    fn torque_nm<'py>(
        &self,
        py: Python<'py>,
        velocity_rad_per_s: &Bound<'py, PyAny>,
    ) -> PyResult<arrays::Array<'py>> {
        let velocity = arrays::numbers("velocity_rad_per_s", velocity_rad_per_s)?;
        let values = velocity.as_slice()?.iter();
        let torques = values.map(|v| self.inner.torque_nm(*v)).collect();
        arrays::array(py, torques, velocity.shape())
    }

    /// Constructor for pickles: viscous, its asymmetry, Coulomb, breakaway, Stribeck speed, offset, Stribeck offset, band, presliding,
    /// load coefficient, load.
    #[staticmethod]
    fn _of(values: [f64; 11], load_torque: &str) -> PyResult<Self> {
        let [
            viscous,
            viscous_asymmetry,
            coulomb,
            breakaway,
            stribeck,
            offset,
            stribeck_offset,
            band,
            presliding,
            load_coefficient,
            coulomb_at_nm,
        ] = values;
        Self::new(
            viscous,
            viscous_asymmetry,
            coulomb,
            Some(breakaway),
            stribeck,
            offset,
            stribeck_offset,
            band,
            presliding,
            load_coefficient,
            load_torque,
            coulomb_at_nm,
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickle<'py>> {
        let f = &self.inner;
        let rebuild = py.get_type::<Self>().getattr("_of")?;
        let values = [
            f.viscous_nm_s_per_rad,
            f.viscous_asymmetry_nm_s_per_rad,
            f.coulomb_nm,
            f.breakaway_nm,
            f.stribeck_rad_per_s,
            f.offset_nm,
            f.stribeck_offset_nm,
            f.band_rad_per_s,
            f.presliding_rad,
            f.load_coefficient,
            f.coulomb_at_nm,
        ];
        Ok((rebuild, (values, self.load_torque())))
    }

    fn __repr__(&self) -> String {
        let f = &self.inner;
        format!(
            "Friction(viscous_nm_s_per_rad={}, viscous_asymmetry_nm_s_per_rad={}, coulomb_nm={}, \
             breakaway_nm={}, \
             stribeck_rad_per_s={}, offset_nm={}, stribeck_offset_nm={}, band_rad_per_s={}, presliding_rad={}, \
             load_coefficient={}, load_torque={:?}, coulomb_at_nm={})",
            f.viscous_nm_s_per_rad,
            f.viscous_asymmetry_nm_s_per_rad,
            f.coulomb_nm,
            f.breakaway_nm,
            f.stribeck_rad_per_s,
            f.offset_nm,
            f.stribeck_offset_nm,
            f.band_rad_per_s,
            f.presliding_rad,
            f.load_coefficient,
            self.load_torque(),
            f.coulomb_at_nm
        )
    }
}
