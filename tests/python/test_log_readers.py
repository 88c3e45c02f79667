"""Reads logs with Python's standard readers, which do not depend on supple.

Every message is decoded by the definition inside the file, and its values are checked for consistency:
transforms with the tip that the controller reports, torque terms with their sum.
"""

import math
import re
import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory

SCHEMAS = {
    "/controller_state": "supple_msgs/msg/ControllerState",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/wrench_ext": "geometry_msgs/msg/WrenchStamped",
    "/wrench_observed": "geometry_msgs/msg/WrenchStamped",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/robot_description": "std_msgs/msg/String",
    "/cycle_timing": "supple_msgs/msg/CycleTiming",
    "/plant_truth": "supple_msgs/msg/PlantTruth",
}
ALWAYS = {"/controller_state", "/joint_states", "/tf", "/robot_description"}
TERMS = (
    "gravity coriolis friction jacobian_rate inertial stiffness damping force nullspace joint_pd "
    "soft_stop ripple handover"
).split()


def decoded(path: Path, **selection) -> dict[str, list[tuple[int, SimpleNamespace]]]:
    """Time and message by channel."""
    messages = defaultdict(list)
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, value in reader.iter_decoded_messages(**selection):
            messages[channel.topic].append((message.log_time, value))
    return messages


@pytest.fixture(scope="module")
def messages(log: Path):
    return decoded(log)


@pytest.fixture(scope="module")
def joints(log: Path) -> list[str]:
    with log.open("rb") as stream:
        metadata = {m.name: m.metadata for m in make_reader(stream).iter_metadata()}
    return metadata["supple"]["joints"].split(" ")


def attachments(path: Path) -> dict[str, str]:
    with path.open("rb") as stream:
        found = make_reader(stream).iter_attachments()
        return {attachment.name: attachment.data.decode() for attachment in found}


def xyz(vector) -> tuple[float, float, float]:
    return (vector.x, vector.y, vector.z)


def test_profile_channels_and_counts(log: Path, messages) -> None:
    with log.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    schemas = {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}
    assert schemas.items() <= SCHEMAS.items()
    assert ALWAYS <= schemas.keys()
    assert {s.encoding for s in summary.schemas.values()} == {"ros2msg"}
    assert {c.message_encoding for c in summary.channels.values()} == {"cdr"}
    assert {c.compression for c in summary.chunk_indexes} == {"lz4"}

    counts = {
        summary.channels[number].topic: count
        for number, count in summary.statistics.channel_message_counts.items()
    }
    assert counts == {topic: len(found) for topic, found in messages.items()}
    steps = counts["/controller_state"]
    assert steps > 0
    assert counts["/joint_states"] == steps
    assert counts["/tf"] == math.ceil(steps / 20)
    assert counts["/robot_description"] == 1


def test_chunks_are_shorter_than_a_quarter_of_a_second(log: Path) -> None:
    with log.open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    assert len(chunks) > 1
    for chunk in chunks:
        assert chunk.message_end_time - chunk.message_start_time < 250_000_000


