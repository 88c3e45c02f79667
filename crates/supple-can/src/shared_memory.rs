//! The way to the controller through shared memory.

use crate::error::CanError;
use crate::link::{Answer, ArmReport, Command, Drives, Link};
use core::time::Duration;
use supple_ipc::message::{self, ArmState, PlantReport, TorqueCommand};
use supple_ipc::{IpcError, PlantLink, pause};
use supple_realtime::Stop;

/// How often virtual time looks whether a controller has come, or whether to stop.
const LOOK_EVERY: Duration = Duration::from_millis(50);
const JOIN_EVERY: Duration = Duration::from_millis(1);
/// Looks after which a controller that does not answer in virtual time counts as lost: 2 s.
const PATIENCE: u32 = 40;

/// The plant's end of shared memory.
pub struct SharedMemory {
    link: PlantLink,
    virtual_time: bool,
    /// The last cycle in virtual time was not answered: the next are not waited for.
    lost: bool,
    /// Commands for another arm.
    unusable: u64,
    stop: Stop,
}

impl SharedMemory {
    /// By the wall clock an answer is waited for as long as the cycle says; in virtual time until it
    /// comes, since no time passes on the bus.
    pub fn new(link: PlantLink, virtual_time: bool, stop: Stop) -> SharedMemory {
        SharedMemory {
            link,
            virtual_time,
            lost: false,
            unusable: 0,
            stop,
        }
    }

    /// What a command says; one for another arm is counted and is no answer.
    fn read<const N: usize>(&mut self, command: &TorqueCommand) -> Option<Command<N>> {
        let torques = (command.torque::<N>(), command.fallback_torque::<N>());
        let (Ok(torque_nm), Ok(fallback_torque_nm)) = torques else {
            self.unusable += 1;
            return None;
        };
        Some(Command {
            torque_nm,
            fallback_torque_nm,
            wants_torque: command.wants_torque(),
            mode: command.mode(),
            fault: command.fault != 0,
        })
    }

    /// Looks for an answer for so long before sleeping, see [`PlantLink::spin`].
    pub fn spin(&mut self, at_most: Duration) {
        self.link.spin(at_most);
    }
}

impl From<IpcError> for CanError {
    fn from(error: IpcError) -> CanError {
        CanError::Link(Box::new(error))
    }
}

impl<const N: usize> Link<N> for SharedMemory {
    fn announce(&mut self) -> Result<(), CanError> {
        if !self.virtual_time {
            self.link.announce()?;
        }
        Ok(())
    }

    fn publish(&mut self, report: &ArmReport<N>) -> Result<(), CanError> {
        let counters = &report.counters;
        let state = ArmState::new(
            report.cycle,
            report.stamp_ns,
            &report.position_rad,
            report.tip_force_n,
            match report.drives {
                Drives::Off => message::Drives::Off,
                Drives::Idle => message::Drives::Idle,
                Drives::Active => message::Drives::Active,
            },
            PlantReport {
                missed: counters.missed,
                late: counters.late_answers,
                foreign: self.link.foreign(),
                unusable: self.unusable + counters.unusable,
                tx_lost: counters.tx_lost,
                wake_ns: counters.wake_ns,
                round_trip_ns: counters.round_trip_ns,
                bus_load: counters.bus_load,
                stood_still_ns: counters.stood_still_ns,
            },
        );
        while !self.link.publish(&state)? {
            if !self.virtual_time || self.lost || self.stop.asked() {
                break;
            }
            pause(JOIN_EVERY);
        }
        Ok(())
    }

    fn answer(&mut self, cycle: u64, wait_ns: u64) -> Result<Answer<N>, CanError> {
        let mut late = 0;
        let looks = match (self.virtual_time, self.lost) {
            (false, _) | (true, true) => 1,
            (true, false) => PATIENCE,
        };
        let wait = match (self.virtual_time, self.lost) {
            (false, _) => Duration::from_nanos(wait_ns),
            (true, true) => JOIN_EVERY,
            (true, false) => LOOK_EVERY,
        };
        for _ in 0..looks {
            let heard = self.link.answer(cycle, wait)?;
            late += heard.late;
            if let Some(command) = heard.answer {
                self.lost = false;
                return Ok(Answer {
                    command: self.read::<N>(&command),
                    late,
                });
            }
            if self.stop.asked() {
                break;
            }
        }
        self.lost = self.virtual_time;
        Ok(Answer {
            command: None,
            late,
        })
    }
}
