//! Tests of start-up from power-on to normal operation, and of the rejection of arms that differ from the description.

use crate::rig::{self, MS, emulator, startup_config, try_start};
use supple_bus::Bus;
use supple_can::{CanError, Progress, StartupConfig, start_up};
use supple_core::Vector;
use supple_emu::puck::Power;
use supple_emu::{ArmEvent, ButtonPress, EmulatorConfig};
use supple_puck::safety::SafetyMode;
use supple_puck::status::{MotorMode, Role};
use supple_puck::{Property, PropertyTable};

fn home<const N: usize>() -> Vector<N> {
    rig::description(N).home::<N>().unwrap()
}

/// Creates an arm in its home pose whose operator has pressed Shift-Idle.
fn idle_arm<const N: usize>(config: EmulatorConfig) -> rig::TestBus<N> {
    let mut emulator = emulator(config, home::<N>());
    emulator.press(ButtonPress::Idle);
    rig::bus(emulator)
}

fn startup_error(config: EmulatorConfig) -> String {
    try_start(&mut idle_arm::<4>(config), &startup_config())
        .unwrap_err()
        .to_string()
}

fn starts<const N: usize>() {
    let mut bus = idle_arm::<N>(EmulatorConfig::wam(N));
    let ready = try_start(&mut bus, &startup_config()).unwrap();
    assert!(ready.sensor);
    let emulator = &bus.inner().0;
    assert!(emulator.pucks().iter().all(|p| p.power() == Power::Ready));
    assert_eq!(emulator.safety().mode(), SafetyMode::Idle);
    // The counts match the home pose after the arm has sagged slightly.
    let counts = ready.transmission.counts(&emulator.truth().position_rad);
    for (puck, counts) in emulator.pucks().iter().zip(counts.unwrap()) {
        assert!(
            (puck.counts() - counts.get()).abs() < 40,
            "{}",
            puck.counts()
        );
    }
    for (_, arm_event) in emulator.arm_events() {
        assert!(
            !matches!(
                arm_event,
                ArmEvent::HostSentDuringWakeUp | ArmEvent::Motor(_, MotorMode::Torque)
            ),
            "{arm_event:?}"
        );
    }
}

#[test]
fn four_pucks_start() {
    starts::<4>();
}

#[test]
fn seven_pucks_start() {
    starts::<7>();
}

/// Old and new firmware have position, pole count and slot at different ids.
#[test]
fn every_firmware_list_is_supported() {
    for version in [61, 64, 65, 68, 114, 132, 175, 200] {
        let mut config = EmulatorConfig::wam(4);
        for puck in &mut config.pucks {
            puck.version = version;
        }
        let table = PropertyTable::of_firmware(supple_puck::PuckKind::Motor, version).unwrap();
        let ready = try_start(&mut idle_arm::<4>(config), &startup_config()).unwrap();
        assert_eq!(Some(ready.pucks[0].position), table.id(Property::P));
        assert_eq!(ready.pucks[3].version, version);
    }
}

#[test]
fn start_up_waits_for_the_operator() {
    let mut emulator = emulator(EmulatorConfig::wam(4), home::<4>());
    emulator.press_at(700 * MS, ButtonPress::Idle);
    let mut bus = rig::bus(emulator);
    let mut reported = Vec::new();
    let progress = &mut |progress| reported.push(progress);
    start_up(
        &mut bus,
        &rig::description(4),
        &startup_config::<4>(),
        &|| false,
        progress,
    )
    .unwrap();
    assert_eq!(
        reported,
        [
            Progress::WaitingForIdle,
            Progress::Enumerating,
            Progress::Waking(4),
            Progress::Checking,
            Progress::Zeroing,
            Progress::Ready
        ]
    );
}

#[test]
fn start_up_can_be_stopped_while_it_waits() {
    let mut bus = rig::bus(emulator(EmulatorConfig::wam(4), home::<4>()));
    let ended = start_up(
        &mut bus,
        &rig::description(4),
        &startup_config::<4>(),
        &|| true,
        &mut |_| (),
    );
    assert!(matches!(ended, Err(CanError::Stopped)), "{ended:?}");
}

