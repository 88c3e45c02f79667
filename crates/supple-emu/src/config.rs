//! Configuration of an emulated WAM: settings of its pucks and safety module, by default those of Barrett's programs, and
//! parameters of the emulation.

use supple_puck::status::Role;

/// One millisecond in nanoseconds.
pub(crate) const MS: u64 = 1_000_000;

/// Configuration of a motor puck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PuckConfig {
    /// Firmware version; 175 by default, which has the newest table of property ids.
    pub version: i32,
    /// Role; a WAM motor with a magnetic encoder by default.
    pub role: Role,
    /// Puck torque units per N m at the motor.
    pub units_per_nm: i32,
    /// Maximum torque that the puck applies \[puck units\].
    pub max_torque: i32,
    /// Poles of the motor, which identify the motor type.
    pub poles: i32,
    /// Encoder counts per revolution.
    pub counts_per_revolution: i32,
    /// Multicast groups to which the puck listens, as stored in its EEPROM.
    pub groups: [u8; 3],
    /// Slot in the packed torque frame, from 1.
    pub slot: i32,
    /// Temperature \[degrees Celsius\]; 30 by default.
    pub temperature: i32,
    /// Whether the node is on the bus; true by default.
    pub present: bool,
}

impl PuckConfig {
    /// Returns the configuration of the puck of joint `number`, 1 to 7, of a WAM. Units, limits and poles are Barrett's defaults
    /// (btutil, btdiag).
    pub fn wam(number: usize) -> PuckConfig {
        let (units_per_nm, poles) = match number {
            1..=4 => (2700, 12),
            5 | 6 => (6500, 8),
            _ => (17_474, 6),
        };
        let lower = number <= 4;
        PuckConfig {
            version: 175,
            role: Role::ARM_MOTOR,
            units_per_nm,
            max_torque: match number {
                1..=3 => 4860,
                4 => 4320,
                5 | 6 => 3900,
                _ => 1600,
            },
            poles,
            counts_per_revolution: 4096,
            groups: if lower { [0, 1, 4] } else { [0, 2, 4] },
            slot: if lower { number } else { number - 4 } as i32,
            temperature: 30,
            present: true,
        }
    }
}

/// Configuration of the safety module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyConfig {
    /// Firmware version; 175 by default.
    pub version: i32,
    /// Time without a position of an arm puck after which the safety module sets all motors to idle \[ns\]; 100 ms by default,
    /// the longest receive timeout of OWD (OpenWAM's driver). The real value is not published.
    pub heartbeat_ns: u64,
    /// Time within which the arm must slow down after a velocity fault to avoid an emergency stop \[ns\]; 0.5 s
    /// as documented.
    pub slow_down_ns: u64,
    /// Bus voltage \[V\]; 48 by default.
    pub voltage: i32,
    /// Whether the node is on the bus; true by default.
    pub present: bool,
}

/// Configuration of the emulated arm.
#[derive(Clone, Debug, PartialEq)]
pub struct EmulatorConfig {
    /// Motor pucks, in the order of the joints.
    pub pucks: Vec<PuckConfig>,
    /// Safety module.
    pub safety: SafetyConfig,
    /// Whether a force/torque sensor is mounted; true by default.
    pub force_sensor: bool,
    /// Whether the arm has its position reference, as after a run of another program: the counts match the joint angles and ZERO
    /// is 1. False by default: the counts start at 0 in any pose.
    pub zeroed: bool,
    /// Whether a cradle holds the arm in its start pose until any motor enters torque mode; true by default. Without a
    /// cradle the arm sinks against the braking motors from the start.
    pub cradle: bool,
    /// Time between a frame's end and a node's answer to it \[ns\]; 10 us by default, an assumption.
    pub latency_ns: u64,
    /// Maximum random addition to the latency \[ns\]; 5 us by default, an assumption.
    pub jitter_ns: u64,
    /// Time from "set STAT" until a puck is ready \[ns\]; 0.8 s by default, within the 1 s that libbarrett
    /// waits.
    pub wake_ns: u64,
    /// Time after "set STAT" at which the puck's transceiver begins to reset \[ns\]; 0.2 s by default, an assumption. From then
    /// until the puck is ready, every frame of the host makes the host's CAN controller go bus-off.
    pub transceiver_reset_ns: u64,
    /// Time of the bus-off recovery, the interface's `restart-ms` \[ns\]; 100 ms by default.
    pub restart_ns: u64,
    /// Step of the physics \[ns\]; 0.2 ms by default. Encoders are read and torques act on this grid.
    pub step_ns: u64,
    /// Seed of the jitter.
    pub seed: u64,
}

impl EmulatorConfig {
    /// Returns the configuration of a WAM with `joints` joints.
    pub fn wam(joints: usize) -> EmulatorConfig {
        EmulatorConfig {
            pucks: (1..=joints).map(PuckConfig::wam).collect(),
            safety: SafetyConfig {
                version: 175,
                heartbeat_ns: 100 * MS,
                slow_down_ns: 500 * MS,
                voltage: 48,
                present: true,
            },
            force_sensor: true,
            zeroed: false,
            cradle: true,
            latency_ns: 10_000,
            jitter_ns: 5_000,
            wake_ns: 800 * MS,
            transceiver_reset_ns: 200 * MS,
            restart_ns: 100 * MS,
            step_ns: MS / 5,
            seed: 0,
        }
    }
}
