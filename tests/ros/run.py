"""Checks `supple ros` with a ROS 2 client that is not ours: zenoh-ros2-sdk, which speaks as rmw_zenoh does.

    python tests/ros/run.py --programs target/debug

Starts a Zenoh router on 127.0.0.1, a simulated WAM and the bridge, each with names of its own. After a failure it prints what the
programs said and the state of the arm. If the machine kept the programs from running meanwhile, it starts again, twice at most.
"""

import argparse
import contextlib
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback

import zenoh
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber
from zenoh_ros2_sdk.discovery import get_topic_names_and_types
from zenoh_ros2_sdk.qos import QosDurability, QosProfile
from zenoh_ros2_sdk.session import ZenohSession

PREFIX = f"ros_{os.getpid()}"
DOMAIN = 42
TYPES = get_typestore(Stores.ROS2_JAZZY)
TOPICS = {
    "/joint_states": "sensor_msgs/msg/JointState",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/robot_description": "std_msgs/msg/String",
    "/wrench_observed": "geometry_msgs/msg/WrenchStamped",
    "/wrench_ext": "geometry_msgs/msg/WrenchStamped",
}

# Maximum number of attempts, and the exit code of one that does not count.
ATTEMPTS = 3
STALLED = 75
# Number of answers that the controller may miss, and time for which the simulation may stall, in an attempt that counts.
MAX_MISSED = 20
MAX_STALL_MS = 500

KEPT = []


class Stalled(Exception):
    """The machine kept the programs from running."""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def router(port):
    config = zenoh.Config()
    for key, value in {
        "mode": '"router"',
        "listen/endpoints": f'["tcp/127.0.0.1:{port}"]',
        "connect/endpoints": "[]",
        "scouting/multicast/enabled": "false",
    }.items():
        config.insert_json5(key, value)
    return zenoh.open(config)


