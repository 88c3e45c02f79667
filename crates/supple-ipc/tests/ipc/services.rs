//! Tests of the services: each has one writer, systems with different prefixes are separate, readers count lost messages,
//! processes of another version are refused, and only the owner has access.

use crate::support::{answer, state, system};
use core::time::Duration;
use iceoryx2::prelude::*;
use std::os::unix::fs::MetadataExt;
use std::path::Path as StdPath;
use supple_core::codes::request_kind;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::*;
use supple_ipc::*;
use supple_realtime::pause;

const TIMEOUT: Duration = Duration::from_secs(5);

#[test]
fn a_state_is_answered_in_its_cycle() {
    let system = system("cycle");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    for cycle in 0..3 {
        assert!(plant.publish(&state(cycle)).expect("published"));
        let received = controller.wait(TIMEOUT).expect("read").expect("a state");
        assert_eq!(received, state(cycle));
        let output = answer(&received.input(None).expect("four joints"));
        let command = TorqueCommand::new(&output, false);
        controller.answer(&command).expect("answered");
        let received = plant.answer(cycle, TIMEOUT).expect("read");
        assert_eq!(received.answer, Some(command));
        assert_eq!(received.late, 0);
    }
}

#[test]
fn an_announcement_wakes_the_controller_before_the_state() {
    let system = system("announced");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    for cycle in 0..200 {
        if cycle % 2 == 0 {
            plant.announce().expect("announced");
            assert_eq!(
                controller.wait_for_event(TIMEOUT).expect("read"),
                WakeEvent::Announced
            );
        }
        plant.publish(&state(cycle)).expect("published");
        if cycle % 5 == 0 {
            // The controller reads the state before it consumes the wake-up of the state.
            let received = controller.receive().expect("read");
            assert_eq!(received, Some(state(cycle)));
        } else {
            let woken = controller.wait_for_event(TIMEOUT).expect("read");
            assert_eq!(woken, WakeEvent::State(state(cycle)));
        }
        assert_eq!(controller.receive().expect("read"), None);
        let mut command = TorqueCommand::new(&answer(&state(0).input(None).expect("four")), false);
        command.cycle = cycle;
        controller.answer(&command).expect("answered");
        let received = plant.answer(cycle, TIMEOUT).expect("read");
        assert_eq!(received.answer.map(|command| command.cycle), Some(cycle));
    }
    let short_timeout = Duration::from_millis(1);
    assert_eq!(
        controller.wait_for_event(short_timeout).expect("read"),
        WakeEvent::Timeout
    );
    // `wait` does not return on an announcement.
    plant.announce().expect("announced");
    assert_eq!(controller.wait(short_timeout).expect("read"), None);
}

#[test]
fn an_answer_to_another_cycle_is_late_and_not_used() {
    let system = system("late");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    plant.publish(&state(1)).expect("published");
    let received = controller.wait(TIMEOUT).expect("read").expect("a state");
    let output = answer(&received.input(None).expect("four joints"));
    controller
        .answer(&TorqueCommand::new(&output, false))
        .expect("answered");
    let received = plant.answer(2, Duration::from_millis(1)).expect("read");
    assert_eq!((received.answer, received.late), (None, 1));
}

#[test]
fn wait_without_a_peer_times_out() {
    let system = system("alone");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    assert!(!plant.publish(&state(0)).expect("published"));
    let received = plant.answer(0, Duration::from_millis(2)).expect("read");
    let expected = ReceivedAnswer {
        timed_out: true,
        ..ReceivedAnswer::default()
    };
    assert_eq!(received, expected);
}

#[test]
fn late_controller_receives_every_state() {
    let system = system("lag");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    for cycle in 0..30 {
        plant.publish(&state(cycle)).expect("published");
    }
    for cycle in 0..30 {
        assert_eq!(controller.receive().expect("read"), Some(state(cycle)));
    }
    assert_eq!(controller.receive().expect("read"), None);
}

/// Several processes join and leave concurrently, and create and remove the same services.
#[test]
fn join_succeeds_during_concurrent_joins_and_leaves() {
    let system = system("flux");
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                for _ in 0..20 {
                    TelemetryReader::new(&system.domain).expect("a reader");
                }
            });
        }
        scope.spawn(|| {
            for _ in 0..20 {
                ControllerLink::new(&system.domain).expect("the only controller");
            }
        });
    });
}

