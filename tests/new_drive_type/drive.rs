//! Drives with moteus motors: the torque command is also the request for the motor state. Position control and stiffness of the
//! motor are off (position NaN, kp scale 0); its damping is on while the arm is held.

use core::f64::consts::TAU;
use moteus_protocol::command::{PositionCommand, PositionFormat, StopCommand};
use moteus_protocol::query::{QueryFormat, QueryResult};
use moteus_protocol::{CanFdFrame, Mode, Resolution, calculate_arbitration_id};
use supple_bus::{Bus, Event};
use supple_can_frame::timing::FrameLayout;
use supple_can_frame::{BitRates, CanFrame, CanId};
use supple_core::Vector;
use supple_core::controller::Mode::GravityHold;
use supple_drive::{
    Budget, BusPort, Command, Drive, DriveCounters, DriveState, Drives, LoopError, LossReason,
    LoweringMode, MotorFault, Reading, Received, ReservedTimes, TorqueOffBehaviour,
};

/// Damping of a motor at kd scale 1 \[N m s/rad\].
pub const KD_NM_S_PER_RAD: f64 = 4.0;
/// Watchdog time: time without a command after which a motor ends its torque \[s\].
const WATCHDOG_S: f32 = 0.02;
const MAX_TORQUE_NM: f32 = 100.0;
/// Data length codes of 48 and 32 bytes.
const COMMAND_DLC: u8 = 14;
const REPLY_DLC: u8 = 13;
const REGISTER_MAP: u16 = 0x102;

/// Encodes a torque at the output \[N m\], with a fraction of the motor's damping.
fn torque_frame(frame: &mut CanFdFrame, torque_nm: f64, kd_scale: f64) {
    PositionCommand::new()
        .position(f32::NAN)
        .velocity(0.0)
        .feedforward_torque(torque_nm as f32)
        .kp_scale(0.0)
        .kd_scale(kd_scale as f32)
        .maximum_torque(MAX_TORQUE_NM)
        .watchdog_timeout(WATCHDOG_S)
        .ilimit_scale(0.0)
        .serialize(frame, &PositionFormat::default());
    QueryFormat::default().serialize(frame);
}

/// Returns the bus frame to motor `index`, counted from 0.
fn on_bus(index: usize, mut frame: CanFdFrame) -> CanFrame {
    frame.pad_to_dlc();
    let id = calculate_arbitration_id(0, index as i8 + 1, 0, true);
    let id = CanId::extended(id).expect("29 bits");
    CanFrame::fd(id, true, frame.payload()).expect("a length of FD")
}

/// Returns the motor, counted from 0, that sent a frame to the host.
fn sender(frame: &CanFrame) -> Option<usize> {
    let raw = frame.id().as_standard()?;
    (raw & 0xff == 0).then(|| usize::from(raw >> 8 & 0x7f).checked_sub(1))?
}

/// Checks every motor before any motor applies torque.
pub fn start_up<const N: usize, B: Bus>(bus: &mut B) -> Result<(), String> {
    for index in 0..N {
        let mut frame = CanFdFrame::new();
        StopCommand::serialize(&mut frame);
        let mut query = QueryFormat::minimal();
        query.add_extra(REGISTER_MAP, Resolution::Int16);
        query.serialize(&mut frame);
        bus.send(&on_bus(index, frame)).map_err(|e| e.to_string())?;
        let until_ns = bus.now_ns() + 5_000_000;
        let mut found = None;
        while let Some(event) = bus.receive_until(until_ns).map_err(|e| e.to_string())? {
            if let Event::Frame(reply) = event
                && sender(&reply) == Some(index)
            {
                found = QueryResult::parse_data(reply.payload()).get_extra(REGISTER_MAP);
                break;
            }
        }
        match found {
            Some(5.0) => {}
            Some(map) => return Err(format!("motor {index}: register map {map}, expected 5")),
            None => return Err(format!("motor {index} does not answer")),
        }
    }
    Ok(())
}

/// The moteus motors of an arm, one per joint.
pub struct Moteus<const N: usize, B> {
    port: BusPort<B>,
    replies: [Option<QueryResult>; N],
    modes: [Mode; N],
    faults: [i8; N],
    enabled: bool,
    latched: bool,
    torque_nm: Vector<N>,
    damping_nm_s_per_rad: Vector<N>,
}

impl<const N: usize, B: Bus> Moteus<N, B> {
    pub fn new(bus: B) -> Moteus<N, B> {
        Moteus {
            port: BusPort::new(bus, BitRates::FD_1M_5M),
            replies: core::array::from_fn(|_| None),
            modes: [Mode::Stopped; N],
            faults: [0; N],
            enabled: false,
            latched: false,
            torque_nm: Vector::zeros(),
            damping_nm_s_per_rad: Vector::zeros(),
        }
    }

    pub fn bus(&self) -> &B {
        self.port.bus()
    }

    pub fn bus_mut(&mut self) -> &mut B {
        self.port.bus_mut()
    }

