//! A host that uses the codec but not the drive: sends requests, enables motors and commands torques.

use supple_bus::virtual_time::DirectBus;
use supple_bus::{Bus, Event};
use supple_can_frame::FrameFormat;
use supple_core::{Arm, Vector, dynamics};
use supple_damiao::inspection::{Expectation, InspectedMotor, RegisterReadings, TO_READ};
use supple_damiao::register::{self, Operation};
use supple_damiao::{
    Feedback, Frame, MitCommand, Problem, Ranges, Refusal, Register, RegisterReply, SpecialCommand,
    TorqueShaper, Value,
};
use supple_emu::damiao::{DamiaoArm, DamiaoConfig};
use supple_model::{BusDescription, BusFormat, BusMotor, Description};
use supple_plant::{PlantConfig, PlantOptions};

pub const MS: u64 = 1_000_000;

/// A host with its emulated arm.
pub struct Host<const N: usize> {
    pub bus: DirectBus<DamiaoArm<N>>,
    pub description: Description,
    pub arm: Arm<N>,
    pub ranges: Vec<Ranges>,
    /// Last feedback of each motor.
    pub feedback: [Option<Feedback>; N],
    pub answers: [u32; N],
    shapers: [TorqueShaper; N],
    format: FrameFormat,
}

/// Creates a host with an arm that starts at `start_rad`, or in its home pose.
pub fn host<const N: usize>(
    name: &str,
    change: impl FnOnce(&mut DamiaoConfig),
    start_rad: Option<Vector<N>>,
) -> Host<N> {
    host_with_options(name, change, start_rad, &PlantOptions::default())
}

pub fn host_with_options<const N: usize>(
    name: &str,
    change: impl FnOnce(&mut DamiaoConfig),
    start_rad: Option<Vector<N>>,
    options: &PlantOptions,
) -> Host<N> {
    let description = Description::asset(name).unwrap();
    let bus = description.bus().unwrap().clone();
    let mut config = DamiaoConfig::expected(&bus);
    change(&mut config);
    let plant = options.apply(PlantConfig::<N>::from_description(&description).unwrap());
    let start_rad = start_rad.unwrap_or(description.home::<N>().unwrap());
    let stow_rad = Vector::from_column_slice(description.stow_rad().unwrap());
    let zone_rad = description.settings().limits.soft_zone_rad;
    let emulated = DamiaoArm::new(
        config,
        plant.unwrap(),
        start_rad,
        Some((stow_rad, zone_rad)),
        0,
    );
    let motors = bus.motors.iter();
    let ranges = motors.map(|motor| {
        Ranges::new(
            motor.position_range_rad,
            motor.velocity_range_rad_per_s,
            motor.torque_range_nm,
        )
        .unwrap()
    });
    Host {
        ranges: ranges.collect(),
        arm: description.arm::<N>().unwrap(),
        bus: DirectBus(emulated.unwrap()),
        feedback: [None; N],
        answers: [0; N],
        shapers: [TorqueShaper::new(); N],
        format: match bus.format {
            BusFormat::Classic => FrameFormat::Classic,
            BusFormat::Fd => FrameFormat::Fd {
                bit_rate_switch: true,
            },
        },
        description,
    }
}

impl<const N: usize> Host<N> {
    pub fn emulated(&self) -> &DamiaoArm<N> {
        &self.bus.0
    }

    pub fn described(&self) -> &BusDescription {
        self.description.bus().unwrap()
    }

    pub fn motor(&self, index: usize) -> &BusMotor {
        &self.described().motors[index]
    }