/// A plant that polls before it blocks receives the same answers, and a wake-up for an earlier answer does not end its
/// wait.
#[test]
fn polling_plant_gets_its_answers_and_blocks_without_one() {
    let system = system("spin");
    let mut plant = PlantLink::new(&system.domain).expect("a plant");
    plant.set_spin_duration(Duration::from_millis(1));
    let domain = &system.domain;
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let controller = ControllerLink::new(domain).expect("a controller");
            while let Some(state) = controller.wait(TIMEOUT).expect("read") {
                let output = answer(&state.input(None).expect("four joints"));
                let mut command = TorqueCommand::new(&output, false);
                command.cycle = state.cycle;
                if state.cycle < 50 {
                    controller.answer(&command).expect("answered");
                } else {
                    break;
                }
            }
        });
        while !plant.publish(&state(0)).expect("published") {
            pause(Duration::from_millis(1));
        }
        for cycle in 0..50 {
            plant.publish(&state(cycle)).expect("published");
            let received = plant.answer(cycle, TIMEOUT).expect("read");
            assert_eq!(received.answer.map(|command| command.cycle), Some(cycle));
        }
        plant.publish(&state(50)).expect("published");
        let received = plant.answer(50, Duration::from_millis(5)).expect("read");
        assert_eq!(received.answer, None);
    });
}

#[test]
fn second_writer_is_refused_with_the_reason() {
    let system = system("second");
    let _plant = PlantLink::new(&system.domain).expect("a plant");
    let _controller = ControllerLink::new(&system.domain).expect("a controller");
    let _server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let refused = [
        PlantLink::new(&system.domain).expect_err("a writer exists"),
        ControllerLink::new(&system.domain).expect_err("a writer exists"),
        OperatorServer::new(&system.domain, Backpressure::Drop).expect_err("a writer exists"),
    ];
    for error in refused {
        assert!(matches!(error, IpcError::SecondWriter { .. }), "{error}");
        assert!(
            error.to_string().contains(system.domain.prefix()),
            "{error}"
        );
    }
}

#[test]
fn systems_with_another_prefix_or_folder_are_separate() {
    let (one, two) = (system("one"), system("two"));
    let plant = PlantLink::new(&one.domain).expect("a plant");
    let same_folder = Domain::in_folder(one.domain.folder(), "other").expect("a domain");
    let same_prefix = Domain::in_folder(two.domain.folder(), one.domain.prefix());
    let same_prefix = same_prefix.expect("a domain");
    for other in [&two.domain, &same_folder, &same_prefix] {
        let controller = ControllerLink::new(other).expect("a controller");
        assert!(!plant.publish(&state(0)).expect("published"));
        assert_eq!(controller.receive().expect("read"), None);
    }
}

#[test]
fn telemetry_counts_what_a_slow_reader_loses() {
    let system = system("slow");
    let mut reader = TelemetryReader::new(&system.domain).expect("a reader");
    let server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let input = state(0).input::<4>(None).expect("four joints");
    let output = answer(&input);
    let publish = |step: u64| {
        let telemetry = Telemetry::new(step, &state(step), &input, &output, CycleTiming::default());
        server.publish(&telemetry).expect("published");
    };
    let depth = TELEMETRY_DEPTH as u64;
    (0..depth + 10).for_each(publish);
    for step in 0..depth {
        let telemetry = reader.receive().expect("read").expect("a message arrived");
        assert_eq!(telemetry.step(), step);
    }
    assert_eq!((reader.receive().expect("read"), reader.lost()), (None, 0));
    publish(depth + 10);
    let next = reader.receive().expect("read").expect("a message arrived");
    assert_eq!((next.step(), reader.lost()), (depth + 10, 10));
}

#[test]
fn operators_receive_only_replies_to_their_own_requests() {
    let system = system("operators");
    let server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let mut one = OperatorClient::new(&system.domain).expect("an operator");
    let mut two = OperatorClient::new(&system.domain).expect("an operator");
    let first = one.send::<4>(&Request::GravityHold, None).expect("sent");
    let second = two.send::<4>(&Request::Reset, Some(100)).expect("sent");
    let mut seen = Vec::new();
    while let Some(request) = server.request().expect("read") {
        seen.push((
            request.request::<4>(),
            request.has_at_cycle,
            request.at_cycle,
        ));
        let (outcome, text) = match request.kind {
            request_kind::GRAVITY_HOLD => (Outcome::Accepted, Text::EMPTY),
            _ => (Outcome::Refused, Text::of(&"no")),
        };
        let reply = OperatorReply::new(&request, 7, Mode::GravityHold, outcome, text);
        server.reply(&reply).expect("replied");
    }
    let expected = [
        (Ok(Some(Request::GravityHold)), 0, 0),
        (Ok(Some(Request::Reset)), 1, 100),
    ];
    assert_eq!(seen, expected);
    let reply = |operator: &OperatorClient, sequence: Option<u64>| {
        let reply = operator.receive().expect("read").expect("a reply");
        assert_eq!(Some(reply.sequence), sequence);
        assert_eq!(operator.receive().expect("read"), None);
        reply
    };
    let accepted = reply(&one, first);
    assert_eq!(accepted.outcome(), Outcome::Accepted);
    assert_eq!(
        (accepted.cycle, accepted.mode()),
        (7, Some(Mode::GravityHold))
    );
    let refused = reply(&two, second);
    assert_eq!(
        (refused.outcome(), refused.text.as_str()),
        (Outcome::Refused, "no")
    );
}

