//! Property values that stand for modes, roles and limits.
#![no_main]

use supple_puck::safety::{SafetyMode, SpeedLimit};
use supple_puck::status::{MotorMode, Role, Stat};

libfuzzer_sys::fuzz_target!(|data: [u8; 4]| {
    let value = i32::from_le_bytes(data);
    let same = |found: i16| assert_eq!(i32::from(found), value);
    let _ = Stat::from_value(value).map(|stat| same(stat.value()));
    let _ = MotorMode::from_value(value).map(|mode| same(mode.value()));
    let _ = SafetyMode::from_value(value).map(|mode| same(mode.value()));
    let _ = SpeedLimit::from_value(value).map(|limit| same(limit.map_or(0, SpeedLimit::value)));
    let role = Role::from_value(value);
    assert!(role.role_type().is_ok() || role.kind().is_none());
});
