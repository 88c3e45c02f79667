//! Construction of the plant loop of an arm with Barrett's drives.

use super::drive::Barrett;
use super::error::CanError;
use super::start_up;
use supple_bus::Bus;
use supple_core::Config;
use supple_drive::{CycleConfig, Link, PlantLoop};

/// The plant loop of an arm with Barrett's drives.
pub type BarrettLoop<const N: usize, B, L> = PlantLoop<N, Barrett<N, B>, L>;

/// Creates the plant loop of an arm that has completed start-up.
///
/// # Errors
/// [`CanError::Overload`] if the period exceeds the bus bandwidth; an error if a puck's firmware lacks a property.
pub fn new_plant_loop<const N: usize, B: Bus, L: Link<N>>(
    bus: B,
    link: L,
    ready: start_up::Ready<N>,
    config: &Config<N>,
    cycle_config: CycleConfig,
) -> Result<BarrettLoop<N, B, L>, CanError> {
    let drive = Barrett::new(bus, ready, cycle_config)?;
    Ok(PlantLoop::new(drive, link, config, cycle_config, None)?)
}
