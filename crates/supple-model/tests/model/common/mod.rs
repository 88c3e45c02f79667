//! A small arm whose texts the tests modify: three joints, a fixed flange, a gripper finger outside the chain whose
//! joint the TOML fixes.

use supple_model::{Description, ModelError};

pub const URDF: &str = r#"<?xml version="1.0"?>
<robot name="small">
  <link name="base"/>
  <link name="link1">
    <inertial>
      <origin xyz="0 0 0.1" rpy="0 0 0"/>
      <mass value="2.0"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="link2">
    <inertial>
      <origin xyz="0.2 0 0" rpy="0 0 0"/>
      <mass value="1.5"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <link name="link3">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 0"/>
      <mass value="1.0"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="flange">
    <inertial>
      <origin xyz="0 0 0.02" rpy="0.3 0 0"/>
      <mass value="0.3"/>
      <inertia ixx="0.0003" ixy="0" ixz="0" iyy="0.0002" iyz="0" izz="0.0004"/>
    </inertial>
  </link>
  <link name="finger">
    <inertial>
      <origin xyz="0.03 0 0" rpy="0 0 0"/>
      <mass value="0.1"/>
      <inertia ixx="0.00001" ixy="0" ixz="0" iyy="0.00003" iyz="0" izz="0.00003"/>
    </inertial>
  </link>
  <link name="tip"/>
  <joint name="yaw" type="continuous">
    <parent link="base"/><child link="link1"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/>
    <axis xyz="0 0 2"/>
    <limit effort="50" velocity="3"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <parent link="link1"/><child link="link2"/>
    <origin xyz="0 0 0.2" rpy="0 0 0"/>
    <axis xyz="0 -1 0"/>
    <limit lower="-1.5" upper="1.5" effort="40" velocity="2"/>
    <dynamics damping="0.7" friction="0.4"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="link2"/><child link="link3"/>
    <origin xyz="0.4 0 0" rpy="0 0 0"/>
    <axis xyz="0 -1 0"/>
    <limit lower="-2.5" upper="2.5" effort="20" velocity="2"/>
  </joint>
  <joint name="flange_joint" type="fixed">
    <parent link="link3"/><child link="flange"/>
    <origin xyz="0.25 0 0" rpy="0 1.2 0"/>
  </joint>
  <joint name="finger_joint" type="revolute">
    <parent link="flange"/><child link="finger"/>
    <origin xyz="0 0.02 0.03" rpy="0 0 0.4"/>
    <axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="0.5" effort="5" velocity="2"/>
  </joint>
  <joint name="tip_joint" type="fixed">
    <parent link="flange"/><child link="tip"/>
    <origin xyz="0 0 0.05" rpy="0 0 0"/>
  </joint>
</robot>
"#;

pub const TOML: &str = r#"name = "small"
urdf = "small.urdf"
tip_frame = "tip"
home_rad = [0.0, 0.5, 0.2]

[fixed_joints_rad]
finger_joint = 0.3

[[joints]]
name = "elbow"
held = { position_rad = 0.2, stiffness_nm_per_rad = 100.0, damping_nm_s_per_rad = 3.0 }
friction = { viscous_nm_s_per_rad = 0.5, coulomb_nm = 0.2 }
torque_nm = 15.0

[motors]
joint_from_motor = [[0.1, 0.0, 0.0], [0.0, 0.05, -0.05], [0.0, 0.1, 0.1]]
torque_nm = [5.0, 2.0, 2.0]
torque_quantum_nm = [0.001, 0.001, 0.002]
counts_per_revolution = 4096

[tool]
mass_kg = 0.2
com_m = [0.0, 0.0, -0.01]
inertia_kg_m2 = [1e-4, 1e-4, 1.5e-4, 0.0, 0.0, 0.0]
cap_radius_m = 0.02

[limits]
soft_zone_rad = 0.2

[law]
stiffness_n_per_m = [5.0, 6.0, 7.0]

[latch]
threshold_n = 2.0
"#;

/// The text with one fragment replaced, which must occur exactly once.
pub fn with(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "`{from}` is not there once");
    text.replace(from, to)
}

pub fn with_urdf(from: &str, to: &str) -> Result<Description, ModelError> {
    Description::from_text(TOML, &with(URDF, from, to))
}

pub fn with_toml(from: &str, to: &str) -> Result<Description, ModelError> {
    Description::from_text(&with(TOML, from, to), URDF)
}
