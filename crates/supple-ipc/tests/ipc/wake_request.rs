//! Tests that the controller wakes a blocked plant, whenever it publishes the answer.

use crate::support::{answer, state, system};
use core::hint::{black_box, spin_loop};
use core::time::Duration;
use supple_ipc::message::TorqueCommand;
use supple_ipc::{ControllerLink, PlantLink};
use supple_realtime::pause;

/// Timeout that is exceeded only if a wake-up is lost.
const LOST_AFTER: Duration = Duration::from_secs(20);
const CYCLES: u64 = 100_000;

/// Answers arrive shortly before, at and shortly after the time at which the plant blocks.
#[test]
fn no_wakeup_is_lost() {
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
                for i in 0..state.cycle % 500 {
                    black_box(i);
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
            let received = plant.answer(cycle, LOST_AFTER).expect("read");
            assert!(received.answer.is_some());
            assert!(
                !received.timed_out,
                "the plant was not notified in cycle {cycle}"
            );
        }
    });
}