/// For a restarted host, the arm is awake, has its position reference and is active; the host first switches it to idle.
#[test]
fn a_second_start_accepts_an_arm_that_is_awake_and_has_its_position_reference() {
    let mut config = EmulatorConfig::wam(4);
    config.zeroed = true;
    let mut emulator = emulator(config, home::<4>());
    emulator.press(ButtonPress::Activate);
    let mut bus = rig::bus(emulator);
    let startup_config = StartupConfig {
        zero_at_rad: None,
        confirmation: None,
        ..startup_config::<4>()
    };
    let begun_ns = bus.now_ns();
    try_start(&mut bus, &startup_config).unwrap();
    assert_eq!(bus.inner().0.safety().mode(), SafetyMode::Idle);
    // All pucks are awake, so start-up does not wait.
    assert!(bus.now_ns() - begun_ns < 1000 * MS);
}

#[test]
fn an_arm_without_position_reference_is_rejected() {
    let startup_config = StartupConfig {
        zero_at_rad: None,
        confirmation: None,
        ..startup_config::<4>()
    };
    let error = try_start(&mut idle_arm::<4>(EmulatorConfig::wam(4)), &startup_config);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("ZERO is 0"), "{error}");
    assert!(error.contains("--zero-at-home"), "{error}");
    assert!(error.contains("-1.8"), "{error}");
}

#[test]
fn a_missing_puck_is_named() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[2].present = false;
    let error = startup_error(config);
    assert!(
        error.contains("a motor puck (node 3) does not answer"),
        "{error}"
    );
}

#[test]
fn a_missing_safety_module_is_named() {
    let mut config = EmulatorConfig::wam(4);
    config.safety.present = false;
    let error = startup_error(config);
    assert!(error.contains("the safety module (node 10)"), "{error}");
}

#[test]
fn a_wrong_role_is_rejected() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[1].role = Role(0x0105);
    let error = startup_error(config);
    assert!(error.contains("node 2 has role 0x0105"), "{error}");
}

#[test]
fn mixed_firmware_is_rejected() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[3].version = 60;
    let error = startup_error(config);
    assert!(
        error.contains("node 4 has the torque under property id"),
        "{error}"
    );
}

#[test]
fn other_torque_units_are_rejected() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[0].units_per_nm = 2562;
    let error = startup_error(config);
    assert!(error.contains("IPNM of motor puck 1 is 2562"), "{error}");
    assert!(error.contains("torque_quantum_nm"), "{error}");
}

#[test]
fn another_encoder_is_rejected() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[0].counts_per_revolution = 40960;
    let error = startup_error(config);
    assert!(error.contains("CTS of motor puck 1 is 40960"), "{error}");
}

#[test]
fn a_hot_puck_is_rejected() {
    let mut config = EmulatorConfig::wam(4);
    config.pucks[1].temperature = 61;
    let error = startup_error(config);
    assert!(error.contains("motor puck 2 is at 61 degrees"), "{error}");
}

#[test]
fn an_arm_with_more_pucks_is_rejected() {
    let mut bus = idle_arm::<7>(EmulatorConfig::wam(7));
    let error = start_up(
        &mut bus,
        &rig::description(4),
        &startup_config::<4>(),
        &|| false,
        &mut |_| (),
    );
    let error = error.unwrap_err().to_string();
    assert!(error.contains("motor puck 5 answers"), "{error}");
}

/// Groups of the 2008 manual and unused slots are corrected, and the torque limit is set to the value of the description.
#[test]
fn settings_that_differ_are_corrected() {
    let mut config = EmulatorConfig::wam(7);
    for puck in &mut config.pucks {
        puck.groups = [0, 0, 5];
        puck.slot = 4;
        puck.max_torque = 8000;
    }
    let mut bus = idle_arm::<7>(config);
    try_start(&mut bus, &startup_config()).unwrap();
    let ready_again = try_start(&mut bus, &startup_config());
    assert!(ready_again.is_ok(), "{ready_again:?}");
}
