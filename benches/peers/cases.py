"""Arms and pools of random states as plain numbers, in the order that `harness.hpp` and the Rust program
read them. `read` reads the files of `write`."""

import json
import pathlib
from types import SimpleNamespace as Record

import numpy as np

ARMS = pathlib.Path(__file__).parents[2] / "crates/supple-core/tests/data/arms.json"
STATES = 256
# Near singular poses our law is damped and the peers' is not, so a pool excludes such poses. Position: minimum
# singular value [m]; pose: maximum effective mass [kg] along, and inertia [kg m^2] about, any base axis.
MIN_SINGULAR_VALUE = 0.2
MAX_MASS = 20.0
MAX_INERTIA = 2.0
GAINS = Record(
    stiffness=[50.0, 60.0, 70.0, 5.0, 6.0, 7.0], damping=[15.0, 16.0, 17.0, 0.5, 0.6, 0.7], nullspace=2.0
)


def rpy(angles):
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(a), np.cos(a)) for a in angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose(origin):
    return Record(rotation=rpy(origin["rpy"]), translation=np.array(origin["xyz"]))


def reference_arm(name, task):
    """One of the arms of the core's tests."""
    arm = json.loads(ARMS.read_text())[name]
    joints = []
    for joint in arm["joints"]:
        i = joint["body"]["inertia"]
        joints.append(
            Record(
                **vars(pose(joint["origin"])),
                axis=np.array(joint["axis"]),
                mass=joint["body"]["mass"],
                com=np.array(joint["body"]["com"]),
                inertia=np.array(
                    [
                        [i["ixx"], i["ixy"], i["ixz"]],
                        [i["ixy"], i["iyy"], i["iyz"]],
                        [i["ixz"], i["iyz"], i["izz"]],
                    ]
                ),
            )
        )
    tip = Record(rotation=np.eye(3), translation=np.zeros(3))
    for frame in map(pose, arm["tip"]):
        tip = Record(
            rotation=tip.rotation @ frame.rotation,
            translation=tip.translation + tip.rotation @ frame.translation,
        )
    return Record(joints=joints, task=task, gravity=np.array([0.0, 0.0, -9.81]), tip=tip)


def random_arm(count, random):
    """A random arm: bodies of a few point masses, axes along the coordinate axes, random frames."""
    joints = []
    for _ in range(count):
        points, masses = random.uniform(-0.2, 0.2, (6, 3)), random.uniform(0.05, 1.0, 6)
        com = masses @ points / masses.sum()
        away = points - com
        inertia = sum(
            m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, away)
        )
        joints.append(
            Record(
                rotation=rpy(random.uniform(-3.0, 3.0, 3)),
                translation=random.uniform(-0.4, 0.4, 3),
                axis=np.eye(3)[random.integers(3)],
                mass=masses.sum(),
                com=com,
                inertia=inertia,
            )
        )
    tip = Record(rotation=np.eye(3), translation=np.array([0.0, 0.0, 0.2]))
    return Record(joints=joints, task=0, gravity=np.array([0.0, 0.0, -9.81]), tip=tip)


def frames(arm, q):
    """Each link's frame and joint axis in the base, and the tip's frame."""
    rotation, position, links = np.eye(3), np.zeros(3), []
    for joint, angle in zip(arm.joints, q):
        position = position + rotation @ joint.translation
        rotation = rotation @ joint.rotation
        axis = rotation @ joint.axis
        k = skew(joint.axis)
        rotation = rotation @ (np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)
        links.append((rotation, position, axis))
    return links, (rotation @ arm.tip.rotation, position + rotation @ arm.tip.translation)


def skew(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def jacobian(links, point, moved):
    """Jacobian of a point that the first `moved` joints carry."""
    columns = np.zeros((6, len(links)))
    for i, (_, position, axis) in enumerate(links[:moved]):
        columns[:, i] = np.concatenate([np.cross(axis, point - position), axis])
    return columns


def mass_matrix(arm, links):
    total = np.zeros((len(links), len(links)))
    for i, (joint, (rotation, position, _)) in enumerate(zip(arm.joints, links)):
        j = jacobian(links, position + rotation @ joint.com, i + 1)
        inertia = rotation @ joint.inertia @ rotation.T
        total += joint.mass * j[:3].T @ j[:3] + j[3:].T @ inertia @ j[3:]
    return total


def regular(arm, links, tip):
    j = jacobian(links, tip[1], len(links))
    if arm.task == 3:
        return np.linalg.svd(j[:3], compute_uv=False)[-1] > MIN_SINGULAR_VALUE
    if arm.task == 6:
        felt = np.diag(np.linalg.inv(j @ np.linalg.inv(mass_matrix(arm, links)) @ j.T))
        return felt[:3].max() < MAX_MASS and felt[3:].max() < MAX_INERTIA
    return True


def state(arm, random):
    n = len(arm.joints)
    while True:
        q = random.uniform(-3.0, 3.0, n)
        links, tip = frames(arm, q)
        if regular(arm, links, tip):
            break
    rotation, position = tip
    return Record(
        q=q,
        qd=random.uniform(-2.0, 2.0, n),
        qdd=random.uniform(-5.0, 5.0, n),
        tau=random.uniform(-20.0, 20.0, n),
        position=position + random.uniform(-0.02, 0.02, 3),
        rotation=rotation @ rpy(random.uniform(-0.2, 0.2, 3)),
        velocity=random.uniform(-0.3, 0.3, 6),
        acceleration=random.uniform(-1.0, 1.0, 6),
    )


JOINT = ("translation", "rotation", "axis", "mass", "com", "inertia")
STATE = ("q", "qd", "qdd", "tau", "position", "rotation", "velocity", "acceleration")


def write(path, arm, random):
    rows = [[len(arm.joints), arm.task, STATES], arm.gravity]
    rows += [np.hstack([np.ravel(getattr(j, k)) for k in JOINT]) for j in arm.joints]
    rows += [arm.tip.translation, np.ravel(arm.tip.rotation)]
    rows += [GAINS.stiffness, GAINS.damping, [GAINS.nullspace]]
    for _ in range(STATES):
        s = state(arm, random)
        rows.append(np.hstack([np.ravel(getattr(s, k)) for k in STATE]))
    text = "\n".join(" ".join(repr(float(x)) for x in row) for row in rows)
    pathlib.Path(path).write_text(text + "\n")


def read(path):
    """The arm without its states."""
    numbers = iter(map(float, pathlib.Path(path).read_text().split()))

    def take(*shape):
        count = int(np.prod(shape, dtype=int))
        return np.array([next(numbers) for _ in range(count)]).reshape(shape)

    joints, task, _ = (int(x) for x in take(3))
    gravity = take(3)
    shapes = dict(translation=(3,), rotation=(3, 3), axis=(3,), com=(3,), inertia=(3, 3))
    joints = [
        Record(**{k: take(*shapes[k]) if k in shapes else next(numbers) for k in JOINT})
        for _ in range(joints)
    ]
    tip = Record(translation=take(3), rotation=take(3, 3))
    gains = Record(stiffness=take(6), damping=take(6), nullspace=next(numbers))
    return Record(joints=joints, task=task, gravity=gravity, tip=tip, gains=gains)
