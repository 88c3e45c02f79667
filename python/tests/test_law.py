"""The impedance law over batches: beside single calls, beside NumPy with Pinocchio, and its errors."""

from __future__ import annotations

import re
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import supple
from robots import write_random_urdf

SAMPLES = 20
TERMS = (
    "gravity",
    "coriolis",
    "friction",
    "jacobian_rate",
    "inertial",
    "stiffness",
    "damping",
    "force",
    "nullspace",
)
ARMATURE = 0.2


def rotations(rng, count, angle):
    """Rotations by at most ``angle`` about random axes."""
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    turn = rng.uniform(-angle, angle, size=(count, 1, 1))
    zero = np.zeros(count)
    x, y, z = axis.T
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(count, 3, 3)
    return np.eye(3) + np.sin(turn) * cross + (1.0 - np.cos(turn)) * cross @ cross


def arguments(arm, directions, seed=0, samples=SAMPLES):
    """A random batch with every argument that the law takes."""
    rng = np.random.default_rng([seed, arm.dof, directions])
    q = rng.uniform(-2.0, 2.0, size=(samples, arm.dof))
    pose = arm.tip_pose(q)
    pose[:, :3, 3] += rng.normal(scale=0.1, size=(samples, 3))
    pose[:, :3, :3] = rotations(rng, samples, 1.0) @ pose[:, :3, :3]
    root = rng.normal(size=(directions, directions))
    return {
        "q": q,
        "qd": rng.normal(size=(samples, arm.dof)),
        "reference": pose if directions == 6 else np.ascontiguousarray(pose[:, :3, 3]),
        "velocity": rng.normal(size=(samples, directions)),
        "acceleration": rng.normal(size=(samples, directions)),
        "stiffness": rng.uniform(1.0, 50.0, size=(samples, directions)),
        "damping": rng.uniform(0.5, 8.0, size=(samples, directions)),
        "active_joints": [True] * arm.dof,
        "nullspace_damping": rng.uniform(0.0, 2.0, size=(samples, arm.dof)),
        "nullspace_torque": rng.normal(size=(samples, arm.dof)),
        "apparent_inertia": root @ root.T + np.eye(directions),
        "force": rng.normal(size=(samples, directions)),
    }


def without_apparent_inertia(given):
    return {name: value for name, value in given.items() if name not in ("apparent_inertia", "force")}


@pytest.fixture(scope="module")
def wam7():
    return supple.Arm.load("wam7")


@pytest.mark.parametrize("directions", [3, 6])
@pytest.mark.parametrize("friction", [None, "reference", "measured"])
def test_a_batch_equals_its_single_states(wam7, directions, friction):
    batch = {
        name: value.reshape(4, 5, *value.shape[1:]) if len(value) == SAMPLES else value
        for name, value in arguments(wam7, directions).items()
    }
    torque = wam7.impedance_torque(**batch, friction=friction)
    terms = wam7.impedance_terms(**batch, friction=friction)
    assert torque.shape == (4, 5, 7) and torque.dtype == np.float64 and torque.flags.c_contiguous
    assert tuple(terms) == TERMS and all(term.shape == (4, 5, 7) for term in terms.values())
    assert all(term.any() for name, term in terms.items() if friction or name != "friction")
    np.testing.assert_array_equal(sum(terms.values()), torque)
    shared = ("active_joints", "apparent_inertia")
    for index in np.ndindex(4, 5):
        one = {name: value if name in shared else value[index] for name, value in batch.items()}
        np.testing.assert_array_equal(wam7.impedance_torque(**one, friction=friction), torque[index])
        for name, term in wam7.impedance_terms(**one, friction=friction).items():
            np.testing.assert_array_equal(term, terms[name][index])


@pytest.mark.parametrize("directions", [3, 6])
def test_what_is_left_out_is_zero(wam7, directions):
    given = without_apparent_inertia(arguments(wam7, directions))
    for name in ("velocity", "acceleration", "nullspace_damping", "nullspace_torque"):
        width = directions if name in ("velocity", "acceleration") else 7
        zero = wam7.impedance_torque(**{**given, name: np.zeros(width)})
        left_out = {key: value for key, value in given.items() if key != name}
        np.testing.assert_array_equal(wam7.impedance_torque(**left_out), zero)


def test_one_number_is_the_gain_of_every_axis():
    arm = supple.Arm.load("wam4")
    given = without_apparent_inertia(arguments(arm, 3))
    numbers = {**given, "stiffness": 5.0, "damping": 1.5, "nullspace_damping": 0.3}
    arrays = {**given, "stiffness": [5.0] * 3, "damping": [1.5] * 3, "nullspace_damping": [0.3] * 4}
    np.testing.assert_array_equal(arm.impedance_torque(**numbers), arm.impedance_torque(**arrays))


