//! From the plant to the controller, once a cycle.

use super::{Drives, MAX_DOF, MessageError, expect_dof, widened};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::Input;
use supple_core::controller::Request;
use supple_core::math::Vector3;

/// What the arm was at the start of a cycle, and how the plant's own side fares.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.ArmState.v3")]
pub struct ArmState {
    /// Who wrote it: the number that the holder of the writer's lock drew. Zero outside of shared memory; a reader
    /// takes no state of another writer.
    pub writer: u64,
    /// Number of the cycle, one more each period.
    pub cycle: u64,
    /// When it was measured \[ns\]: the system's monotonic clock, or since the start in virtual time.
    pub stamp_ns: u64,
    /// Joint angles \[rad\]; zero where the encoder did not answer.
    pub position_rad: [f64; MAX_DOF],
    /// Force on the tip, base axes \[N\]; zero where there is none.
    pub tip_force_n: [f64; 3],
    /// How the plant's side fares.
    pub plant: PlantReport,
    /// Joints of the arm.
    pub dof: u8,
    /// Bit `i` is set where the encoder of joint `i` answered.
    pub position_present: u8,
    /// 1 where `tip_force_n` was measured.
    pub has_tip_force: u8,
    /// What the motors do, a number of [`Drives`].
    pub drives: u8,
    /// Zero.
    pub reserved: [u8; 4],
}

/// Counters and times of the process that owns the clock. Counts are since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.PlantReport.v3")]
pub struct PlantReport {
    /// Cycles whose answer did not come in time.
    pub missed: u64,
    /// Answers that came after their cycle.
    pub late: u64,
    /// Torque commands that were dropped because the controller of this system did not write them.
    pub foreign: u64,
    /// Torque commands that counted as no answer: of another number of joints, or not finite.
    pub unusable: u64,
    /// Frames that were not seen to leave; 0 without a bus.
    pub tx_lost: u64,
    /// By how much this cycle began late \[ns\]; 0 in virtual time.
    pub wake_ns: u64,
    /// From publishing the state of the previous cycle to its answer \[ns\]; 0 where none came in time.
    pub round_trip_ns: u64,
    /// Share of the previous cycle in which the bus was busy, 0 to 1; 0 without a bus.
    pub bus_load: f64,
    /// How long the simulated or emulated arm's time has stood still because the machine held it up \[ns\]; 0 on
    /// a real arm, and in virtual time.
    pub stood_still_ns: u64,
}

impl ArmState {
    /// Of an arm with `N` joints; `None` where an encoder did not answer or there is no force sensor.
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
            .fold(0, |bits, (i, p)| bits | (u8::from(p.is_some()) << i));
        ArmState {
            writer: 0,
            cycle,
            stamp_ns,
            position_rad: widened::<N>(&position_rad.map(Option::unwrap_or_default)),
            tip_force_n: tip_force_n.map_or([0.0; 3], Into::into),
            plant,
            dof: N as u8,
            position_present: present,
            has_tip_force: u8::from(tip_force_n.is_some()),
            drives: drives as u8,
            reserved: [0; 4],
        }
    }

    /// What a controller is given.
    ///
    /// # Errors
    /// [`MessageError::Dof`] where the arm has not `N` joints.
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

    /// It is of an arm with `N` joints.
    pub fn is_of<const N: usize>(&self) -> bool {
        usize::from(self.dof) == N
    }

    /// What the motors do; a number that is not known is taken as [`Drives::Off`].
    pub fn drives(&self) -> Drives {
        Drives::from_code(self.drives).unwrap_or(Drives::Off)
    }
}
