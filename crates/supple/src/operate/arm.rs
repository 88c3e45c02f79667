//! Determines the arm for a command to a running system.

use crate::cli::SystemArgs;
use crate::up::running_arm;
use supple_cli::arguments::UrdfArgs;
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_ipc::message::Telemetry;
use supple_model::Description;

/// Arm of a system that was not started by `supple up`: the default of its processes.
const DEFAULT_ARM: &str = "wam4";

/// Returns the arm for a command to a running system: the given arm, or the arm of its `supple up`.
pub fn arm_of(domain: &Domain, given: Option<&str>, urdf: &UrdfArgs) -> String {
    let of_system = || running_arm(domain).unwrap_or_else(|| DEFAULT_ARM.to_owned());
    urdf.name(&given.map_or_else(of_system, str::to_owned))
}

/// Returns the arm as [`arm_of`] does, from the prefix of the system.
///
/// # Errors
/// [`Failure::System`].
pub(super) fn arm_of_system(
    system: &SystemArgs,
    given: Option<&str>,
    urdf: &UrdfArgs,
) -> Result<String, Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    Ok(arm_of(&domain, given, urdf))
}

/// Whether the arm can be that of the running system.
///
/// # Errors
/// [`Failure::OtherArm`] with the name of its arm, if it is known.
pub(super) fn check_arm(
    domain: &Domain,
    arm: &str,
    description: &Description,
    telemetry: &Telemetry,
) -> Result<(), Failure> {
    let running = usize::from(telemetry.state.dof);
    if running == description.dof() {
        return Ok(());
    }
    Err(Failure::OtherArm {
        arm: arm.to_owned(),
        joints: description.dof(),
        running,
        named: running_arm(domain).unwrap_or_else(|| "NAME".to_owned()),
    })
}