    pub fn expectation(&self, index: usize) -> Expectation<'_> {
        let motor = self.motor(index);
        Expectation {
            id: motor.id as u8,
            reply_id: motor.reply_id,
            gear_ratio: motor.gear_ratio,
            position_range_rad: motor.position_range_rad,
            velocity_range_rad_per_s: motor.velocity_range_rad_per_s,
            torque_range_nm: motor.torque_range_nm,
            firmware_series: motor.firmware_series.as_deref(),
            watchdog_s: self.described().watchdog_s,
            without_watchdog: motor.without_watchdog,
            fd: self.described().format == BusFormat::Fd,
        }
    }

    pub fn send(&mut self, frame: Frame) {
        self.bus.send(&frame.on_bus(self.format)).unwrap();
    }

    /// Receives all frames of motors until `until_ns`; ignores faults.
    pub fn receive(&mut self, until_ns: u64) -> Vec<Frame> {
        let mut frames = Vec::new();
        while let Some(event) = self.bus.receive_until(until_ns).unwrap() {
            if let Event::Frame(frame) = event {
                frames.push(Frame::of_bus(&frame).unwrap());
            }
        }
        frames
    }

    /// Sends a frame and returns the frames that arrive within 3 ms.
    pub fn exchange(&mut self, frame: Frame) -> Vec<Frame> {
        self.send(frame);
        let until_ns = self.bus.now_ns() + 3 * MS;
        self.receive(until_ns)
    }

    /// Reads a register of a motor by its id.
    pub fn read(&mut self, id: u8, register: Register) -> Option<[u8; 4]> {
        let answers = self.exchange(register::read(id, register));
        let mut replies = answers
            .iter()
            .filter_map(|frame| RegisterReply::parse(frame, id, Operation::Read, register));
        replies.next().map(|reply| reply.bytes)
    }

    /// Runs the start-up of one motor: checks identity and registers, sets mode and watchdog.
    pub fn inspect(&mut self, index: usize) -> Result<InspectedMotor, Refusal> {
        let (id, reply_id) = (self.motor(index).id as u8, self.motor(index).reply_id);
        let refuse = |problem| Refusal { motor: id, problem };
        let answers = self.exchange(register::request_feedback(id));
        let feedback = match answers.as_slice() {
            [] => return Err(refuse(Problem::Silent)),
            [one] => Feedback::parse(one).unwrap(),
            _ => return Err(refuse(Problem::TwoAnswers)),
        };
        if answers[0].id() != reply_id {
            let found = answers[0].id();
            return Err(refuse(Problem::ReplyIdMismatch {
                found,
                expected: reply_id,
            }));
        }
        match feedback.status {
            supple_damiao::Status::Disabled => {}
            supple_damiao::Status::Enabled => return Err(refuse(Problem::AlreadyEnabled)),
            status => return Err(refuse(Problem::MotorError(status))),
        }
        let mut readings = RegisterReadings::new();
        for register in TO_READ {
            if let Some(bytes) = self.read(id, register) {
                readings.insert(register, bytes);
            }
        }
        let position_rad = feedback.position_rad(&self.ranges[index]);
        let expectation = self.expectation(index);
        let inspected = expectation.check(&readings, Some(position_rad))?;
        for (register, value) in [
            (Register::MODE, inspected.write_mode.then_some(1)),
            (Register::TIMEOUT, inspected.write_timeout),
        ] {
            let Some(value) = value else { continue };
            // Some motors ignore the first write.
            for _ in 0..2 {
                self.exchange(register::write(id, register, Value::Integer(value)).unwrap());
            }
            let found = self.read(id, register).map_or(0, u32::from_le_bytes);
            self.expectation(index)
                .check_written(register, value, found)?;
        }
        Ok(inspected)
    }

    /// Joint angles of the last feedback \[rad\].
    pub fn joints_rad(&self) -> Vector<N> {
        Vector::from_fn(|i, _| {
            let feedback = self.feedback[i].expect("a feedback");
            let motor = self.motor(i);
            motor.direction * feedback.position_rad(&self.ranges[i]) + motor.zero_offset_rad
        })
    }

    /// Runs one cycle: sends all torques and receives the replies, for at most `period_ns`.
    pub fn cycle(&mut self, torque_nm: &Vector<N>, damping: f64, period_ns: u64) {
        let until_ns = self.bus.now_ns() + period_ns;
        for i in 0..N {
            let (id, direction) = (self.motor(i).id as u8, self.motor(i).direction);
            let ranges = self.ranges[i];
            let command = MitCommand {
                kd_nm_s_per_rad: damping,
                ..MitCommand::ZERO
            };
            let mut codes = command.codes(&ranges).unwrap();
            codes.torque = self.shapers[i]
                .encode(direction * torque_nm[i], &ranges)
                .unwrap();
            self.send(codes.emit(id));
        }
        self.answers = [0; N];
        for frame in self.receive(until_ns) {
            let index = self
                .described()
                .motors
                .iter()
                .position(|m| m.reply_id == frame.id());
            if let Some(index) = index {
                self.answers[index] += 1;
                self.feedback[index] = Feedback::parse(&frame).ok();
            }
        }
    }

    /// Inspects all motors, then enables them with gravity torque from the first frame on.
    pub fn start(&mut self) -> Result<(), Refusal> {
        for index in 0..N {
            self.inspect(index)?;
        }
        // The first command is sent before the motor is enabled, so that the torque acts as soon as it is enabled.
        self.cycle(&Vector::zeros(), 0.0, 3 * MS);
        let gravity_nm = dynamics::gravity(&self.arm, &self.joints_rad());
        self.cycle(&gravity_nm, 0.0, 3 * MS);
        for index in 0..N {
            let id = self.motor(index).id as u8;
            self.send(SpecialCommand::Enable.emit(id));
        }
        let until_ns = self.bus.now_ns() + MS;
        self.receive(until_ns);
        Ok(())
    }

    /// Holds the arm with gravity torque for `cycles`.
    pub fn hold(&mut self, cycles: u32, period_ns: u64) {
        for _ in 0..cycles {
            let gravity_nm = dynamics::gravity(&self.arm, &self.joints_rad());
            self.cycle(&gravity_nm, 0.0, period_ns);
        }
    }
}
