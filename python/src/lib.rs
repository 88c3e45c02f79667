//! Native part of the Python package `supple`: its private module `supple._native`.
//!
//! It converts NumPy arrays to the crates' types and their results to NumPy arrays. It computes nothing itself:
//! every number comes from the crates that the command line and the controller use. Shapes are checked here,
//! before the GIL is released.
#![deny(unsafe_code)]

mod arm;
mod arrays;
mod base;
mod check;
mod complete;
mod dh;
mod dynamics;
mod errors;
mod excite;
mod fit;
mod friction;
mod interrupt;
mod law;
mod learn;
mod live;
mod load;
mod log;
mod options;
mod plant_options;
mod samples;
mod simulate;
mod simulation;
mod table;

use pyo3::prelude::*;

/// Private module on which the package `supple` is built.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::arm::{Arm, assets};
    #[pymodule_export]
    use super::base::base_parameters;
    #[pymodule_export]
    use super::dh::dh_to_urdf;
    #[pymodule_export]
    use super::excite::{design_excitation, excite};
    #[pymodule_export]
    use super::fit::{Fit, identify};
    #[pymodule_export]
    use super::friction::Friction;
    #[pymodule_export]
    use super::learn::learn;
    #[pymodule_export]
    use super::live::Connection;
    #[pymodule_export]
    use super::load::{payload, ripple, torque_scale, weigh};
    #[pymodule_export]
    use super::log::read_log;
    #[pymodule_export]
    use super::plant_options::{plant_options, realistic_set};
    #[pymodule_export]
    use super::simulate::simulate;
    #[pymodule_export]
    use super::simulation::Simulation;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