def test_the_index_gives_the_same_messages(log: Path, messages) -> None:
    times = [time for time, _ in messages["/controller_state"]]
    start, end = times[len(times) // 3], times[len(times) // 2]
    part = decoded(log, topics=["/controller_state"], starting_at=start, ending_before=end)
    expected = [
        (time, value.step)
        for time, value in messages["/controller_state"]
        if start <= time < end
    ]
    assert [(time, value.step) for time, value in part["/controller_state"]] == expected


def test_attachments(log: Path, messages, joints) -> None:
    files = attachments(log)
    assert set(files) == {"arm.urdf", "arm.toml", "controller.toml"}
    robot = ET.fromstring(files["arm.urdf"])
    assert robot.tag == "robot"
    assert set(joints) <= {joint.get("name") for joint in robot.iter("joint")}
    assert messages["/robot_description"][0][1].data == files["arm.urdf"]
    assert files["controller.toml"].count("[[joints]]") == len(joints)


def test_metadata(log: Path) -> None:
    with log.open("rb") as stream:
        metadata = {m.name: m.metadata for m in make_reader(stream).iter_metadata()}
    about = metadata["supple"]
    assert {"software", "arm", "joints", "experiment", "start_ns"} <= about.keys()
    assert about["software"].startswith("supple-log ")


def test_joint_states(messages, joints) -> None:
    states = messages["/controller_state"]
    assert len(states) == len(messages["/joint_states"])
    for (time, joint_state), (state_time, state) in zip(messages["/joint_states"], states):
        assert time == state_time
        stamp = joint_state.header.stamp
        assert stamp.sec * 1_000_000_000 + stamp.nanosec == time
        assert list(joint_state.name) == joints
        assert list(joint_state.position) == list(state.position_rad)
        assert list(joint_state.velocity) == list(state.velocity_rad_per_s)
        assert list(joint_state.effort) == list(state.torque_nm)
        assert all(map(math.isfinite, joint_state.position))


def test_steps_follow_each_other(messages) -> None:
    steps = [state.step for _, state in messages["/controller_state"]]
    assert steps == list(range(len(steps)))


def test_torque_is_the_sum_of_its_terms(messages, joints) -> None:
    compared = 0
    for _, state in messages["/controller_state"]:
        if state.torque_limited or state.rate_limited or state.fault:
            continue
        for i in range(len(joints)):
            terms = [getattr(state.torques, term)[i] for term in TERMS]
            assert math.isclose(math.fsum(terms), state.torque_nm[i], abs_tol=1e-9)
            compared += any(terms)
    assert compared > 0


def test_modes_and_faults_have_names(messages) -> None:
    modes = Counter(state.mode for _, state in messages["/controller_state"])
    assert modes.keys() <= set(range(6))
    for _, state in messages["/controller_state"]:
        assert bool(state.fault) == bool(state.fault_text)
        assert bool(state.refusal) == bool(state.refusal_text)
        assert (state.mode == 5) <= bool(state.fault)
    requests = [state for _, state in messages["/controller_state"] if state.request]
    assert requests and all(1 <= state.request <= 6 for state in requests)


def test_wrenches(messages) -> None:
    states = {time: state for time, state in messages["/controller_state"]}
    for time, wrench in messages["/wrench_ext"]:
        assert wrench.header.frame_id == "tip_base_axes"
        if states[time].has_tip_force:
            assert xyz(wrench.wrench.force) == xyz(states[time].tip_force_n)
    for time, wrench in messages["/wrench_observed"]:
        assert states[time].has_reference
        assert xyz(wrench.wrench.force) == xyz(states[time].external_force_n)


def rotated(q, v):
    """The vector `v` rotated by the unit quaternion `q`."""
    u = (q.x, q.y, q.z)
    t = [2.0 * c for c in cross(u, v)]
    s = cross(u, t)
    return tuple(v[i] + q.w * t[i] + s[i] for i in range(3))


def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def test_transforms_lead_to_the_tip(log: Path, messages) -> None:
    tip_frame = re.search(r'^tip_frame = "(.+)"', attachments(log)["arm.toml"], re.M).group(1)
    states = {time: state for time, state in messages["/controller_state"]}
    for time, message in messages["/tf"]:
        by_child = {t.child_frame_id: t for t in message.transforms}
        assert len(by_child) == len(message.transforms)
        for transform in by_child.values():
            q = transform.transform.rotation
            norm = math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2)
            assert math.isclose(norm, 1.0, abs_tol=1e-9)
        point, frame = (0.0, 0.0, 0.0), tip_frame
        while frame in by_child:
            transform = by_child[frame].transform
            turned = rotated(transform.rotation, point)
            point = tuple(a + b for a, b in zip(turned, xyz(transform.translation)))
            frame = by_child[frame].header.frame_id
        assert frame == by_child["tip_base_axes"].header.frame_id
        assert frame == states[time].header.frame_id
        tip = xyz(states[time].tip_position_m)
        assert math.dist(point, tip) < 1e-9
        assert xyz(by_child["tip_base_axes"].transform.translation) == tip


def test_timing_and_truth(messages, joints) -> None:
    for _, timing in messages["/cycle_timing"]:
        assert timing.period_ns > 0 and timing.step_ns > 0
    for _, truth in messages["/plant_truth"]:
        assert len(truth.position_rad) == len(truth.motor_torque_nm) == len(joints)


def test_a_truncated_log_is_rejected(cut_log: Path) -> None:
    with pytest.raises(McapError), cut_log.open("rb") as stream:
        make_reader(stream).get_summary()
    with pytest.raises(McapError), cut_log.open("rb") as stream:
        for _ in NonSeekingReader(stream).iter_messages():
            pass


def test_a_recovered_log_is_accepted(log: Path, recovered_log: Path, messages) -> None:
    recovered = decoded(recovered_log)
    assert attachments(recovered_log) == attachments(log)
    for topic, found in recovered.items():
        assert 0 < len(found) <= len(messages[topic])
        for (time, value), (expected_time, expected) in zip(found, messages[topic]):
            assert time == expected_time
            assert repr(value) == repr(expected)
    assert len(recovered["/controller_state"]) < len(messages["/controller_state"])
    with recovered_log.open("rb") as stream:
        metadata = {m.name: m.metadata for m in make_reader(stream).iter_metadata()}
    assert int(metadata["recovery"]["kept_bytes"]) < log.stat().st_size
