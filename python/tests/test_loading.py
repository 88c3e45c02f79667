"""Arms from names, paths and URDFs, and rejected input."""

from __future__ import annotations

import os
import pickle

import numpy as np
import pytest
import supple
from robots import random_urdf, write_random_urdf


@pytest.mark.parametrize("name", supple.assets())
def test_every_built_in_arm_loads(name):
    arm = supple.Arm.load(name)
    assert arm.name == name
    assert 3 <= arm.dof <= 7
    assert len(arm.friction) == len(arm.joint_names) == arm.dof
    assert arm.home_rad.shape == (arm.dof,)
    eigenvalues = np.linalg.eigvalsh(arm.mass_matrix(arm.home_rad))
    assert (eigenvalues > 0.0).all()


def test_an_arm_loads_from_its_files(tmp_path):
    arm = supple.Arm.load("wam4")
    (tmp_path / "arm.toml").write_text(arm.toml)
    (tmp_path / "arm.urdf").write_text(arm.urdf)
    for path in (tmp_path, tmp_path / "arm.toml", str(tmp_path)):
        assert supple.Arm.load(path) == arm


def test_unknown_names_and_paths_are_rejected():
    with pytest.raises(ValueError, match="no arm named `wam9` is built in; .*wam4"):
        supple.Arm.load("wam9")
    with pytest.raises(FileNotFoundError, match="nowhere/arm.toml"):
        supple.Arm.load("nowhere/arm.toml")
    with pytest.raises(FileNotFoundError, match="nowhere.urdf"):
        supple.Arm.from_urdf("nowhere.urdf")


def test_invalid_urdfs_are_rejected_with_file_element_and_value(tmp_path):
    path = tmp_path / "negative.urdf"
    text = random_urdf(3, 0)
    mass = text.split('<mass value="')[1].split('"')[0]
    path.write_text(text.replace(f'<mass value="{mass}"', '<mass value="-1"'))
    with pytest.raises(ValueError, match="negative.urdf.*link1.*-1"):
        supple.Arm.from_urdf(path)
    path.write_text("not XML")
    with pytest.raises(ValueError, match="negative.urdf"):
        supple.Arm.from_urdf(path)


def test_unsupported_urdf_elements_give_a_warning_or_are_rejected(tmp_path):
    path = write_random_urdf(tmp_path, 4, 1)
    plain = supple.Arm.from_urdf(path, strict=True)
    added = '<gazebo reference="link1"><mu1>0.2</mu1></gazebo><gazebo/></robot>'
    path.write_text(path.read_text().replace("</robot>", added))
    with pytest.warns(UserWarning, match=r"<gazebo> \(line .*first of 2") as caught:
        arm = supple.Arm.from_urdf(path)
    assert len(caught) == 1
    q = np.random.default_rng(0).normal(size=(5, 4))
    np.testing.assert_array_equal(arm.gravity(q), plain.gravity(q))
    with pytest.raises(ValueError, match="<gazebo>"):
        supple.Arm.from_urdf(path, strict=True)
    (tmp_path / "arm.toml").write_text(arm.toml)
    (tmp_path / "arm.urdf").write_text(arm.urdf)
    toml = (tmp_path / "arm.toml").read_text().replace(str(path), "arm.urdf")
    (tmp_path / "arm.toml").write_text(toml)
    with pytest.warns(UserWarning, match="<gazebo>"):
        supple.Arm.load(tmp_path)
    with pytest.raises(ValueError, match="<gazebo>"):
        supple.Arm.load(tmp_path, strict=True)


def test_special_files_are_rejected(tmp_path):
    fifo = tmp_path / "arm.urdf"
    os.mkfifo(fifo)
    for path in (fifo, "/dev/zero", tmp_path):
        with pytest.raises(OSError, match="not a regular file"):
            supple.Arm.from_urdf(path)
    toml = tmp_path / "arm.toml"
    os.mkfifo(toml)
    with pytest.raises(OSError, match="a FIFO"):
        supple.Arm.load(toml)
    with pytest.raises(OSError, match="a FIFO"):
        supple.read_log(fifo)


