//! The emulated arm in its own thread, on its own socket, as in the program `supple-emu`.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use supple_bus::{Bus, BusFault, SocketCan};
use supple_core::Vector;
use supple_emu::{
    ArmBus, ButtonPress, Emulator, EmulatorConfig, advance_to_bus_time, receive_host_frame,
};
use supple_model::Description;
use supple_plant::PlantConfig;
use supple_puck::status::MotorMode;

enum ArmCommand {
    Press(ButtonPress),
    Fault(BusFault),
    Snapshot(Sender<ArmSnapshot>),
    End,
}

struct ArmSnapshot {
    modes: Vec<MotorMode>,
    position_rad: Vector<4>,
}

pub struct Arm {
    commands: Sender<ArmCommand>,
    thread: Option<JoinHandle<()>>,
}

impl Arm {
    /// Returns when the arm is running.
    pub fn start(interface: &str) -> Arm {
        let (commands, received) = channel();
        let interface = interface.to_owned();
        let arm = Arm {
            commands,
            thread: Some(std::thread::spawn(move || emulate(&interface, &received))),
        };
        assert!(arm.motors_in(MotorMode::Idle));
        arm
    }

    pub fn press(&self, press: ButtonPress) {
        self.send_command(ArmCommand::Press(press));
    }

    /// Makes the host's interface report a fault.
    pub fn fault(&self, fault: BusFault) {
        self.send_command(ArmCommand::Fault(fault));
    }

    pub fn motors_in(&self, mode: MotorMode) -> bool {
        self.snapshot().modes.iter().all(|m| *m == mode)
    }

    pub fn position_rad(&self) -> Vector<4> {
        self.snapshot().position_rad
    }

    fn send_command(&self, command: ArmCommand) {
        self.commands.send(command).expect("the arm runs");
    }

    fn snapshot(&self) -> ArmSnapshot {
        let (sender, snapshot) = channel();
        self.send_command(ArmCommand::Snapshot(sender));
        snapshot.recv().expect("the arm answers")
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        // An arm thread that has failed has already reported its panic.
        let _ = self.commands.send(ArmCommand::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn emulate(interface: &str, commands: &Receiver<ArmCommand>) {
    let description = Description::asset("wam4").unwrap();
    let plant = PlantConfig::<4>::from_description(&description).unwrap();
    let home_rad = description.home::<4>().unwrap();
    crate::realtime::realtime(crate::realtime::ARM_PRIORITY);
    let mut bus = SocketCan::open(interface).unwrap();
    let mut emulator =
        Emulator::new(EmulatorConfig::wam(4), plant, home_rad, bus.now_ns()).unwrap();
    loop {
        advance_to_bus_time(&mut emulator, &mut bus).unwrap();
        receive_host_frame(&mut emulator, &mut bus).unwrap();
        match commands.try_recv() {
            Ok(ArmCommand::Press(press)) => emulator.press(press),
            Ok(ArmCommand::Fault(fault)) => bus.fault(fault).unwrap(),
            Ok(ArmCommand::Snapshot(answer)) => {
                let snapshot = ArmSnapshot {
                    modes: emulator.pucks().iter().map(|puck| puck.mode()).collect(),
                    position_rad: emulator.truth().position_rad,
                };
                answer.send(snapshot).unwrap();
            }
            Ok(ArmCommand::End) => return,
            Err(_) => {}
        }
    }
}
