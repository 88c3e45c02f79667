//! `supple ros`: replaces this process with `supple-ros`, see there.

use crate::operate::arm_of;
use std::os::unix::process::CommandExt;
use std::process::Command;
use supple_cli::arguments::RosArgs;
use supple_cli::exit::Failure;
use supple_cli::sibling::program_beside;
use supple_ipc::Domain;

/// Program that contains the bridge.
const ROS: &str = "supple-ros";

/// Replaces this process with the bridge, for the arm of the running system. Returns only if that fails.
pub fn exec(args: &RosArgs) -> Failure {
    let domain = match Domain::new(args.prefix.as_deref()) {
        Ok(domain) => domain,
        Err(error) => return Failure::system(error),
    };
    let program = match program_beside(ROS) {
        Ok(program) => program,
        Err(failure) => return failure,
    };
    let mut command = Command::new(&program);
    // What follows `supple ros`.
    command.args(std::env::args_os().skip(2));
    if args.arm.is_none() {
        command.arg("--arm");
        command.arg(arm_of(&domain, None, &args.urdf));
    }
    Failure::file("start", &program, command.exec())
}
