//! The arms on which the fault tests run.

use super::spec::{Spec, TestTask};
use crate::cli::{DrillArgs, PlantKind};
use std::path::PathBuf;
use supple_cli::arms;
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_model::Description;

/// Arm of the pose mode if the arm of the command line has too few joints.
const POSE_ARM: &str = "wam7";
/// Number of joints that the pose mode needs.
const POSE_JOINTS: usize = 6;
/// Control rate of the pose mode on the emulated bus \[Hz\].
const POSE_BUS_RATE_HZ: u32 = 700;

/// The arm of a test case.
pub(super) struct TestArm {
    pub(super) description: Description,
    /// Name or path of the arm, for the processes.
    pub(super) name: String,
    pub(super) strict: bool,
    pub(super) rate_hz: Option<u32>,
}

/// The arm of the command line, and the arm of the pose mode.
pub(super) struct TestArms {
    pub(super) general: TestArm,
    pub(super) pose: TestArm,
    /// Folder of the arm of the pose mode.
    pub(super) folder: PathBuf,
}

impl TestArms {
    /// Creates the arms. The pose mode needs six active joints: it uses the arm of the command line, otherwise [`POSE_ARM`],
    /// without held joints. The copy without held joints is in a temporary folder until the end.
    pub(super) fn new(args: &DrillArgs) -> Result<TestArms, Failure> {
        let description = arms::find(&args.urdf.name(&args.arm), args.strict)?;
        let free = match description.dof() >= POSE_JOINTS {
            true => description.with_all_joints_active()?,
            false => Description::asset(POSE_ARM)?.with_all_joints_active()?,
        };
        let prefix = format!("drill-arm-{}", std::process::id());
        let domain = Domain::new(Some(&prefix)).map_err(Failure::system)?;
        let folder = domain.folder().join(prefix);
        free.save(&folder)?;
        Ok(TestArms {
            general: TestArm {
                description,
                name: args.urdf.name(&args.arm),
                strict: args.strict,
                rate_hz: None,
            },
            pose: TestArm {
                description: Description::load(&folder)?,
                name: folder.display().to_string(),
                strict: args.strict,
                rate_hz: None,
            },
            folder,
        })
    }

    pub(super) fn of(&mut self, spec: &Spec) -> &TestArm {
        if spec.task != TestTask::TrackPose {
            return &self.general;
        }
        // The frames of seven motors do not fit into one millisecond.
        self.pose.rate_hz = (spec.plant == PlantKind::Emu).then_some(POSE_BUS_RATE_HZ);
        &self.pose
    }
}

impl Drop for TestArms {
    fn drop(&mut self) {
        // Errors are ignored: a copy that remains has no effect.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
