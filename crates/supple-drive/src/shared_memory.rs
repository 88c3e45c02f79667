//! Link to the controller through shared memory.

use crate::error::LoopError;
use crate::link::{Answer, ArmReport, Command, Drives, Link};
use core::time::Duration;
use supple_ipc::message::{self, ArmState, PlantReport, TorqueCommand};
use supple_ipc::{IpcError, PlantLink};
use supple_realtime::{Stop, pause};

/// Interval in virtual time at which the link checks for an answer and for a shutdown request.
const ANSWER_POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Poll interval for a controller to join, and time for an answer once the controller is lost.
const JOIN_POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Number of polls without an answer after which a controller that has left, or that another one has replaced, counts as lost in
/// virtual time (2 s).
const MAX_UNANSWERED_POLLS: u32 = 40;
/// The same number for a controller that exists (a minute): it may be blocked by a reader of its telemetry that the machine keeps from
/// running.
const MAX_UNANSWERED_POLLS_OF_EXISTING: u32 = 1200;

/// The plant's link to the controller through shared memory.
pub struct SharedMemoryLink {
    link: PlantLink,
    virtual_time: bool,
    /// Whether the last cycle in virtual time was not answered; the following cycles then wait for one poll interval only.
    lost: bool,
    /// Number of commands for another arm.
    wrong_arm: u64,
    stop: Stop,
}

impl SharedMemoryLink {
    /// Creates the link. In real time it waits for an answer as long as the cycle allows. In virtual time, which does not
    /// advance during the wait, it waits until the answer arrives or the controller counts as lost: after 2 s if it has left or another
    /// one has replaced it, else after a minute.
    pub fn new(link: PlantLink, virtual_time: bool, stop: Stop) -> SharedMemoryLink {
        SharedMemoryLink {
            link,
            virtual_time,
            lost: false,
            wrong_arm: 0,
            stop,
        }
    }

    /// Decodes a command; counts and discards a command for an arm with another number of joints.
    fn read<const N: usize>(&mut self, command: &TorqueCommand) -> Option<Command<N>> {
        let torques = (command.torque::<N>(), command.fallback_torque::<N>());
        let (Ok(torque_nm), Ok(fallback_torque_nm)) = torques else {
            self.wrong_arm += 1;
            return None;
        };
        Some(Command {
            torque_nm,
            fallback_torque_nm,
            wants_torque: command.wants_torque(),
            mode: command.mode(),
            fault: command.fault != 0,
            codes: [command.mode, command.fault],
        })
    }

    /// Sets the time to poll for an answer before blocking, see [`PlantLink::spin`].
    pub fn set_spin_duration(&mut self, at_most: Duration) {
        self.link.set_spin_duration(at_most);
    }
}

impl From<IpcError> for LoopError {
    fn from(error: IpcError) -> LoopError {
        LoopError::Link(Box::new(error))
    }
}

impl<const N: usize> Link<N> for SharedMemoryLink {
    fn announce(&mut self) -> Result<(), LoopError> {
        if !self.virtual_time {
            self.link.announce()?;
        }
        Ok(())
    }

    fn publish(&mut self, report: &ArmReport<N>) -> Result<(), LoopError> {
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
                Drives::Held => message::Drives::Held,
            },
            PlantReport {
                missed: counters.missed,
                late: counters.late_answers,
                foreign: self.link.foreign(),
                unusable: self.wrong_arm + counters.unusable,
                tx_lost: counters.tx_lost,
                wake_ns: counters.wake_ns,
                round_trip_ns: counters.round_trip_ns,
                bus_load: counters.bus_load,
                clock_stall_ns: counters.clock_stall_ns,
            },
        );
        while !self.link.publish(&state)? {
            if !self.virtual_time || self.lost || self.stop.shutdown_requested() {
                break;
            }
            pause(JOIN_POLL_INTERVAL);
        }
        Ok(())
    }

    fn answer(&mut self, cycle: u64, wait_ns: u64) -> Result<Answer<N>, LoopError> {
        let mut late = 0;
        let polls = match (self.virtual_time, self.lost) {
            (false, _) | (true, true) => 1,
            (true, false) => MAX_UNANSWERED_POLLS_OF_EXISTING,
        };
        let wait = match (self.virtual_time, self.lost) {
            (false, _) => Duration::from_nanos(wait_ns),
            (true, true) => JOIN_POLL_INTERVAL,
            (true, false) => ANSWER_POLL_INTERVAL,
        };
        for poll in 1..=polls {
            let received = self.link.answer(cycle, wait)?;
            late += received.late;
            if let Some(command) = received.answer {
                self.lost = false;
                return Ok(Answer {
                    command: self.read::<N>(&command),
                    late,
                });
            }
            if self.stop.shutdown_requested() {
                break;
            }
            if poll >= MAX_UNANSWERED_POLLS && !self.link.has_same_controller()? {
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