def test_arguments_of_from_urdf(tmp_path):
    path = write_random_urdf(tmp_path, 4, 1)
    with pytest.raises(ValueError, match="flange"):
        supple.Arm.from_urdf(path, tip="flange")
    with pytest.raises(ValueError, match=r"gravity: expected shape \(3,\), got \(2,\)"):
        supple.Arm.from_urdf(path, gravity=(0.0, -9.81))
    with pytest.raises(ValueError, match=r"armature: expected shape \(4,\), got \(3,\)"):
        supple.Arm.from_urdf(path, armature=[0.1] * 3)
    with pytest.raises(ValueError, match="gravity_m_per_s2"):
        supple.Arm.from_urdf(path, gravity=(0.0, 0.0, np.nan))


@pytest.mark.parametrize("limit", ["", '<limit effort="0" velocity="0"/>'])
def test_dynamics_need_no_joint_limits(tmp_path, limit):
    path = write_random_urdf(tmp_path, 4, 1)
    limited = supple.Arm.from_urdf(path)
    stated = '<limit lower="-3" upper="3" effort="100" velocity="5"/>'
    assert stated in path.read_text()
    path.write_text(path.read_text().replace(stated, limit))
    free = supple.Arm.from_urdf(path)
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 20, 4))
    np.testing.assert_array_equal(free.rnea(q, qd, qdd), limited.rnea(q, qd, qdd))
    half = path.read_text().replace("</joint>", '<limit lower="-1" velocity="1"/></joint>', 1)
    path.write_text(half.replace(limit, "", 1))
    with pytest.raises(ValueError, match="joint1.*without lower or upper"):
        supple.Arm.from_urdf(path)


def test_inertias_that_no_body_has_are_repaired_on_request(tmp_path):
    path = write_random_urdf(tmp_path, 4, 1)
    sound = supple.Arm.from_urdf(path, repair=True)
    assert sound.parameters.tolist() == supple.Arm.from_urdf(path).parameters.tolist()
    text = path.read_text()
    begin = text.index("<inertia ", text.index('name="link3"'))
    # The moments about y and z add up to less than the one about x.
    wrong = '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.02"/>'
    path.write_text(text[:begin] + wrong + text[text.index("/>", begin) + 2 :])
    with pytest.raises(ValueError, match=r"link `link3` .*point_mass_radius_m.*repair=True") as raised:
        supple.Arm.from_urdf(path)
    assert "--repair" not in str(raised.value) and "TOML" not in str(raised.value)
    with pytest.warns(UserWarning, match="link `link3` .*0.1") as caught:
        arm = supple.Arm.from_urdf(path, repair=True)
    assert len(caught) == 1
    with pytest.raises(ValueError, match="link `link3`"):
        supple.Arm.from_urdf(path, repair=True, strict=True)
    # Mass and centre of mass stay, and the arm has a mass matrix that a body has.
    np.testing.assert_array_equal(arm.parameters.reshape(4, 10)[:, :4], sound.parameters.reshape(4, 10)[:, :4])
    poses = np.random.default_rng(0).normal(size=(20, 4))
    assert (np.linalg.eigvalsh(arm.mass_matrix(poses)) > 0.0).all()
    # An arm that was pickled needs no repair again.
    assert pickle.loads(pickle.dumps(arm)) == arm


