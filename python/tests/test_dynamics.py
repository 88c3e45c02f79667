"""Dynamics compared with Pinocchio, on random arms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import supple
from robots import write_random_urdf

pin = pytest.importorskip("pinocchio")

SAMPLES = 25
GRAVITY = (0.3, -1.2, -9.6)
# Pinocchio orders the parameters as supple does: m, mc, Ixx, Ixy, Iyy, Ixz, Iyz, Izz.
TOLERANCE = 1e-10


@pytest.fixture(params=[(dof, seed) for dof in range(3, 8) for seed in range(4)], ids=str)
def case(request, tmp_path):
    """An arm, its Pinocchio model, and random states."""
    dof, seed = request.param
    path = write_random_urdf(tmp_path, dof, seed)
    rng = np.random.default_rng([dof, seed])
    armature = rng.uniform(0.0, 0.3, size=dof)
    model = pin.buildModelFromUrdf(str(path))
    model.gravity.linear = np.array(GRAVITY)
    model.armature = armature
    return SimpleNamespace(
        arm=supple.Arm.from_urdf(path, tip="tip", gravity=GRAVITY, armature=armature),
        model=model,
        data=model.createData(),
        tip=model.getFrameId("tip"),
        q=rng.uniform(-3.0, 3.0, size=(SAMPLES, dof)),
        qd=rng.normal(scale=2.0, size=(SAMPLES, dof)),
        qdd=rng.normal(scale=5.0, size=(SAMPLES, dof)),
    )


def agree(ours: np.ndarray, theirs: list[np.ndarray]) -> None:
    reference = np.stack(theirs)
    assert ours.shape == reference.shape
    scale = 1.0 + np.abs(reference).max()
    np.testing.assert_allclose(ours, reference, rtol=0.0, atol=TOLERANCE * scale)


def test_description(case):
    dof = case.model.nv
    assert case.arm.dof == dof
    assert case.arm.joint_names == list(case.model.names)[1:]
    np.testing.assert_array_equal(case.arm.gravity_m_per_s2, GRAVITY)
    np.testing.assert_array_equal(case.arm.armature, case.model.armature)
    reference = np.concatenate([i.toDynamicParameters() for i in list(case.model.inertias)[1:]])
    agree(case.arm.parameters, list(reference))


def test_rnea(case):
    states = zip(case.q, case.qd, case.qdd, strict=True)
    agree(
        case.arm.rnea(case.q, case.qd, case.qdd),
        [pin.rnea(case.model, case.data, *state).copy() for state in states],
    )


def test_mass_matrix(case):
    def reference(q):
        upper = np.triu(pin.crba(case.model, case.data, q))
        return upper + np.triu(upper, 1).T

    agree(case.arm.mass_matrix(case.q), [reference(q) for q in case.q])


def test_gravity(case):
    agree(
        case.arm.gravity(case.q),
        [pin.computeGeneralizedGravity(case.model, case.data, q).copy() for q in case.q],
    )


def test_forward_dynamics(case):
    states = zip(case.q, case.qd, case.qdd, strict=True)
    agree(
        case.arm.forward_dynamics(case.q, case.qd, case.qdd),
        [pin.aba(case.model, case.data, *state).copy() for state in states],
    )


def test_coriolis(case):
    states = list(zip(case.q, case.qd, strict=True))
    matrices = [pin.computeCoriolisMatrix(case.model, case.data, *s).copy() for s in states]
    agree(case.arm.coriolis_matrix(case.q, case.qd), matrices)
    agree(
        case.arm.coriolis(case.q, case.qd),
        [c @ qd for c, qd in zip(matrices, case.qd, strict=True)],
    )


def test_tip_pose(case):
    def reference(q):
        pin.framesForwardKinematics(case.model, case.data, q)
        return case.data.oMf[case.tip].homogeneous.copy()

    agree(case.arm.tip_pose(case.q), [reference(q) for q in case.q])


def test_jacobian(case):
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    agree(
        case.arm.jacobian(case.q),
        [pin.computeFrameJacobian(case.model, case.data, q, case.tip, axes) for q in case.q],
    )


def test_jacobian_dot_qd(case):
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def reference(q, qd):
        pin.forwardKinematics(case.model, case.data, q, qd, np.zeros(case.model.nv))
        acceleration = pin.getFrameClassicalAcceleration(case.model, case.data, case.tip, axes)
        return acceleration.vector.copy()

    states = zip(case.q, case.qd, strict=True)
    agree(case.arm.jacobian_dot_qd(case.q, case.qd), [reference(*state) for state in states])


def test_regressor(case):
    states = zip(case.q, case.qd, case.qdd, strict=True)
    regressors = [
        pin.computeJointTorqueRegressor(case.model, case.data, *state).copy() for state in states
    ]
    ours = case.arm.regressor(case.q, case.qd, case.qdd)
    agree(ours, regressors)
    tau = ours @ case.arm.parameters + case.arm.armature * case.qdd
    agree(tau, list(case.arm.rnea(case.q, case.qd, case.qdd)))
