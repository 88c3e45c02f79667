//! Tests with viewers that never read, with more data for them than the buffers of the kernel hold.

use crate::client::{Client, split};
use crate::controller::System;
use crate::live::subscribe;
use serde_json::json;
use supple_ipc::TelemetryReader;
use supple_view::Options;

/// Number of descriptions of the arm that a stalled viewer requests: some 5 MB, more than both buffers of a connection hold.
const DESCRIPTIONS: usize = 1000;
/// Number of snapshots that another viewer must receive while a connection is blocked.
const SNAPSHOTS: usize = 10;

/// State of one side of a connection, from the kernel's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SendState {
    established: bool,
    unsent_bytes: u64,
}

/// Returns the state of the server's side of the connection to this port.
fn server_end(server: u16, client: u16) -> Option<SendState> {
    let table = std::fs::read_to_string("/proc/self/net/tcp").expect("the kernel's table");
    let ends = (format!(":{server:04X}"), format!(":{client:04X}"));
    table.lines().skip(1).find_map(|line| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let of_this = fields[1].ends_with(&ends.0) && fields[2].ends_with(&ends.1);
        let unsent = fields[4].split(':').next().unwrap_or_default();
        of_this.then(|| SendState {
            established: fields[3] == "01",
            unsent_bytes: u64::from_str_radix(unsent, 16).expect("a number"),
        })
    })
}

#[test]
fn a_viewer_that_never_reads_delays_neither_the_controller_nor_other_viewers() {
    let (system, addresses) = System::start(Options::default());
    let server: u16 = split(&addresses.url)
        .0
        .rsplit_once(':')
        .and_then(|(_, port)| port.parse().ok())
        .expect("a port");
    // Another reader of the same telemetry loses nothing while the viewers are stalled.
    let mut reader = TelemetryReader::new(system.domain()).expect("a reader");
    let mut received = 0_u64;
    let before = system.cycles();
    let mut step = || {
        system.step();
        while reader.receive().expect("telemetry").is_some() {
            received += 1;
        }
    };
    let mut watching = Client::connect(&addresses.foxglove_url, "").expect("accepted");
    let advertised = watching.wait_for_op(&mut step, "advertise");
    subscribe(&mut watching, &advertised, 9, "/view");
    watching.wait_for_data(&mut step, 9);

    let stalled: Vec<Client> = (0..3)
        .map(|_| {
            let mut client = Client::connect(&addresses.foxglove_url, "").expect("accepted");
            let advertised = client.wait_for_op(&mut step, "advertise");
            for (id, topic) in [(1, "/controller_state"), (2, "/tf"), (9, "/view")] {
                subscribe(&mut client, &advertised, id, topic);
            }
            for _ in 0..DESCRIPTIONS {
                subscribe(&mut client, &advertised, 3, "/robot_description");
            }
            client
        })
        .collect();
    // A connection is blocked if the kernel holds bytes for the viewer, and their number does not change between two
    // snapshots of the other viewer, although more data are always waiting.
    let mut last = [None; 3];
    let mut stuck_snapshots = [0; 3];
    let mut dropped = [false; 3];
    while dropped != [true; 3] {
        watching.wait_for_data(&mut step, 9);
        for (index, client) in stalled.iter().enumerate() {
            let now = server_end(server, client.port());
            let stuck = |end: SendState| end.established && end.unsent_bytes > 0;
            if now.is_some_and(stuck) && now == last[index] {
                stuck_snapshots[index] += 1;
            }
            dropped[index] = !now.is_some_and(|end| end.established);
            last[index] = now;
        }
    }
    for snapshots in stuck_snapshots {
        assert!(snapshots >= SNAPSHOTS, "{stuck_snapshots:?} snapshots");
    }
    // The system continues after the server has disconnected the stalled viewers.
    watching.wait_for_data(&mut step, 9);
    let gains = json!({"request": "gains", "stiffness_n_per_m": [12.0, 12.0, 12.0]});
    assert!(watching.call(&mut step, &gains).is_ok());
    assert_eq!(reader.lost(), 0);
    assert_eq!(received, system.cycles() - before);
}
