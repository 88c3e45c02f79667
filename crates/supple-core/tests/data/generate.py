#!/usr/bin/env python3
"""Data of the dynamics tests, from the URDFs beside this file.

    python3 generate.py                 writes arms.json (standard library only)
    python3 generate.py --pinocchio     also checks wam*.json against Pinocchio and writes
                                        regressors.json (needs `pip install pin`)

arms.json holds each arm as plain numbers, so that the tests need no URDF reader. Angles rad, lengths
m, masses kg, inertias kg m^2; `rpy` as in a URDF; `tip` is the chain of fixed frames from the last
moving link to the tip.
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as xml

HERE = pathlib.Path(__file__).parent
ARMS = ("wam3", "wam4", "wam7")
REGRESSOR_STATES = 6


def numbers(element, attribute):
    return [float(x) for x in element.get(attribute).split()]


def origin(element):
    found = element.find("origin")
    return {"xyz": numbers(found, "xyz"), "rpy": numbers(found, "rpy")}


def body(link):
    inertial = link.find("inertial")
    frame = origin(inertial)
    assert frame["rpy"] == [0.0, 0.0, 0.0], "inertia axes parallel to the link's are assumed"
    inertia = inertial.find("inertia")
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    return {
        "mass": float(inertial.find("mass").get("value")),
        "com": frame["xyz"],
        "inertia": {n: float(inertia.get(n)) for n in names},
    }


def arm(name):
    robot = xml.parse(HERE / f"{name}.urdf").getroot()
    links = {link.get("name"): link for link in robot.findall("link")}
    by_parent = {j.find("parent").get("link"): j for j in robot.findall("joint")}
    joints, tip, link = [], [], "base"
    while link in by_parent:
        joint = by_parent[link]
        link = joint.find("child").get("link")
        if joint.get("type") == "fixed":
            assert links[link].find("inertial") is None, "fixed links carry no mass here"
            tip.append(origin(joint))
        else:
            assert not tip, "fixed frames stand only after the last moving joint"
            axis = numbers(joint.find("axis"), "xyz")
            joints.append({"origin": origin(joint), "axis": axis, "body": body(links[link])})
    assert link == "tip"
    return {"joints": joints, "tip": tip}


def write(name, content):
    (HERE / name).write_text(json.dumps(content, indent=1) + "\n")


def check_and_extend():
    import numpy as np
    import pinocchio as pin

    regressors = {"generator": f"pinocchio {pin.__version__}, float64"}
    for name in ARMS:
        reference = json.loads((HERE / f"{name}.json").read_text())
        model = pin.buildModelFromUrdf(str(HERE / f"{name}.urdf"))
        data = model.createData()
        samples = {k: np.array(v) for k, v in reference["samples"].items()}
        tip = model.getFrameId("tip")
        worst = 0.0

        def compare(found, expected):
            nonlocal worst
            worst = max(worst, float(np.max(np.abs(found - expected) / (1 + np.abs(expected)))))

        blocks = []
        for k in range(reference["n_samples"]):
            s = {key: value[k] for key, value in samples.items()}
            q, qd, qdd = s["q"], s["qd"], s["qdd"]
            compare(pin.rnea(model, data, q, qd, qdd), s["rnea"])
            compare(pin.nonLinearEffects(model, data, q, qd), s["nle"])
            compare(pin.computeGeneralizedGravity(model, data, q), s["gravity"])
            upper = np.triu(pin.crba(model, data, q))
            compare(upper + np.triu(upper, 1).T, s["M"])
            compare(pin.computeCoriolisMatrix(model, data, q, qd), s["coriolis_matrix"])
            acceleration = pin.aba(model, data, q, qd, s["tau_in"])
            scale = max(1.0, float(np.max(np.abs(s["aba"]))))
            compare(acceleration / scale, s["aba"] / scale)
            compare(pin.computeKineticEnergy(model, data, q, qd), s["kinetic_energy"])
            compare(pin.computePotentialEnergy(model, data, q), s["potential_energy"])
            pin.forwardKinematics(model, data, q, qd, np.zeros(model.nv))
            pin.updateFramePlacements(model, data)
            compare(data.oMf[tip].translation, s["tip_pos"])
            compare(data.oMf[tip].rotation, s["tip_rot"])
            aligned = pin.LOCAL_WORLD_ALIGNED
            compare(pin.computeFrameJacobian(model, data, q, tip, aligned), s["J_lwa"])
            pin.forwardKinematics(model, data, q, qd, np.zeros(model.nv))
            drift = pin.getFrameClassicalAcceleration(model, data, tip, aligned).vector
            compare(drift, s["jdot_qd_classical_lwa"])
            if k < REGRESSOR_STATES:
                blocks.append(pin.computeJointTorqueRegressor(model, data, q, qd, qdd).tolist())
        regressors[name] = blocks
        print(f"{name}: worst mixed difference from Pinocchio {pin.__version__}: {worst:.1e}")
    (HERE / "regressors.json").write_text(json.dumps(regressors) + "\n")


if __name__ == "__main__":
    write("arms.json", {name: arm(name) for name in ARMS})
    if "--pinocchio" in sys.argv[1:]:
        check_and_extend()