@pytest.fixture(params=[(dof, seed) for dof in (3, 4, 6, 7) for seed in range(2)], ids=str)
def case(request, tmp_path):
    """An arm with its Pinocchio model."""
    pin = pytest.importorskip("pinocchio")
    dof, seed = request.param
    path = write_random_urdf(tmp_path, dof, seed)
    model = pin.buildModelFromUrdf(str(path))
    model.armature = np.full(dof, ARMATURE)
    arm = supple.Arm.from_urdf(path, tip="tip", armature=np.full(dof, ARMATURE))
    return SimpleNamespace(arm=arm, pin=pin, model=model, data=model.createData(), seed=seed)


def added_mobility(mobility, position_jacobian):
    """What the law adds to the diagonal of the mobility near singular poses."""
    if len(mobility) == 3:
        sigma = np.linalg.svd(position_jacobian, compute_uv=False)[-1]
        return np.full(3, max(0.0, 1.0 - (sigma / 0.18) ** 2) ** 2 / 20.0 if sigma < 0.18 else 0.0)
    added, lower, pivots = np.zeros(6), np.eye(6), np.zeros(6)
    for i, greatest in enumerate([20.0] * 3 + [2.0] * 3):
        pivot = mobility[i, i] - lower[i, :i] ** 2 @ pivots[:i]
        if pivot * greatest < 1.0:
            added[i] = (1.0 - (pivot * greatest) ** 2) ** 2 / greatest
        pivots[i] = pivot + added[i]
        for j in range(i + 1, 6):
            lower[j, i] = (mobility[j, i] - (lower[i, :i] * lower[j, :i]) @ pivots[:i]) / pivots[i]
    return added


def formula(case, active, given, k):
    """The law of state ``k`` as its documentation states it, with Pinocchio's terms."""
    pin, model, data = case.pin, case.model, case.data
    q, qd, wanted = given["q"][k], given["qd"][k], given["reference"][k]
    tip = model.getFrameId("tip")
    upper = np.triu(pin.crba(model, data, q))
    mass = upper + np.triu(upper, 1).T
    gravity = pin.computeGeneralizedGravity(model, data, q).copy()
    coriolis = pin.nonLinearEffects(model, data, q, qd) - gravity
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobian = pin.computeFrameJacobian(model, data, q, tip, axes)
    pin.forwardKinematics(model, data, q, qd, np.zeros(model.nv))
    bias = pin.getFrameClassicalAcceleration(model, data, tip, axes).vector.copy()
    pose = pin.updateFramePlacement(model, data, tip).homogeneous

    d = given["damping"].shape[-1]
    tip_velocity = jacobian[:d] @ qd
    jacobian, bias = jacobian[:d] * active, bias[:d]
    decoupled = np.where(np.outer(active, active), mass, np.eye(model.nv))
    mobile = np.linalg.solve(decoupled, jacobian.T)
    mobility = jacobian @ mobile
    inverse = mobile @ np.linalg.inv(mobility + np.diag(added_mobility(mobility, jacobian[:3])))
    error = (wanted[:3, 3] if d == 6 else wanted) - pose[:3, 3]
    stiffness, damping = given["stiffness"][k], given["damping"][k]
    spring = stiffness[:3] * error
    if d == 6:
        turn = pin.log3(wanted[:3, :3] @ pose[:3, :3].T)
        angle = np.linalg.norm(turn)
        axis = turn / angle
        pull = stiffness[3:] * axis
        moment = np.sin(angle) * pull + (1.0 - np.cos(angle)) * np.cross(pull, axis)
        spring = np.concatenate([spring, moment])
    damper = damping * (given["velocity"][k] - tip_velocity)
    terms = {
        "gravity": gravity,
        "coriolis": coriolis,
        "friction": np.zeros(model.nv),
        "jacobian_rate": -mass @ inverse @ bias,
        "inertial": mass @ inverse @ given["acceleration"][k],
        "force": np.zeros(model.nv),
    }
    if "force" in given:
        chosen, force = given["apparent_inertia"], given["force"][k]
        for name, part in (("stiffness", spring), ("damping", damper), ("force", force)):
            terms[name] = mass @ inverse @ np.linalg.solve(chosen, part)
        terms["force"] = terms["force"] - jacobian.T @ force
    else:
        terms |= {"stiffness": jacobian.T @ spring, "damping": jacobian.T @ damper}
    free = np.diag(active) - inverse @ jacobian
    torque = given["nullspace_torque"][k] - given["nullspace_damping"][k] * (free @ qd)
    terms["nullspace"] = free.T @ (active * torque) if active.sum() > d else np.zeros(model.nv)
    return terms