class Program:
    """A program with its output, which is interrupted at the end."""

    def __init__(self, *command):
        self.command = command
        self.lines = []
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
        )
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        self.lines.extend(self.process.stdout)

    def said(self, text):
        return any(text in line for line in self.lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.reader.join(5)


def wait(holds, what, program=None, within_s=20):
    end = time.monotonic() + within_s
    while not holds():
        if program and program.process.poll() is not None:
            raise AssertionError(f"{program.command[0]} ended with code {program.process.poll()} before: {what}")
        if time.monotonic() > end:
            raise AssertionError(f"not within {within_s} s: {what}")
        time.sleep(0.02)
    print(f"ok: {what}")


@contextlib.contextmanager
def counted(up):
    """After a failure: raises `Stalled` if the machine kept the system, which has ended by now, from running."""
    try:
        yield
    except Exception:
        found = re.search(r"(\d+) missed, \d+ late, clock paused for ([\d.]+) ms", "".join(up.lines))
        if found and (int(found[1]) > MAX_MISSED or float(found[2]) > MAX_STALL_MS):
            raise Stalled(f"the machine kept the system from running, this attempt does not count: {found[0]}")
        raise


def subscribe(topic, store, **options):
    """Subscribes; returns the list into which messages come."""
    received = []
    name = TOPICS[topic]
    # Ends when it is collected.
    KEPT.append(ROS2Subscriber(
        topic,
        name,
        received.append,
        msg_definition="",
        domain_id=DOMAIN,
        type_hash=store.hash_rihs01(name),
        **options,
    ))
    return received


def trajectory(names, points):
    """Points are pairs of positions and seconds."""
    kind = TYPES.types
    time_of = kind["builtin_interfaces/msg/Time"]
    duration = kind["builtin_interfaces/msg/Duration"]
    point = kind["trajectory_msgs/msg/JointTrajectoryPoint"]
    import numpy as np

    def at(positions, seconds):
        none = np.zeros(0)
        whole = int(seconds)
        after = duration(whole, int((seconds - whole) * 1e9))
        return point(np.array(positions), none, none, none, after)

    return {
        "header": kind["std_msgs/msg/Header"](time_of(0, 0), ""),
        "joint_names": list(names),
        "points": [at(*each) for each in points],
    }


@contextlib.contextmanager
def explained(status, programs):
    """On a failure, prints what the programs said and the state of the arm."""
    try:
        yield
    except Exception:
        print(f"state: {json.dumps(status())}")
        for program in programs:
            print(f"{' '.join(map(str, program.process.args))}, exit code {program.process.poll()}:")
            print("".join(program.lines))
        raise


def run(supple):
    port = free_port()
    with contextlib.ExitStack() as stack:
        stack.callback(router(port).close)
        up = Program(supple, "up", "--plant", "sim", "--prefix", PREFIX, "--no-log")
        stack.enter_context(counted(up))
        stack.enter_context(up)

        def status():
            found = subprocess.run([supple, "status", "--prefix", PREFIX, "--json"], capture_output=True, text=True)
            return json.loads(found.stdout) if found.returncode == 0 else {}

        programs = [up]
        stack.enter_context(explained(status, programs))
        wait(lambda: status().get("mode") == "track", "the simulated arm tracks", up)
        subprocess.run([supple, "mode", "gravity-hold", "--prefix", PREFIX], check=True, capture_output=True)

        bridge = Program(
            supple, "ros", "--prefix", PREFIX, "--connect", f"tcp/127.0.0.1:{port}",
            "--domain-id", str(DOMAIN), "--accept-trajectories",
        )
        stack.enter_context(bridge)
        programs.append(bridge)
        wait(lambda: bridge.said("ROS 2 node"), "the bridge is a node", bridge)

        client = ZenohSession.get_instance("127.0.0.1", port)
        client.store = TYPES
        client._registered_types = {name: name for name in [*TOPICS.values(), "trajectory_msgs/msg/JointTrajectory"]}

        def listed():
            return dict(get_topic_names_and_types(domain_id=DOMAIN))

        wait(lambda: TOPICS.keys() <= listed().keys(), "the topics are in the graph", bridge)
        wait(lambda: "/joint_trajectory" in listed(), "and the subscription", bridge)

        latched = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1)
        described = []

        def describes():
            # This client asks for the kept message once, when it subscribes, and loses the answer while its direct link to the
            # bridge comes up; the subscriptions of rmw_zenoh ask again.
            described[:] = subscribe("/robot_description", TYPES, qos=latched)
            return described

        wait(describes, "a later subscription receives the description", bridge)
        assert "<robot" in described[0].data
        joints = subscribe("/joint_states", TYPES)
        frames = subscribe("/tf", TYPES)
        forces = subscribe("/wrench_ext", TYPES)
        wait(lambda: len(joints) > 50 and frames and forces, "joint states, transforms and wrenches arrive", bridge)
        begin, first = time.monotonic(), len(joints)
        time.sleep(2.0)
        rate = (len(joints) - first) / (time.monotonic() - begin)
        assert 80 < rate < 120, f"{rate} messages per second, 100 were asked for"
        stamps = [message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 for message in joints]
        assert all(b > a for a, b in zip(stamps, stamps[1:])), "stamps grow"
        assert abs(stamps[-1] - time.time()) < 5, "stamps are times of day"
        names, start = joints[-1].name, list(joints[-1].position)
        assert len(names) == 4 and len(frames[-1].transforms) >= 4

        publisher = ROS2Publisher(
            "/joint_trajectory",
            "trajectory_msgs/msg/JointTrajectory",
            msg_definition="",
            domain_id=DOMAIN,
            type_hash=TYPES.hash_rihs01("trajectory_msgs/msg/JointTrajectory"),
        )

        def moved(joint, by):
            target = list(start)
            target[joint] += by
            return target

        def send(*points, order=names):
            publisher.publish(**trajectory(order, points))

        time.sleep(0.5)
        one, two = moved(0, 0.2), moved(3, -0.15)
        send((one, 2.0), (two, 4.0))
        arrives = {}

        def passed(target):
            return max(abs(a - b) for a, b in zip(joints[-1].position, target)) < 0.03

        for name, target in {"first": one, "second": two}.items():
            wait(lambda target=target: passed(target), f"the arm is in the {name} point", bridge)
            arrives[name] = time.monotonic()
        took = arrives["second"] - arrives["first"]
        assert took > 1.0, f"the second move took {took} s"
        wait(lambda: bridge.said("last move of the trajectory has ended"), "the bridge says that the last move has ended", bridge)

        for expected, points, order in (
            ("joint_names are", [(one, 2.0)], ["a", "b", "c", "d"]),
            ("positions, expected 4", [(one[:3], 2.0)], names),
            ("expected more than", [(one, 2.0), (two, 2.0)], names),
            ("refused by the controller", [(moved(0, 10.0), 2.0)], names),
            ("refused by the controller", [(moved(0, 1.5), 0.05)], names),
        ):
            bridge.lines.clear()
            before = list(joints[-1].position)
            send(*points, order=order)
            wait(lambda expected=expected: bridge.said(expected), f"rejected: {expected}", bridge)
            time.sleep(0.3)
            assert max(abs(a - b) for a, b in zip(joints[-1].position, before)) < 0.02, "the arm moved"

        bridge.lines.clear()
        send((moved(0, -0.2), 3.0), (moved(0, 0.3), 6.0))
        wait(lambda: status().get("mode") == "move", "a trajectory of two points is on its way", bridge)
        subprocess.run([supple, "mode", "gravity-hold", "--prefix", PREFIX], check=True, capture_output=True)
        wait(lambda: bridge.said("its mode is gravity_hold: the trajectory ends"), "the operator's request ends it", bridge)
        time.sleep(4.0)
        assert status().get("mode") == "gravity_hold", "the second point was not sent"

        send((moved(0, 0.3), 8.0))
        wait(lambda: status().get("mode") == "move", "a long move is on its way", bridge)
        send()
        wait(lambda: status().get("mode") == "gravity_hold", "a trajectory without points ends it", bridge)
        assert status().get("fault") in (None, "none"), status()
    print("all passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=pathlib.Path, default=pathlib.Path("target/debug"))
    parser.add_argument("--once", action="store_true", help="do not start again")
    args = parser.parse_args()
    if not args.once:
        # In a process of its own, since the client's threads do not end by themselves.
        for _ in range(ATTEMPTS):
            code = subprocess.run([sys.executable, __file__, "--once", "--programs", args.programs]).returncode
            if code != STALLED:
                return code
        print(f"the machine stalled in each of {ATTEMPTS} attempts")
        return 1
    try:
        run((args.programs / "supple").resolve())
        return 0
    except Stalled as stalled:
        traceback.print_exception(stalled.__context__)
        print(stalled)
        return STALLED
    except Exception:
        traceback.print_exc()
        return 1


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
