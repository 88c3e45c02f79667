//! Type of a seed, and the state of an arm at rest, which several seeds contain.

use supple_core::Vector;
use supple_core::math::Vector3;
use supple_ipc::message::{ArmState, Drives, PlantReport};

/// Name and bytes of an input.
pub type Seed = (String, Vec<u8>);

/// Returns the state of an arm at rest in this cycle.
pub fn state_at_rest<const N: usize>(cycle: u64, position_rad: &Vector<N>) -> ArmState {
    ArmState::new::<N>(
        cycle,
        cycle * 1_000_000,
        &core::array::from_fn(|i| Some(position_rad[i])),
        Some(Vector3::zeros()),
        Drives::Active,
        PlantReport::default(),
    )
}
