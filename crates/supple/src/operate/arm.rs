//! Determines the arm for a command to a running system.

use crate::cli::SystemArgs;
use crate::up::RunningSystem;
use supple_cli::arguments::UrdfArgs;
use supple_cli::arms::DEFAULT_ARM;
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_ipc::message::Telemetry;
use supple_model::Description;

/// Returns the arm for a command to a running system: the given arm, or the arm of its `supple up`.
pub fn arm_of(domain: &Domain, given: Option<&str>, urdf: &UrdfArgs) -> String {
    let of_system = || arm_of_running(domain).unwrap_or_else(|| DEFAULT_ARM.to_owned());
    urdf.name(&given.map_or_else(of_system, str::to_owned))
}

/// Returns the arm of a running system in the form for `--arm`; `None` if the system was not started by `supple up`.
fn arm_of_running(domain: &Domain) -> Option<String> {
    RunningSystem::of(domain)?.arm
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

/// Checks that the arm can be the arm of the running system: both have the same number of joints, and joints of the same names if
/// the arm of the system is known.
///
/// # Errors
/// [`Failure::OtherArm`] with the name of the arm of the running system, if it is known.
pub(super) fn check_arm(
    domain: &Domain,
    arm: &str,
    description: &Description,
    telemetry: &Telemetry,
) -> Result<(), Failure> {
    let named = arm_of_running(domain);
    let joints = usize::from(telemetry.state.dof);
    let differs = |joints: String, running: String| Failure::OtherArm {
        arm: arm.to_owned(),
        joints,
        running,
        named: named.clone().unwrap_or_else(|| "NAME".to_owned()),
    };
    if joints != description.dof() {
        let count = |joints: usize| format!("{joints} joints");
        return Err(differs(count(description.dof()), count(joints)));
    }
    let running = named.as_deref().map(Description::find);
    match running {
        Some(Ok(running)) if running.joint_names() != description.joint_names() => {
            let names = |of: &Description| format!("the joints {}", of.joint_names().join(", "));
            Err(differs(names(description), names(&running)))
        }
        _ => Ok(()),
    }
}