def test_joints_that_do_not_carry_the_tip_need_not_be_listed(tmp_path):
    path = write_random_urdf(tmp_path, 4, 1)
    finger = (
        '<link name="finger"><inertial><origin xyz="0.1 0 0"/><mass value="0.2"/>'
        '<inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>'
        '<joint name="grip" type="revolute"><parent link="link4"/><child link="finger"/><axis xyz="0 0 1"/>'
        '<limit lower="0.2" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    path.write_text(path.read_text().replace("</robot>", finger))
    with pytest.warns(UserWarning, match="`grip` at 0.2") as caught:
        arm = supple.Arm.from_urdf(path)
    assert len(caught) == 1 and arm.dof == 4
    # At the end of its range that is closest to zero.
    q = np.random.default_rng(0).normal(size=(5, 4))
    np.testing.assert_array_equal(supple.Arm.from_urdf(path, fixed_joints_rad={"grip": 0.2}).gravity(q), arm.gravity(q))
    assert (supple.Arm.from_urdf(path, fixed_joints_rad={"grip": 0.9}).gravity(q) != arm.gravity(q)).any()
    with pytest.raises(ValueError, match="`grip`"):
        supple.Arm.from_urdf(path, strict=True)


def test_two_joints_are_too_few(tmp_path):
    with pytest.raises(ValueError, match="an arm of 2 moving joints is not supported"):
        supple.Arm.from_urdf(write_random_urdf(tmp_path, 2, 0))


def test_of_more_than_seven_joints_the_first_are_frozen(tmp_path):
    path = write_random_urdf(tmp_path, 8, 0)
    with pytest.warns(UserWarning, match="`joint1`: it is one more than the seven.*frozen") as caught:
        arm = supple.Arm.from_urdf(path)
    assert len(caught) == 1
    assert arm.joint_names == [f"joint{i}" for i in range(2, 9)]
    given = supple.Arm.from_urdf(path, fixed_joints_rad={"joint1": 0.0})
    q = np.random.default_rng(0).normal(size=(5, 7))
    np.testing.assert_array_equal(given.gravity(q), arm.gravity(q))
    with pytest.raises(ValueError, match="it is frozen"):
        supple.Arm.from_urdf(path, strict=True)


def test_a_fixed_joint_merges_its_links(tmp_path):
    path = write_random_urdf(tmp_path, 5, 2)
    whole = supple.Arm.from_urdf(path)
    frozen = supple.Arm.from_urdf(path, fixed_joints_rad={"joint3": 0.7})
    assert frozen.joint_names == ["joint1", "joint2", "joint4", "joint5"]
    q = np.random.default_rng(0).normal(size=(10, 4))
    full = np.insert(q, 2, 0.7, axis=1)
    np.testing.assert_allclose(frozen.tip_pose(q), whole.tip_pose(full), atol=1e-12)
    expected = np.delete(whole.gravity(full), 2, axis=1)
    np.testing.assert_allclose(frozen.gravity(q), expected, atol=1e-12)


def planar_urdf(limit):
    """Four links of half a kilogram each about a vertical and three horizontal axes."""
    parts = ['<robot name="four"><link name="base"/>']
    parent = "base"
    for i, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0"), start=1):
        parts.append(
            f'<link name="link{i}"><inertial><origin xyz="0 0 0.12"/><mass value="0.5"/>'
            '<inertia ixx="0.003" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.0006"/></inertial></link>'
            f'<joint name="joint{i}" type="revolute"><parent link="{parent}"/><child link="link{i}"/>'
            f'<origin xyz="0 0 0.25"/><axis xyz="{axis}"/>{limit}'
            '<dynamics damping="0.05" friction="0.1"/></joint>'
        )
        parent = f"link{i}"
    parts.append(
        f'<link name="tip"/><joint name="tip_joint" type="fixed"><parent link="{parent}"/>'
        '<child link="tip"/><origin xyz="0 0 0.25"/></joint></robot>'
    )
    return "".join(parts)


LIMIT = '<limit lower="-2.5" upper="2.5" effort="30" velocity="4"/>'


def test_an_arm_from_a_urdf_can_be_simulated(tmp_path):
    path = tmp_path / "four.urdf"
    path.write_text(planar_urdf(LIMIT))
    arm = supple.Arm.from_urdf(path)
    np.testing.assert_array_equal(arm.armature, 0.0)
    with pytest.warns(UserWarning, match=r"four: \d+ settings .* derived.*rotor inertias of 4 joints are estimates"):
        by_itself = supple.simulate(arm, "sinusoid", duration_s=1.0, stiffness_n_per_m=200.0)
    whole = arm.completed()
    assert (whole.armature > 0.0).all() and "an estimate" in whole.toml
    assert whole.completed() == whole
    assert pickle.loads(pickle.dumps(arm)).completed() == whole
    run = supple.simulate(whole, "sinusoid", duration_s=1.0, stiffness_n_per_m=200.0)
    np.testing.assert_array_equal(run.tau, by_itself.tau)
    assert run.ended is None and run.max_error_m < 5e-3
    # The torque limit is that of the URDF, and it is enough.
    assert 0.1 < np.abs(run.tau).max() < 30.0
    system = supple.simulated(whole, stiffness_n_per_m=200.0)
    system.hold()
    start = system.state.reference_position_m
    system.line(start + [0.0, 0.01, 0.01], 1.0)
    state = system.wait(0.5)
    assert (state.mode, state.fault) == ("track", None)
    np.testing.assert_allclose(state.tip_position_m, start + [0.0, 0.01, 0.01], atol=5e-3)


def test_a_simulation_needs_limits_of_torque_and_speed(tmp_path):
    path = tmp_path / "four.urdf"
    for limit in ("", LIMIT.replace('velocity="4"', ""), LIMIT.replace('effort="30"', 'effort="0"')):
        path.write_text(planar_urdf(LIMIT).replace(LIMIT, limit, 1))
        arm = supple.Arm.from_urdf(path)
        for call in (arm.completed, lambda arm=arm: supple.simulate(arm), lambda arm=arm: supple.simulated(arm)):
            with pytest.raises(ValueError, match="four: joint `joint1`: .*no limit of torque or of speed.*<limit"):
                call()


@pytest.mark.parametrize("name", supple.assets())
def test_built_in_arms_can_be_simulated(name):
    run = supple.simulate(supple.Arm.load(name), "sinusoid", duration_s=0.2)
    assert run.ended is None


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_an_arm_from_a_denavit_hartenberg_table(convention, tmp_path):
    def about(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        turned = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}
        pose = np.eye(4)
        pose[:3, :3] = turned[axis]
        return pose

    def along(x, z):
        pose = np.eye(4)
        pose[:3, 3] = [x, 0, z]
        return pose

    random = np.random.default_rng(4)
    table, q = random.uniform(-1, 1, (5, 4)), random.uniform(-2, 2, 5)
    pose = np.eye(4)
    for (a, alpha, d, theta), angle in zip(table, q, strict=True):
        steps = [about("z", theta + angle), along(0, d), along(a, 0), about("x", alpha)]
        if convention == "modified":
            steps = [about("x", alpha), along(a, 0), about("z", theta + angle), along(0, d)]
        for step in steps:
            pose = pose @ step
    file = tmp_path / "arm.urdf"
    file.write_text(supple.dh_to_urdf(table, convention, masses_kg=[1, 2, 3, 4, 5], name="five"))
    arm = supple.Arm.from_urdf(file, tip="tool0")
    assert arm.dof == 5
    np.testing.assert_allclose(arm.tip_pose(q), pose, atol=1e-12)


def test_wrong_denavit_hartenberg_tables_are_rejected():
    row = [0.0, 0.0, 0.1, 0.0]
    with pytest.raises(ValueError, match=r"table: expected shape \(N, 4\).*got \(2, 3\)"):
        supple.dh_to_urdf(np.zeros((2, 3)), "standard")
    with pytest.raises(ValueError, match="convention: expected 'standard' or 'modified', got 'craig'"):
        supple.dh_to_urdf([row], "craig")
    with pytest.raises(ValueError, match=r"masses_kg: expected shape \(1,\)"):
        supple.dh_to_urdf([row], "standard", masses_kg=[1, 2])
    with pytest.raises(ValueError, match="table: row 1, mass_kg: found 0"):
        supple.dh_to_urdf([row], "standard", masses_kg=[0])
    with pytest.raises(ValueError, match="table: row 1, a_m: found NaN"):
        supple.dh_to_urdf([[np.nan, 0, 0, 0]], "modified")
