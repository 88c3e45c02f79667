"""Compares the plant with MuJoCo: the 4-joint arm pressed against a block at a step of 0.2 ms, on one
core.

    benches/peers/run.sh                         once, to install the environment
    target/peers/python/bin/python benches/peers/plant.py [--rounds N] [--core N]

Our plant computes more per step than MuJoCo: joint friction with a state, quantised encoders and
torques, a force sensor with its filter, the arm's contact with a scene.
"""

import argparse
import pathlib
import re
import statistics
import subprocess

import cases
import mujoco
import numpy as np

HERE = pathlib.Path(__file__).parent
FOLDER = HERE.parents[1] / "target/peers"
ARMATURE = (0.2052, 0.1888, 0.0669, 0.0346)
TOOL = 'mass="0.3" diaginertia="1.1e-4 1.1e-4 1.1e-4"'


def text(values):
    return " ".join(repr(float(x)) for x in np.ravel(values))


def model():
    """The arm of supple-core's tests with rotors and a tool, as MuJoCo's XML."""
    arm = cases.reference_arm("wam4", 3)
    opened = []
    for joint, armature in zip(arm.joints, ARMATURE):
        i = joint.inertia
        full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        opened.append(
            f'<body pos="{text(joint.translation)}" xyaxes="{text(joint.rotation[:, :2].T)}">'
            f'<inertial pos="{text(joint.com)}" mass="{joint.mass}" fullinertia="{text(full)}"/>'
            f'<joint type="hinge" axis="{text(joint.axis)}" armature="{armature}"/>'
        )
    tip = text(arm.tip.translation)
    return (
        '<mujoco><compiler angle="radian"/><option timestep="0.0002" gravity="0 0 -9.81"/>'
        f'<worldbody>{"".join(opened)}<site name="tip" pos="{tip}"/>'
        f'<body pos="{tip}"><inertial pos="0 0 -0.03" {TOOL}/></body>'
        f'{"</body>" * len(opened)}</worldbody></mujoco>'
    )


def build():
    package = pathlib.Path(mujoco.__file__).parent
    (FOLDER / "wam4.xml").write_text(model())
    library = next(package.glob("libmujoco.so*"))
    subprocess.run(
        ["clang++", "-std=c++17", "-O3", "-march=native", "-DNDEBUG", f"-I{package / 'include'}"]
        + [HERE / "plant.cpp", library, f"-Wl,-rpath,{package}", "-o", FOLDER / "plant"],
        check=True,
    )
    cargo = ["cargo", "build", "--locked", "--release", "-p", "supple-plant", "--example", "speed"]
    subprocess.run(cargo, check=True, cwd=HERE.parents[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--core", type=int, default=0)
    options = parser.parse_args()
    build()
    pin = ["taskset", "-c", str(options.core)]
    ours, peer = [], []
    for _ in range(options.rounds):
        example = HERE.parents[1] / "target/release/examples/speed"
        printed = subprocess.run([*pin, example], check=True, capture_output=True, text=True).stdout
        ours.append(float(re.search(r"fixed block: ([\d.]+) times", printed)[1]))
        command = [*pin, FOLDER / "plant", FOLDER / "wam4.xml"]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        speed, share = map(float, printed.split())
        if not 0.2 < share < 0.8:
            raise SystemExit(f"the peer's tip is in contact {share:.0%} of the time, expected 20 to 80 %")
        peer.append(speed)
    ratio = statistics.median(a / b for a, b in zip(ours, peer))
    print(f"real-time factor at 0.2 ms, median of {options.rounds} rounds, one core:")
    print(f"ours {statistics.median(ours):.1f}, MuJoCo {mujoco.__version__} {statistics.median(peer):.1f}")
    print(f"ours over MuJoCo's: {ratio:.2f}")


if __name__ == "__main__":
    main()
