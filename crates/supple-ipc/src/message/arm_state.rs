//! Arm state: message from the plant to the controller, once per cycle.

use super::common::{Drives, MAX_DOF, MessageError, expect_dof, padded};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::Input;
use supple_core::controller::Request;
use supple_core::math::Vector3;

/// Measurements of the arm at the start of a cycle, and the plant's status report.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.ArmState.v4")]
pub struct ArmState {
    /// Writer id, see `writer_identity`; zero outside shared memory. Readers discard states with another id.
    pub writer: u64,
    /// Cycle number, incremented every period.
    pub cycle: u64,
    /// Time of the measurement \[ns\]: on the system's monotonic clock, or since the start in virtual time.
    pub stamp_ns: u64,
    /// Joint angles \[rad\]; zero if the encoder did not answer.
    pub position_rad: [f64; MAX_DOF],
    /// Force on the tip, base axes \[N\]; zero without a force sensor.
    pub tip_force_n: [f64; 3],
    /// Status report of the plant.
    pub plant: PlantReport,
    /// Number of joints of the arm.
    pub dof: u8,
    /// Bit `i` is set if the encoder of joint `i` answered.
    pub position_present: u8,
    /// 1 if `tip_force_n` was measured.
    pub has_tip_force: u8,
    /// Drive state, a code of [`Drives`].
    pub drives: u8,
    /// Zero.
    pub reserved: [u8; 4],
}

/// Counters and times of the plant. Counters are since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.PlantReport.v3")]
pub struct PlantReport {
    /// Number of cycles whose answer did not arrive in time.
    pub missed: u64,
    /// Number of answers that arrived after their cycle.
    pub late: u64,
    /// Number of torque commands discarded because this system's controller did not write them.
    pub foreign: u64,
    /// Number of torque commands treated as missing answers, because they are for another number of joints or not finite.
    pub unusable: u64,
    /// Number of frames whose transmission was not confirmed; 0 without a bus.
    pub tx_lost: u64,
    /// Delay of the start of this cycle \[ns\]; 0 in virtual time.
    pub wake_ns: u64,
    /// Time from publishing the state of the previous cycle to its answer \[ns\]; 0 if no answer arrived in time.
    pub round_trip_ns: u64,
    /// Fraction of the previous cycle in which the bus was busy, 0 to 1; 0 without a bus.
    pub bus_load: f64,
    /// Total time for which the clock of the simulated or emulated arm was paused because the host stalled \[ns\]; 0 on
    /// a real arm and in virtual time.
    pub clock_stall_ns: u64,
}

impl ArmState {
    /// Creates the state of an arm with `N` joints. A position is `None` if its encoder did not answer; the force is
    /// `None` if there is no force sensor.
    pub fn new<const N: usize>(
        cycle: u64,
        stamp_ns: u64,
        position_rad: &[Option<f64>; N],
        tip_force_n: Option<Vector3<f64>>,
        drives: Drives,
        plant: PlantReport,
    ) -> ArmState {
        let present = position_rad
            .iter()
            .enumerate()
            .fold(0, |bits, (i, position)| {
                bits | (u8::from(position.is_some()) << i)
            });
        ArmState {
            writer: 0,
            cycle,
            stamp_ns,
            position_rad: padded::<N>(&position_rad.map(Option::unwrap_or_default)),
            tip_force_n: tip_force_n.map_or([0.0; 3], Into::into),
            plant,
            dof: N as u8,
            position_present: present,
            has_tip_force: u8::from(tip_force_n.is_some()),
            drives: drives as u8,
            reserved: [0; 4],
        }
    }

    /// Converts the state to the input of the controller's step.
    ///
    /// # Errors
    /// [`MessageError::Dof`] if the arm does not have `N` joints.
    pub fn input<const N: usize>(
        &self,
        request: Option<Request<N>>,
    ) -> Result<Input<N>, MessageError> {
        expect_dof("the arm state", self.dof, N)?;
        let present = |i: usize| self.position_present >> i & 1 == 1;
        Ok(Input {
            cycle: self.cycle,
            position_rad: core::array::from_fn(|i| present(i).then_some(self.position_rad[i])),
            tip_force_n: (self.has_tip_force != 0).then(|| Vector3::from(self.tip_force_n)),
            drives_active: self.drives() == Drives::Active,
            request,
        })
    }

    /// Whether the state is of an arm with `N` joints.
    pub fn matches_dof<const N: usize>(&self) -> bool {
        usize::from(self.dof) == N
    }

    /// Drive state; an unknown code counts as [`Drives::Off`].
    pub fn drives(&self) -> Drives {
        Drives::from_code(self.drives).unwrap_or(Drives::Off)
    }
}
