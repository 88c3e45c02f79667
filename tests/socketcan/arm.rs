//! The emulated arm in a thread of its own, on its own socket, as the program `supple-emu` runs it.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use supple_bus::{Bus, BusFault, SocketCan};
use supple_core::Vector;
use supple_emu::{ArmsEnd, Emulator, EmulatorConfig, Press, catch_up, listen};
use supple_model::Description;
use supple_plant::PlantConfig;
use supple_puck::status::MotorMode;

enum Order {
    Press(Press),
    Fault(BusFault),
    Look(Sender<Look>),
    End,
}

struct Look {
    modes: Vec<MotorMode>,
    position_rad: Vector<4>,
}

pub struct Arm {
    orders: Sender<Order>,
    thread: Option<JoinHandle<()>>,
}

impl Arm {
    /// It is there when this returns.
    pub fn start(interface: &str) -> Arm {
        let (orders, received) = channel();
        let interface = interface.to_owned();
        let arm = Arm {
            orders,
            thread: Some(std::thread::spawn(move || emulate(&interface, &received))),
        };
        assert!(arm.motors_in(MotorMode::Idle));
        arm
    }

    pub fn press(&self, press: Press) {
        self.order(Order::Press(press));
    }

    /// The host's interface reports this.
    pub fn fault(&self, fault: BusFault) {
        self.order(Order::Fault(fault));
    }

    pub fn motors_in(&self, mode: MotorMode) -> bool {
        self.look().modes.iter().all(|m| *m == mode)
    }

    pub fn position_rad(&self) -> Vector<4> {
        self.look().position_rad
    }

    fn order(&self, order: Order) {
        self.orders.send(order).expect("the arm is there");
    }

    fn look(&self) -> Look {
        let (sender, look) = channel();
        self.order(Order::Look(sender));
        look.recv().expect("the arm answers")
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        // One that has failed already says so in its own panic.
        let _ = self.orders.send(Order::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn emulate(interface: &str, orders: &Receiver<Order>) {
    let description = Description::asset("wam4").unwrap();
    let plant = PlantConfig::<4>::from_description(&description).unwrap();
    let home_rad = description.home::<4>().unwrap();
    crate::realtime(crate::ARM_PRIORITY);
    let mut bus = SocketCan::open(interface).unwrap();
    let mut emulator =
        Emulator::new(EmulatorConfig::wam(4), plant, home_rad, bus.now_ns()).unwrap();
    loop {
        catch_up(&mut emulator, &mut bus).unwrap();
        listen(&mut emulator, &mut bus).unwrap();
        match orders.try_recv() {
            Ok(Order::Press(press)) => emulator.press(press),
            Ok(Order::Fault(fault)) => bus.fault(fault).unwrap(),
            Ok(Order::Look(answer)) => {
                let look = Look {
                    modes: emulator.pucks().iter().map(|puck| puck.mode()).collect(),
                    position_rad: emulator.truth().position_rad,
                };
                answer.send(look).unwrap();
            }
            Ok(Order::End) => return,
            Err(_) => {}
        }
    }
}
