//! Tests of the page of a running system: snapshots, channels of a log, and commands.

use crate::client::{Client, get_url};
use crate::controller::System;
use serde_json::{Value, json};
use supple_view::Options;

/// Returns the id of the channel with this topic.
fn channel(advertised: &Value, topic: &str) -> Value {
    let channels = advertised["channels"].as_array().expect("channels");
    let found = channels.iter().find(|channel| channel["topic"] == topic);
    found.unwrap_or_else(|| panic!("no {topic}"))["id"].clone()
}

pub fn subscribe(client: &mut Client, advertised: &Value, id: u32, topic: &str) {
    let channel = channel(advertised, topic);
    client.send(&json!({"op": "subscribe", "subscriptions": [{"id": id, "channelId": channel}]}));
}

/// Waits for the next snapshot.
fn snapshot(client: &mut Client, system: &System) -> Value {
    let bytes = client.wait_for_data(&mut || system.step(), 9);
    serde_json::from_slice(&bytes).expect("JSON")
}

#[test]
fn snapshots_show_the_motion_and_a_new_stiffness_that_the_controller_applied() {
    let (system, addresses) = System::start(Options::default());
    let (status, info) = get_url(&format!("{}info.json", addresses.url));
    let info: Value = serde_json::from_str(&info).expect("JSON");
    assert_eq!((status, &info["arm"]), (200, &json!("wam4")));
    assert!(
        info["urdf"]
            .as_str()
            .is_some_and(|urdf| urdf.contains("<robot"))
    );

    let mut client = Client::connect(&addresses.foxglove_url, "").expect("accepted");
    let advertised = client.wait_for_op(&mut || system.step(), "advertise");
    subscribe(&mut client, &advertised, 9, "/view");
    let first = snapshot(&mut client, &system);
    assert_eq!(first["mode"], "track");
    assert_eq!(first["stiffness_n_per_m"], json!([5.0, 5.0, 5.0]));
    let angle = |snapshot: &Value| snapshot["joints_rad"][1].as_f64().expect("an angle");
    assert!(angle(&snapshot(&mut client, &system)) > angle(&first));

    let gains = json!({"request": "gains", "stiffness_n_per_m": [12.0, 12.0, 12.0]});
    let reply = client
        .call(&mut || system.step(), &gains)
        .expect("accepted");
    assert_eq!(reply, json!({"accepted": true, "mode": "track"}));
    for _ in 0..3 {
        snapshot(&mut client, &system);
    }
    let after = snapshot(&mut client, &system);
    assert_eq!(after["stiffness_n_per_m"], json!([12.0, 12.0, 12.0]));
    // The gains that the command does not contain stay.
    assert_eq!(after["damping_n_s_per_m"], json!([8.0, 8.0, 8.0]));

    let gains = json!({"request": "gains", "stiffness_n_per_m": [900.0, 12.0, 12.0]});
    let refused = client.call(&mut || system.step(), &gains);
    assert_eq!(refused, Err("refused: too stiff".to_owned()));
    let unknown = client.call(&mut || system.step(), &json!({"request": "run"}));
    assert!(unknown.is_err_and(|reason| reason.contains("invalid")));
}

#[test]
fn foxglove_viewers_get_the_channels_of_a_log_and_set_parameters() {
    let (system, addresses) = System::start(Options::default());
    let mut client =
        Client::connect(&addresses.foxglove_url, "Origin: file://\r\n").expect("accepted");
    let info = client.wait_for_op(&mut || system.step(), "serverInfo");
    assert_eq!(
        info["capabilities"],
        json!(["parameters", "parametersSubscribe", "services"])
    );
    let advertised = client.wait_for_op(&mut || system.step(), "advertise");
    for channel in advertised["channels"].as_array().expect("channels") {
        let ros = channel["encoding"] == "cdr" && channel["schemaEncoding"] == "ros2msg";
        assert!(ros || channel["topic"] == "/view", "{channel}");
        assert!(!channel["schema"].as_str().expect("a text").is_empty());
    }
    subscribe(&mut client, &advertised, 1, "/robot_description");
    let description = client.wait_for_data(&mut || system.step(), 1);
    assert!(String::from_utf8_lossy(&description).contains("<robot name=\"wam4\""));
    subscribe(&mut client, &advertised, 2, "/joint_states");
    let joints = client.wait_for_data(&mut || system.step(), 2);
    // CDR, little-endian, then time and frame; the names of the joints follow.
    assert_eq!(joints[..4], [0, 1, 0, 0]);
    assert!(String::from_utf8_lossy(&joints).contains("joint4"));
    for (id, topic) in [(3, "/tf"), (4, "/controller_state"), (5, "/cycle_timing")] {
        subscribe(&mut client, &advertised, id, topic);
        let message = client.wait_for_data(&mut || system.step(), id);
        assert!(message.len() > 20, "{topic}");
    }

    client
        .send(&json!({"op": "subscribeParameterUpdates", "parameterNames": ["stiffness_n_per_m"]}));
    let set = json!({"op": "setParameters", "id": "a",
        "parameters": [{"name": "stiffness_n_per_m", "value": [7, 8, 9], "type": "float64_array"}]});
    client.send(&set);
    let stiffness = |message: &Value| {
        let parameters = message["parameters"].as_array().expect("parameters");
        let found = parameters.iter().find(|p| p["name"] == "stiffness_n_per_m");
        found.map(|p| p["value"].clone())
    };
    loop {
        let values = client.wait_for_op(&mut || system.step(), "parameterValues");
        if stiffness(&values) == Some(json!([7.0, 8.0, 9.0])) {
            break;
        }
    }
    client.send(&json!({"op": "setParameters", "id": "b",
        "parameters": [{"name": "stiffness_n_per_m", "value": 1e9}]}));
    let refused = client.wait_for_op(&mut || system.step(), "status");
    assert_eq!(refused["message"], "refused: too stiff");
}

#[test]
fn a_read_only_page_refuses_commands() {
    let (system, addresses) = System::start(Options {
        read_only: true,
        ..Options::default()
    });
    let mut client = Client::connect(&addresses.foxglove_url, "").expect("accepted");
    let advertised = client.wait_for_op(&mut || system.step(), "advertise");
    subscribe(&mut client, &advertised, 9, "/view");
    assert_eq!(snapshot(&mut client, &system)["mode"], "track");
    for command in [
        json!({"request": "idle"}),
        json!({"request": "gains", "stiffness_n_per_m": [1, 1, 1]}),
    ] {
        let refused = client.call(&mut || system.step(), &command);
        assert!(
            refused.is_err_and(|reason| reason.contains("only shows")),
            "{command}"
        );
    }
    assert!(system.cycles() > 0);
}
