//! Tests of motor pucks: power states, property ids by firmware, torques.

use crate::support::{E_STOP, Host, IDLE, MODE, MODULE, MS, MT, P, STAT, VERS, ZERO, packed};
use supple_bus::{BusFault, Event};
use supple_emu::puck::Power;
use supple_emu::{ArmEvent, ButtonPress, EmulatorConfig};

fn with_firmware(version: i32) -> Host {
    let mut config = EmulatorConfig {
        zeroed: true,
        ..EmulatorConfig::wam(4)
    };
    for puck in &mut config.pucks {
        puck.version = version;
    }
    Host::new(config)
}

/// Counts per revolution, torque units per N m and poles, at the property ids of firmware 51, 61, 65 and 175.
#[test]
fn ids_depend_on_the_firmware() {
    for (version, counts, units, poles) in [
        (51, 30, 108, 112),
        (61, 65, 83, 87),
        (65, 68, 86, 90),
        (175, 68, 86, 90),
        (200, 68, 86, 90),
    ] {
        let mut host = with_firmware(version);
        assert_eq!(host.value(1, VERS), version);
        assert_eq!(host.value(1, counts), 4096, "{version}");
        assert_eq!(host.value(1, units), 2700, "{version}");
        assert_eq!(host.value(1, poles), 12, "{version}");
    }
}

/// Before version 61, the property id of the position is 26.
#[test]
fn old_firmware_has_another_id_for_the_position() {
    let position = |version, id| {
        let mut host = with_firmware(version);
        host.send(3, &[id]);
        let received = host.receive_frames(MS).into_iter();
        let mut replies = received.filter(|(id, _)| *id == 0x463);
        replies.next().map(|(_, payload)| payload.len())
    };
    assert_eq!(position(51, 26), Some(3));
    assert_eq!(position(51, P), None);
    assert_eq!(position(61, 26), None);
    assert_eq!(position(61, P), Some(3));
}

#[test]
fn the_first_eight_ids_are_always_valid() {
    for version in [51, 61, 119, 175] {
        let mut host = with_firmware(version);
        for property in 0..8 {
            assert!(host.get(2, property).is_some(), "{property} of {version}");
        }
    }
}

/// The monitor answers its own list of properties, but neither group requests nor positions.
#[test]
fn the_monitor_answers_only_its_own_properties() {
    let mut host = Host::new(EmulatorConfig::wam(4));
    assert_eq!(host.get(1, STAT), None, "no power");
    host.press(ButtonPress::Idle);
    assert_eq!(host.value(1, STAT), 0);
    assert_eq!(host.value(1, VERS), 175);
    assert_eq!(host.get(1, P), None);
    host.send(0x404, &[P]);
    assert_eq!(host.receive_frames(MS), []);
}

#[test]
fn waking_takes_the_configured_time() {
    let mut host = Host::new(EmulatorConfig::wam(4));
    host.press(ButtonPress::Idle);
    host.set(1, STAT, 2);
    host.listen(100 * MS);
    assert_eq!(host.get(1, STAT), None, "puck 1 is waking");
    assert_eq!(host.value(2, STAT), 0, "puck 2 is not waking");
    host.listen(695 * MS);
    assert!(matches!(host.arm().pucks()[0].power(), Power::Waking(_)));
    host.listen(10 * MS);
    assert_eq!(host.value(1, STAT), 2);
    assert_eq!(host.get(1, P).map(|reply| reply.len()), Some(3));
}

/// While the transceivers of the pucks reset, a frame of the host makes the host go bus-off for 100 ms.
#[test]
fn sending_while_pucks_wake_makes_the_host_go_bus_off() {
    let mut host = Host::new(EmulatorConfig::wam(4));
    host.press(ButtonPress::Idle);
    host.set(1, STAT, 2);
    host.listen(300 * MS);
    host.send(2, &[STAT]);
    let events = host.listen(150 * MS);
    let faults: Vec<_> = events.iter().map(|(_, event)| *event).collect();
    let off = Event::Fault(BusFault::BusOff);
    assert_eq!(faults, [off, Event::Fault(BusFault::Restarted)]);
    let away_ns = events[1].0 - events[0].0;
    assert!((100 * MS..101 * MS).contains(&away_ns), "{away_ns}");
    let seen = host.arm().arm_events().iter();
    assert!(
        seen.map(|(_, h)| h)
            .any(|h| *h == ArmEvent::HostSentDuringWakeUp)
    );
}

/// The counter has 22 bits and wraps from one end to the other.
#[test]
fn a_counter_wraps_at_22_bits() {
    let mut host = Host::awake();
    for (defined, reply) in [
        (2_097_151, [0x1f, 0xff, 0xff]),
        (2_097_152, [0x20, 0x00, 0x00]),
        (-1, [0x3f, 0xff, 0xff]),
        (-12_345, [0x3f, 0xcf, 0xc7]),
    ] {
        host.set(2, P, defined);
        assert_eq!(host.get(2, P), Some(reply.to_vec()), "{defined}");
    }
}

/// The torque has 2700 units per N m, is at most MT, and is zero in idle.
#[test]
fn torques_are_scaled_limited_and_ignored_in_idle() {
    let torque_nm = |host: &mut Host, torques| {
        host.send(0x401, &packed(torques));
        host.listen(MS);
        let pucks = host.arm().pucks().iter();
        pucks.map(|puck| puck.torque_nm()).collect::<Vec<_>>()
    };
    let mut host = Host::awake();
    assert_eq!(torque_nm(&mut host, [1350, 0, 0, 0]), [0.0; 4]);
    let mut host = Host::active();
    let given = torque_nm(&mut host, [1350, -2700, 0, 27]);
    for (given, expected) in given.iter().zip([0.5, -1.0, 0.0, 0.01]) {
        assert!((given - expected).abs() < 1e-12, "{given}");
    }
    host.set(3, MT, 1000);
    assert_eq!(torque_nm(&mut host, [0, 0, 4000, 0])[2], 1000.0 / 2700.0);
    assert_eq!(torque_nm(&mut host, [0, 0, -4000, 0])[2], -1000.0 / 2700.0);
}

/// The emergency stop switches the power off: the pucks lose their counts and return to the monitor.
#[test]
fn an_emergency_stop_resets_the_pucks() {
    let mut host = Host::active();
    host.press(ButtonPress::EStop);
    host.listen(MS);
    assert_eq!(host.module_mode(), E_STOP);
    assert_eq!(host.get(1, STAT), None);
    host.press(ButtonPress::Idle);
    assert_eq!(host.module_mode(), E_STOP, "the button is latched");
    host.press(ButtonPress::Release);
    host.press(ButtonPress::Idle);
    host.listen(MS);
    assert_eq!(host.module_mode(), IDLE);
    assert_eq!(host.value(1, STAT), 0);
    assert_eq!(host.value(MODULE, ZERO), 0);
}

#[test]
fn the_host_cannot_activate_motors() {
    let mut host = Host::awake();
    host.set(MODULE, MODE, 2);
    assert_eq!(host.module_mode(), IDLE);
}