@pytest.mark.parametrize("directions", [3, 6])
@pytest.mark.parametrize("chosen", [False, True], ids=["own inertia", "chosen inertia"])
@pytest.mark.parametrize("held", [0, 1], ids=["all active", "one held"])
def test_the_law_is_its_formula(case, directions, chosen, held):
    dof = case.arm.dof
    if dof - held < directions:
        pytest.skip("too few joints")
    active = np.arange(dof) != (1 if held else dof)
    given = arguments(case.arm, directions, case.seed)
    if not chosen:
        given = without_apparent_inertia(given)
    given["active_joints"] = [bool(joint) for joint in active]
    found = case.arm.impedance_terms(**given)
    for k in range(SAMPLES):
        expected = formula(case, active.astype(float), given, k)
        for name in TERMS:
            scale = 1.0 + np.abs(expected[name]).max()
            np.testing.assert_allclose(found[name][k], expected[name], rtol=0.0, atol=1e-9 * scale, err_msg=name)


def test_friction_is_fed_forward_at_the_velocity_of_the_reference():
    arm = supple.Arm.load("wam4")
    given = without_apparent_inertia(arguments(arm, 3))
    del given["active_joints"]
    active = np.array(arm.active_joints)
    assert arm.active_joints == [True, True, False, True]
    joints = np.linalg.solve(arm.jacobian(given["q"])[:, :3, active], given["velocity"][..., None])[..., 0]
    sigma = np.linalg.svd(arm.jacobian(given["q"])[:, :3, active], compute_uv=False)[:, -1]
    reference = arm.impedance_terms(**given, friction="reference")["friction"]
    measured = arm.impedance_terms(**given, friction="measured")["friction"]
    for column, joint in enumerate(np.flatnonzero(active)):
        expected = arm.friction[joint].torque_nm(joints[:, column])
        np.testing.assert_allclose(reference[sigma > 0.18, joint], expected[sigma > 0.18], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(measured[:, joint], arm.friction[joint].torque_nm(given["qd"][:, joint]))
    assert not arm.impedance_terms(**given)["friction"].any()


def test_the_stribeck_effect_follows_another_velocity(tmp_path):
    plain = supple.Arm.load("yam")
    (tmp_path / "arm.toml").write_text(plain.toml.replace("coulomb_nm = ", "breakaway_nm = 0.5, coulomb_nm = "))
    (tmp_path / "arm.urdf").write_text(plain.urdf)
    arm = supple.Arm.load(tmp_path)
    given = without_apparent_inertia(arguments(arm, 3))
    at = {
        speed: arm.impedance_terms(**given, friction="reference", stribeck_velocity=np.full(arm.dof, speed))["friction"]
        for speed in (0.0, 100.0)
    }
    alone = arm.impedance_terms(**given, friction="reference")["friction"]
    for joint in np.flatnonzero(given["active_joints"]):
        friction = arm.friction[joint]
        dip = friction.breakaway_nm - friction.coulomb_nm
        assert dip > 0.0
        step = at[0.0][:, joint] - at[100.0][:, joint] - friction.stribeck_offset_nm
        assert np.abs(step).max() == pytest.approx(dip, rel=1e-3) and (step < 0.0).any() and (step > 0.0).any()
        inside = (alone[:, joint] - at[0.0][:, joint]) * (alone[:, joint] - at[100.0][:, joint])
        assert (inside <= 1e-12).all()


def test_the_law_is_that_of_a_simulated_run(tmp_path):
    """The controller's own record: its state, reference and gains give its terms."""
    arm = supple.Arm.load("wam4")
    run = supple.simulate(arm, "sinusoid", duration_s=2.0, fade=False, log_dir=tmp_path)
    log = supple.read_log(run.log)
    assert log.torques.keys() >= set(TERMS)
    found = arm.impedance_terms(
        log.q,
        log.qd,
        log.reference_position_m,
        log.reference_velocity_m_per_s,
        log.columns["reference_acceleration_m_per_s2"],
        stiffness=5.0,
        damping=1.5,
        friction="reference",
    )
    tracking = log.mode == "track"
    assert tracking.any()
    for name in ("gravity", "coriolis", "jacobian_rate", "inertial", "stiffness", "damping"):
        np.testing.assert_array_equal(found[name][tracking], log.torques[name][tracking], err_msg=name)


WAM4 = supple.Arm.load("wam4")
VALID = {"q": np.zeros((2, 4)), "qd": np.zeros(4), "reference": np.zeros(3), "stiffness": 5.0, "damping": 1.5}
TURNED = np.diag([1.0, 1.0, 1.1, 1.0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stribeck_velocity": np.zeros(4)}, "stribeck_velocity: only friction at the velocity of the reference"),
        ({"q": np.zeros(3)}, "q: expected shape (4,) or (..., 4), got (3,)"),
        ({"qd": np.zeros((3, 4))}, "qd: expected shape (2, 4), the batch of q, or (4,), got (3, 4)"),
        (
            {"reference": np.zeros((2, 4))},
            "reference: expected shape (3,) or (..., 3) for a position, (4, 4) or (..., 4, 4) for a pose, got (2, 4)",
        ),
        ({"velocity": np.zeros(6)}, "velocity: expected shape (3,) or (..., 3), got (6,)"),
        ({"stiffness": np.zeros((2, 6))}, "stiffness: expected shape (3,) or (..., 3), got (2, 6)"),
        (
            {"stiffness": [[1.0, 2.0, 3.0], [1.0, -2.0, 3.0]]},
            "stiffness: expected finite numbers of zero or more, got -2 at index (1, 1)",
        ),
        ({"damping": np.nan}, "damping: expected finite numbers of zero or more, got NaN"),
        ({"nullspace_damping": -1.0}, "nullspace_damping: expected finite numbers of zero or more, got -1"),
        ({"friction": "none"}, 'friction: expected "reference", "measured" or None, got "none"'),
        ({"active_joints": [True] * 3}, "active_joints: expected 4 booleans, one for each joint, got 3"),
        (
            {"active_joints": [True, True, False, False]},
            "active_joints: the position of the tip needs at least 3 active joints, wam4 has 2 of 4; pass",
        ),
        ({"reference": np.eye(4)}, "active_joints: the pose of the tip needs at least 6 active joints, wam4 has 3 of 4"),
        ({"force": np.zeros(3)}, "apparent_inertia: a chosen inertia needs the measured force of the tip; pass both"),
        (
            {"force": np.zeros(3), "apparent_inertia": np.diag([1.0, -1.0, 1.0])},
            "apparent_inertia: the matrix at index (0,) is not symmetric and positive definite",
        ),
        ({"q": [[0.0] * 4, [np.nan] * 4]}, "q: the mass matrix of the active joints is not positive definite at index (1,)"),
        ({"out": np.zeros((3, 4))}, "out: expected a writable float64 array in C order of shape (2, 4), got shape (3, 4)"),
    ],
)
def test_an_error_names_argument_and_shape(changes, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        WAM4.impedance_torque(**{**VALID, **changes})


def test_a_reference_that_is_no_pose_is_rejected(wam7):
    pose = {"q": np.zeros(7), "qd": np.zeros(7), "active_joints": [True] * 7, "damping": np.ones(6)}
    with pytest.raises(ValueError, match=re.escape("reference: the matrix at index (1,) is not a pose")):
        wam7.impedance_torque(**pose, reference=np.stack([np.eye(4), TURNED]), stiffness=np.ones(6))
    with pytest.raises(ValueError, match=re.escape("stiffness: expected shape (6,) or (..., 6), got ()")):
        wam7.impedance_torque(**pose, reference=np.eye(4), stiffness=5.0)


def test_out_is_filled_and_empty_batches_stay_empty():
    out = np.full((2, 4), np.nan)
    assert WAM4.impedance_torque(**VALID, out=out) is out
    np.testing.assert_array_equal(out, WAM4.impedance_torque(**VALID))
    empty = {**VALID, "q": np.zeros((0, 4))}
    assert WAM4.impedance_torque(**empty).shape == (0, 4)
    assert WAM4.impedance_terms(**empty)["stiffness"].shape == (0, 4)


def test_the_gil_is_released_during_a_call():
    """Another thread counts while a call runs, which needs the released lock."""
    q = np.random.default_rng(0).normal(size=(200_000, 4))
    running, counted = threading.Event(), []

    def count():
        running.wait()
        n = 0
        while running.is_set():
            n += 1
        counted.append(n)

    thread = threading.Thread(target=count)
    thread.start()
    running.set()
    WAM4.impedance_torque(**{**VALID, "q": q})
    running.clear()
    thread.join()
    assert counted[0] > 100
