//! The plant is rung where it sleeps, whenever the answer comes.

mod support;

use core::hint::{black_box, spin_loop};
use core::time::Duration;
use std::time::Instant;
use supple_ipc::message::TorqueCommand;
use supple_ipc::{ControllerLink, PlantLink, pause};
use support::{answer, state, system};

/// No answer takes so long but one whose ring was lost.
const LOST_AFTER: Duration = Duration::from_secs(20);
const CYCLES: u64 = 100_000;

/// Answers come just before, while and after the plant goes to sleep.
#[test]
fn no_ring_is_lost_whenever_the_answer_comes() {
    let system = system("asleep");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let domain = &system.domain;
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let controller = ControllerLink::new(domain).expect("a controller");
            let output = answer(&state(0).input(None).expect("four joints"));
            while let Some(state) = controller.wait(LOST_AFTER).expect("read") {
                let mut command = TorqueCommand::new(&output, false);
                command.cycle = state.cycle;
                for turn in 0..state.cycle % 500 {
                    black_box(turn);
                    spin_loop();
                }
                controller.answer(&command).expect("answered");
                if state.cycle == CYCLES {
                    break;
                }
            }
        });
        let mut state = state(0);
        while !plant.publish(&state).expect("published") {
            pause(Duration::from_millis(1));
        }
        for cycle in 1..=CYCLES {
            state.cycle = cycle;
            plant.publish(&state).expect("published");
            let asked = Instant::now();
            let heard = plant.answer(cycle, LOST_AFTER).expect("read");
            assert!(heard.answer.is_some());
            assert!(asked.elapsed() < LOST_AFTER, "cycle {cycle} was not rung");
        }
    });
}
