"""An impact of the tests' arm by MuJoCo, driven by the same force law.

    impact_oracle.py [--write]

Compares with `impact_mujoco.json`, against which `contact.rs` tests the plant, and ends with 1 if MuJoCo now gives
something else; `--write` replaces the file. `./ci.sh impact` runs it with the packages of `requirements.txt`.

The arm is the one of `common/mod.rs`: four joints, Barrett's inertias and rotors, a 0.3 kg ball as tool.
Gravity is compensated, the tip comes straight down at 0.04 m/s on a frictionless surface at z = 0.
"""

import argparse
import json
import pathlib
import sys

import mujoco
import numpy as np

FILE = pathlib.Path(__file__).with_name("impact_mujoco.json")
# Relative: far less than the bounds of `contact.rs`, more than the rounding of another processor.
TOLERANCE = 1e-6
STEP_S = 1e-5

RADIUS, STIFFNESS, DISSIPATION = 0.02, 1.4e8, 40.0
HALF = np.pi / 2
DH = [(-HALF, 0.0, 0.0), (HALF, 0.0, 0.0), (-HALF, 0.045, 0.55), (HALF, -0.045, 0.0)]
ARMATURE = [0.2052, 0.1888, 0.0669, 0.0346]
BODIES = [
    (10.7677, [-0.00443, 0.12189, -0.00066], [0.13488033, 0.11328369, 0.0904633],
     [-0.00213041, -0.00012485, 0.00068555]),
    (3.8749, [-0.00237, 0.03106, 0.01542], [0.02140958, 0.01377875, 0.01558906],
     [0.00027172, 0.00002461, -0.0018192]),
    (1.8023, [-0.03826, 0.20751, 0.00003], [0.05911077, 0.0032455, 0.05927043],
     [-0.00249612, 0.00000738, -0.00001767]),
    (1.0651, [0.01095, -0.00003, 0.14054], [0.01848577, 0.01891658, 0.00197517],
     [0.00000219, -0.00160868, 0.00000515]),
]


def text(values):
    return " ".join(repr(float(v)) for v in values)


def link(i):
    """Joint i, and inside it the frame of link i, which carries the inertia and the next joint."""
    mass, com, diagonal, off = BODIES[i]
    alpha, a, d = DH[i]
    inner = link(i + 1) if i < 3 else (
        '<body pos="0 0 0.38"><inertial pos="0 0 0" mass="0.3" '
        f'diaginertia="{text([0.4 * 0.3 * 0.03**2] * 3)}"/></body>'
        '<site name="tip" pos="0 0 0.41"/>'
    )
    return (
        f'<body><joint axis="0 0 1" armature="{ARMATURE[i]}"/>'
        '<inertial pos="0 0 0" mass="1e-12" diaginertia="1e-12 1e-12 1e-12"/>'
        f'<body pos="{text([a, 0, d])}" euler="{text([alpha, 0, 0])}">'
        f'<inertial pos="{text(com)}" mass="{mass}" fullinertia="{text(diagonal + off)}"/>'
        f"{inner}</body></body>"
    )


XML = (
    '<mujoco><compiler angle="radian" boundmass="0" boundinertia="0" inertiafromgeom="false"/>'
    '<option gravity="0 0 -9.81" integrator="RK4"><flag contact="disable"/></option>'
    f"<worldbody>{link(0)}</worldbody></mujoco>"
)


def tip(model, data):
    site = model.site("tip").id
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, site)
    return data.site_xpos[site].copy(), jacobian


def inverse_kinematics(model, data, x, z):
    data.qpos[:] = [0.0, 0.8, 0.0, 1.4]
    data.qvel[:] = 0.0
    for _ in range(50):
        mujoco.mj_forward(model, data)
        position, jacobian = tip(model, data)
        error = np.array([x - position[0], z - position[2]])
        data.qpos[[1, 3]] += np.linalg.solve(jacobian[np.ix_([0, 2], [1, 3])], error)
    mujoco.mj_forward(model, data)


def impact(step):
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    model.opt.timestep = step
    inverse_kinematics(model, data, 0.72, RADIUS + 1e-4)
    _, jacobian = tip(model, data)
    data.qvel[[1, 3]] = np.linalg.solve(jacobian[np.ix_([0, 2], [1, 3])], [0.0, -0.04])
    velocity = lambda: float(tip(model, data)[1][2] @ data.qvel)
    force = 0.0

    def drive(model, data):
        nonlocal force
        position, jacobian = tip(model, data)
        depth = RADIUS - position[2]
        rate = -jacobian[2] @ data.qvel
        elastic = STIFFNESS * max(depth, 0.0) ** 1.5
        force = max(elastic * (1.0 + DISSIPATION * rate), 0.0)
        speed = data.qvel.copy()
        weight = np.zeros(model.nv)
        data.qvel[:] = 0.0
        data.qacc[:] = 0.0
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, weight)
        data.qvel[:] = speed
        mujoco.mj_comVel(model, data)
        data.qfrc_applied[:] = weight + jacobian[2] * force

    mujoco.set_mjcb_control(drive)
    peak = impulse = 0.0
    for _ in range(round(0.04 / step)):
        mujoco.mj_step(model, data)
        peak = max(peak, force)
        impulse += force * step
    mujoco.mj_forward(model, data)
    speed = velocity()
    mujoco.set_mjcb_control(None)
    return peak, impulse, speed


def main():
    parser = argparse.ArgumentParser(description="An impact by MuJoCo, beside that of impact_mujoco.json")
    parser.add_argument("--write", action="store_true", help=f"write {FILE.name}")
    write = parser.parse_args().write
    names = ("peak_n", "impulse_newton_s", "rebound_m_per_s")
    found = dict(zip(names, impact(STEP_S)))
    if write:
        FILE.write_text(json.dumps({"step_s": STEP_S, "mujoco": mujoco.__version__, **found}, indent=2) + "\n")
    expected = json.loads(FILE.read_text())
    print(f"MuJoCo {mujoco.__version__}; {FILE.name} is of {expected['mujoco']}")
    differs = False
    for name in names:
        relative = abs(found[name] / expected[name] - 1.0)
        differs |= not relative <= TOLERANCE
        print(f"{name}: {found[name]:.7f}, in the file {expected[name]:.7f}, relative difference {relative:.1e}")
    if differs:
        sys.exit(f"differs by more than {TOLERANCE}: if MuJoCo is right, run this with --write")


if __name__ == "__main__":
    main()
