//! Tests that start-up refuses motors that do not match, with motor, register, found value, expected value and remedy, and
//! enables no motor.

use super::rig::Rig;
use supple_bus::virtual_time::DirectBus;
use supple_can::drives::damiao::{differing_torque_constants, start_up};
use supple_core::Vector;
use supple_drive::Drives;
use supple_emu::damiao::DamiaoConfig;
use supple_model::Description;

fn refusal(misbehaviour: &str) -> String {
    let description = Description::asset("openarm").unwrap();
    let rig = Rig::<7>::try_new(description, |_| (), None, &[misbehaviour]);
    let error = rig
        .err()
        .unwrap_or_else(|| panic!("{misbehaviour}: accepted"));
    assert_eq!(error.code(), 4, "{misbehaviour}: {error}");
    error.to_string()
}

#[test]
fn motors_that_do_not_match_are_refused_with_register_found_and_expected_value_and_remedy() {
    for (misbehaviour, parts) in [
        // VMAX is 8, but the TOML expects 10.
        (
            "register:motor=3,number=22,value=8",
            &["joint3", "register 22 (VMAX)", "8", "10", "never write"][..],
        ),
        (
            "register:motor=1,number=23,value=28",
            &["register 23 (TMAX)", "28", "54"],
        ),
        ("silent:motor=5", &["joint5", "does not answer", "supply"]),
        ("swapped:motor=2,with=3", &["register 20 (Gr)", "swapped"]),
        ("same-id:motor=2,with=3", &["does not answer"]),
        (
            "no-watchdog:motor=4",
            &["joint4", "register 9 (TIMEOUT)", "400", "without_watchdog"],
        ),
        (
            "enabled:motor=6",
            &["joint6", "already enabled", "other host"],
        ),
        (
            "error:motor=2,code=B",
            &["joint2", "amplifier too hot", "cool"],
        ),
        (
            "classic:motor=2",
            &["joint2", "classic frames, expected FD", "can_br"],
        ),
    ] {
        let error = refusal(misbehaviour);
        for part in parts {
            assert!(error.contains(part), "{misbehaviour}: {part} in: {error}");
        }
    }
}

/// A motor whose first write has no effect is refused instead of being used without a watchdog.
#[test]
fn a_write_that_has_no_effect_is_refused() {
    let error = refusal("first-write-ignored:motor=1");
    assert!(error.contains("after"), "{error}");
}

/// After the loss of its host, a motor reports lost communication; a restarted program accepts the motor.
#[test]
fn a_motor_that_lost_its_last_host_is_accepted() {
    let description = Description::asset("openarm").unwrap();
    let mut rig = Rig::<7>::try_new(description, |_| (), None, &["error:motor=2,code=D"]).unwrap();
    rig.run(10);
    assert_eq!(rig.plant.drives(), Drives::Idle);
}

/// Start positions with an error of a whole turn are unwrapped; a wrong zero position is refused with joint and angle.
#[test]
fn whole_turns_are_unwrapped_and_other_offsets_refused() {
    let home: Vector<7> = Description::asset("openarm").unwrap().home().unwrap();
    for turns in [-1.0, 1.0] {
        let spec = format!("zero:motor=4,offset-rad={}", turns * core::f64::consts::TAU);
        let mut rig = Rig::<7>::new("openarm", &[&spec]);
        rig.run(3);
        let found = rig.plant.link_mut().report.unwrap().position_rad[3].unwrap();
        assert!((found - home[3]).abs() < 1e-3, "{turns}: {found}");
    }
    let error = refusal("zero:motor=4,offset-rad=2.0");
    assert!(
        error.contains("joint4") && error.contains("outside"),
        "{error}"
    );
}

#[test]
fn fd_motors_on_a_bus_of_classic_frames_are_refused_before_a_frame_is_sent() {
    use supple_bus::virtual_time::DirectBus;
    use supple_bus::{Bus, BusError, Event};
    use supple_can_frame::CanFrame;
    struct Classic(DirectBus<supple_emu::damiao::DamiaoArm<7>>);
    impl Bus for Classic {
        fn now_ns(&self) -> u64 {
            self.0.now_ns()
        }
        fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
            panic!("sent {frame:?}");
        }
        fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
            self.0.receive_until(until_ns)
        }
        fn carries_fd(&self) -> bool {
            false
        }
    }
    let description = Description::asset("openarm").unwrap();
    let arm = super::rig::arm(&description, |_| (), None, &[]);
    let mut bus = Classic(DirectBus(arm));
    let found = supple_can::drives::damiao::start_up::<7, _>(&mut bus, &description, &|| false);
    let error = found.unwrap_err().to_string();
    assert!(
        error.contains("classic frames only") && error.contains("fd on"),
        "{error}"
    );
}

/// Expected: the emulated motors of one model state the same constant; 0.945 N m/A for a 4310 (14 pole pairs, 4.5 mWb, ratio 10),
/// as its data sheet. A motor with a tenth more flux is named.
#[test]
fn motors_whose_torque_constants_differ_are_named() {
    for (flux_factor, expected) in [(1.0, vec![]), (1.04, vec![]), (1.1, vec![(6, 4)])] {
        let description = Description::asset("openarm").unwrap();
        let change = |config: &mut DamiaoConfig| config.motors[6].flux_wb *= flux_factor;
        let arm = super::rig::arm::<7>(&description, change, None, &[]);
        let mut bus = DirectBus(arm);
        let motors = start_up::<7, _>(&mut bus, &description, &|| false).unwrap();
        assert!((motors[4].torque_registers.torque_constant_nm_per_a() - 0.945).abs() < 1e-3);
        let found = differing_torque_constants(&motors, description.bus().unwrap());
        assert_eq!(found, expected, "{flux_factor}");
    }
}