    fn missing(&self) -> u32 {
        self.replies.iter().filter(|reply| reply.is_none()).count() as u32
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<(), LoopError> {
        while self.receive(until_ns, u32::MAX)? {}
        Ok(())
    }

    fn receive(&mut self, until_ns: u64, frames: u32) -> Result<bool, LoopError> {
        match self.port.receive(until_ns, frames)? {
            Received::Nothing => return Ok(false),
            Received::Other => {}
            Received::Frame(frame) => {
                if let Some(index) = sender(&frame).filter(|index| *index < N) {
                    let result = QueryResult::parse_data(frame.payload());
                    // The parser accepts any bytes: a reply without a position is ignored.
                    if result.position.is_finite() {
                        self.modes[index] = result.mode;
                        self.faults[index] = result.fault;
                        self.replies[index] = Some(result);
                    }
                }
            }
        }
        Ok(true)
    }
}

impl<const N: usize, B: Bus> Drive<N> for Moteus<N, B> {
    fn now_ns(&self) -> u64 {
        self.port.bus().now_ns()
    }

    fn torque_off_behaviour(&self) -> TorqueOffBehaviour {
        TorqueOffBehaviour::Falls
    }

    fn reserved(&self) -> ReservedTimes {
        ReservedTimes {
            states_ns: self.budget().bus_ns(),
            torques_ns: 0,
        }
    }

    fn budget(&self) -> Budget {
        let format = self.port.rates().fastest_format();
        let command = FrameLayout {
            extended: true,
            ..FrameLayout::standard(format, COMMAND_DLC)
        };
        Budget::new(self.port.rates(), N)
            .frames("commands", N, command)
            .frames("replies", N, FrameLayout::standard(format, REPLY_DLC))
    }

    fn request(&mut self) -> Result<(), LoopError> {
        self.replies = core::array::from_fn(|_| None);
        for index in 0..N {
            let mut frame = CanFdFrame::new();
            if self.enabled {
                let kd_scale = self.damping_nm_s_per_rad[index] / KD_NM_S_PER_RAD;
                torque_frame(&mut frame, self.torque_nm[index], kd_scale);
            } else {
                StopCommand::serialize(&mut frame);
                QueryFormat::default().serialize(&mut frame);
            }
            self.port.send(&on_bus(index, frame))?;
        }
        Ok(())
    }

    fn collect(&mut self, until_ns: u64) -> Result<u8, LoopError> {
        loop {
            let missing = self.missing();
            if missing == 0 || !self.receive(until_ns, missing)? {
                break;
            }
        }
        self.port.count_lost_replies(u64::from(self.missing()));
        let lost = self.replies.iter().enumerate();
        Ok(lost.fold(0, |mask, (i, reply)| mask | u8::from(reply.is_none()) << i))
    }

    fn reading(&self) -> Reading<N> {
        Reading {
            position_rad: core::array::from_fn(|index| {
                let reply = self.replies[index].as_ref()?;
                Some(f64::from(reply.position) * TAU)
            }),
            tip_force: None,
        }
    }

    fn state(&self) -> DriveState {
        let active = |mode: &Mode| *mode == Mode::Position;
        let drives = match self.modes.iter().any(active) {
            true => Drives::Active,
            false => Drives::Idle,
        };
        // Numbers from 96 on report a limit of the motor and are not faults.
        let fault = |index: usize| matches!(self.modes[index], Mode::Fault | Mode::Timeout);
        let faulty = (0..N).find(|index| self.enabled && fault(*index));
        DriveState {
            drives,
            unsent: self.port.frames_lost(),
            bus_off: self.port.bus_off(),
            loss: faulty.map(|index| {
                let code = self.faults[index] as u8;
                LossReason::Motor(index, MotorFault::Unknown(code))
            }),
        }
    }

    fn operate(&mut self, command: Option<&Command<N>>, allowed: bool) -> bool {
        let Some(command) = command else {
            return false;
        };
        self.latched &= command.wants_torque;
        let holding = command.mode == Some(GravityHold) && command.wants_torque;
        let stopped = self.modes == [Mode::Stopped; N] && !self.enabled;
        let may = allowed && holding && stopped && !self.latched;
        self.enabled |= may;
        may
    }

    fn send_torques(
        &mut self,
        torque_nm: &Vector<N>,
        damping_nm_s_per_rad: &Vector<N>,
    ) -> Result<(), LoopError> {
        self.torque_nm = *torque_nm;
        self.damping_nm_s_per_rad = *damping_nm_s_per_rad;
        Ok(())
    }

    fn lower(&mut self, _: LoweringMode, reason: LossReason) -> Result<(), LoopError> {
        self.latched |= reason != LossReason::TorqueNotWanted;
        self.enabled = false;
        Ok(())
    }

    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)?;
        self.port.end_cycle();
        Ok(())
    }

    fn skip(&mut self, _: u64, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)
    }

    fn motors_replied(&self) -> bool {
        self.missing() < N as u32
    }

    fn counters(&self) -> DriveCounters {
        self.port.counters()
    }
}