#[test]
fn request_without_a_controller_is_not_sent() {
    let system = system("nobody");
    let mut operator = OperatorClient::new(&system.domain).expect("an operator");
    let sent = operator.send::<4>(&Request::Idle, None).expect("sent");
    assert_eq!(sent, None);
}

/// A message type with the same name and another version.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.ArmState.v9")]
struct OtherVersion {
    cycle: u64,
}

#[test]
fn a_peer_of_another_version_is_refused() {
    let system = system("version");
    let mut config = Config::default();
    let root = Path::new(system.folder.as_os_str().as_encoded_bytes()).expect("a path");
    config.global.set_root_path(&root);
    let objects = system.domain.object_prefix();
    config.global.prefix = FileName::new(objects.as_bytes()).expect("a name");
    let node = NodeBuilder::new().config(&config);
    let node = node.create::<ipc::Service>().expect("a node");
    let service = node
        .service_builder(&"arm_state".try_into().expect("a name"))
        .publish_subscribe::<OtherVersion>()
        .create()
        .expect("a service");
    let publisher = service.publisher_builder().create().expect("a publisher");
    let error = ControllerLink::new(&system.domain).expect_err("another version");
    assert!(matches!(error, IpcError::Version { .. }), "{error}");
    for word in ["arm_state", "another version", "ArmState", "one build"] {
        assert!(error.to_string().contains(word), "{error}");
    }
    drop((publisher, service, node));
    drop(ControllerLink::new(&system.domain).expect("the service of the other version is removed"));
}

#[test]
fn invalid_prefixes_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = "x".repeat(33);
    for prefix in ["", "../up", "a b", "UPPER", "dot.dot", &long] {
        let error = Domain::in_folder(folder.path(), prefix).expect_err("no name");
        assert!(error.to_string().contains("--prefix"), "{error}");
    }
}

#[test]
fn folder_accessible_to_other_users_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let open = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(folder.path(), open).expect("changed");
    let error = Domain::in_folder(folder.path(), "open").expect_err("open to others");
    for word in ["755", "chmod 700"] {
        assert!(error.to_string().contains(word), "{error}");
    }
}

/// Lists every file below a folder.
fn files(folder: &StdPath, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// One kind of object is an exception: for each node, iceoryx2 creates an object of a few bytes without data that other
/// users can open.
#[test]
fn other_users_cannot_open_data() {
    let system = system("permissions");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let _controller = ControllerLink::new(&system.domain).expect("a controller");
    let _server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let _reader = TelemetryReader::new(&system.domain).expect("a reader");
    plant.publish(&state(0)).expect("published");
    let mut found = Vec::new();
    files(&system.folder, &mut found);
    let shared = std::fs::read_dir("/dev/shm")
        .expect("shared memory")
        .flatten();
    let ours = |name: &str| name.starts_with(&system.domain.object_prefix());
    found.extend(
        shared
            .filter(|entry| ours(&entry.file_name().to_string_lossy()))
            .map(|entry| entry.path()),
    );
    assert!(found.len() > 10, "{found:?}");
    let in_shared_memory = found.iter().filter(|path| path.starts_with("/dev/shm"));
    assert!(in_shared_memory.count() > 3, "{found:?}");
    for path in found {
        // If the metadata are missing, another process has just removed the file.
        let Ok(metadata) = path.symlink_metadata() else {
            continue;
        };
        let open_to_others = metadata.mode() & 0o077 != 0;
        let without_data = path.starts_with("/dev/shm") && metadata.len() <= 16;
        assert!(
            !open_to_others || without_data,
            "{} of {} bytes has mode {:o}",
            path.display(),
            metadata.len(),
            metadata.mode() & 0o777
        );
    }
    let folder = system.folder.metadata().expect("the folder exists");
    assert_eq!(folder.mode() & 0o777, 0o700);
}
