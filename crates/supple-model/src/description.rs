//! A complete, validated arm description. The number of joints is dynamic here; [`Description::arm`] and
//! [`Description::config`] return the types of the core, in which it is a const parameter.

use crate::error::{Finding, ModelError, Reporter};
use crate::paths::Paths;
use crate::resolve::{self, BusDescription, JointResolved, Motors, Tool};
use crate::settings::Settings;
use crate::shapes::{self, Capsule, Transform};
use crate::tree::{self, Chain};
use crate::urdf_name::UrdfName;
use crate::{assets, xml};
use std::path::Path;
use supple_core::Friction;
use urdf_rs::Robot;

/// An arm, read from a URDF and a TOML. It can be constructed only from valid files.
#[derive(Clone, Debug)]
pub struct Description {
    pub(crate) settings: Settings,
    pub(crate) chain: Chain,
    pub(crate) joints: Vec<JointResolved>,
    pub(crate) toml_file: String,
    urdf_file: String,
    robot: Robot,
    names: Vec<String>,
    home_rad: Vec<f64>,
    friction: Vec<Friction>,
    motors: Motors,
    tool: Option<Tool>,
    bus: Option<BusDescription>,
    stow_rad: Option<Vec<f64>>,
    capsules: Vec<Capsule>,
    toml: String,
    urdf: String,
    pub(crate) warnings: Vec<Finding>,
}

impl Description {
    /// Maximum size of a URDF or TOML \[bytes\]: a hundred times that of any arm.
    pub const MAX_BYTES: u64 = 16 << 20;

    /// Reads an arm from its TOML, or from the folder that contains it as `arm.toml`.
    ///
    /// # Errors
    /// [`ModelError`] if either file cannot be read or is invalid.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ModelError> {
        let path = path.as_ref();
        let toml_path = if path.is_dir() {
            path.join("arm.toml")
        } else {
            path.to_owned()
        };
        let toml_file = toml_path.display().to_string();
        let toml = read(
            &toml_path,
            "give the TOML of an arm, or the folder that contains it as arm.toml",
        )?;
        let settings = parse_toml(&toml_file, &toml)?;
        let folder = toml_path.parent().unwrap_or(Path::new(""));
        let urdf_path = folder.join(&settings.urdf);
        let urdf = read(
            &urdf_path,
            "correct `urdf` in the TOML: it is relative to the TOML's folder",
        )?;
        Self::build(
            settings,
            toml_file,
            toml,
            urdf_path.display().to_string(),
            urdf,
        )
    }

    /// Reads a built-in arm by its name, or another arm by the path of its TOML or folder, or of its URDF, with the tip's
    /// link after a `#` ([`UrdfName`]).
    ///
    /// # Errors
    /// [`ModelError::UnknownAsset`] if it is neither, or as [`Description::load`].
    pub fn find(name_or_path: &str) -> Result<Self, ModelError> {
        if let Some(urdf) = UrdfName::parse(name_or_path) {
            return Self::from_urdf(&urdf);
        }
        let is_path = name_or_path.contains(['/', '\\', '.']) || Path::new(name_or_path).exists();
        if is_path && !assets::assets().contains(&name_or_path) {
            return Self::load(name_or_path);
        }
        Self::asset(name_or_path)
    }

    /// Does the same as [`Description::find`], and adds all settings that a controller needs ([`Description::completed`]);
    /// `rate_hz`, if given, replaces the control rate of the TOML \[Hz\].
    ///
    /// # Errors
    /// As [`Description::find`], [`Description::completed`] and [`Description::at_rate`].
    pub fn find_at_rate(name_or_path: &str, rate_hz: Option<u32>) -> Result<Self, ModelError> {
        let description = Self::find(name_or_path)?.completed()?.description;
        match rate_hz {
            Some(rate_hz) => description.at_rate(f64::from(rate_hz)),
            None => Ok(description),
        }
    }

    /// Reads a built-in arm, one of [`crate::assets`].
    ///
    /// # Errors
    /// [`ModelError::UnknownAsset`] with the known names.
    pub fn asset(name: &str) -> Result<Self, ModelError> {
        let (toml, urdf) = assets::text(name)?;
        let file = |end: &str| format!("assets/{name}/{end}");
        let settings = parse_toml(&file("arm.toml"), toml)?;
        Self::build(
            settings,
            file("arm.toml"),
            toml.into(),
            file("arm.urdf"),
            urdf.into(),
        )
    }

    /// Reads an arm from the texts of its two files, which a log contains, for example. Messages name them
    /// `arm.toml` and the file name that the TOML gives for the URDF.
    ///
    /// # Errors
    /// [`ModelError`] if either text is invalid.
    pub fn from_text(toml: &str, urdf: &str) -> Result<Self, ModelError> {
        let settings = parse_toml("arm.toml", toml)?;
        let urdf_file = settings.urdf.clone();
        Self::build(
            settings,
            "arm.toml".into(),
            toml.into(),
            urdf_file,
            urdf.into(),
        )
    }

    /// Does the same as [`Description::from_text`], with a name of the URDF for messages.
    pub(crate) fn from_named_text(
        toml: &str,
        urdf_file: &str,
        urdf: &str,
    ) -> Result<Self, ModelError> {
        let settings = parse_toml(urdf_file, toml)?;
        Self::build(
            settings,
            urdf_file.to_owned(),
            toml.to_owned(),
            urdf_file.to_owned(),
            urdf.to_owned(),
        )
    }

    fn build(
        settings: Settings,
        toml_file: String,
        toml: String,
        urdf_file: String,
        urdf: String,
    ) -> Result<Self, ModelError> {
        let in_urdf = Reporter { file: &urdf_file };
        let in_toml = Reporter { file: &toml_file };
        let urdf = xml::declare_prefixes(urdf);
        let checked = xml::check(in_urdf, &urdf)?;
        let mut robot =
            urdf_rs::read_from_string(&checked.text).map_err(|error| ModelError::Syntax {
                file: urdf_file.clone(),
                message: error.to_string(),
                remedy: "correct the URDF",
            })?;
        if let Some(radius_m) = settings.point_mass_radius_m {
            in_toml.positive("point_mass_radius_m", radius_m)?;
            in_toml.within("point_mass_radius_m", radius_m, 1e-6..=10.0, "m")?;
            tree::set_point_mass_inertia(&mut robot, radius_m);
        }
        resolve::check_names(in_toml, &settings, &robot)?;
        let chain = tree::chain(
            in_urdf,
            in_toml,
            &robot,
            &tree::ChainSettings {
                tip_frame: &settings.tip_frame,
                fixed: &settings.fixed_joints_rad,
                // If the TOML lists joints, their number is given.
                freeze_on_path: settings.joints.is_empty() && settings.home_rad.is_none(),
                repair: settings.repair_inertia,
            },
        )?;
        resolve::check_rest(in_toml, &settings)?;
        let joints = resolve::joints(in_urdf, in_toml, &settings, &robot, &chain)?;
        let motors = resolve::motors(in_toml, &settings, &joints)?;
        let tool = resolve::tool(in_toml, &settings)?;
        let bus = resolve::bus(in_toml, &settings, &joints)?;
        let stow_rad = resolve::stow(in_toml, &settings, &joints)?;
        let mut warnings = checked.warnings;
        warnings.extend(chain.warnings.iter().cloned());
        Ok(Self {
            names: joints.iter().map(|joint| joint.name.clone()).collect(),
            home_rad: joints.iter().map(|joint| joint.home_rad).collect(),
            friction: joints.iter().map(|joint| joint.friction).collect(),
            capsules: shapes::capsules(&robot, &chain),
            settings,
            chain,
            joints,
            toml_file,
            urdf_file,
            robot,
            motors,
            tool,
            bus,
            stow_rad,
            toml,
            urdf,
            warnings,
        })
    }

    /// Returns the ignored content of the URDF, each kind once with its first occurrence: Gazebo's elements, `mu_coulomb`, an
    /// `<origin>` of a link. Dynamics and limits do not depend on this content; unknown content that could change them is
    /// rejected. Then follow the joints that were frozen, the inertias that were replaced and the tip that was chosen without
    /// an entry in the TOML or a request of the caller. Empty for the built-in arms.
    pub fn warnings(&self) -> &[Finding] {
        &self.warnings
    }

    /// Returns the arm if no content of its URDF was ignored.
    ///
    /// # Errors
    /// [`ModelError::Strict`] with all [`Description::warnings`].
    pub fn strict(self) -> Result<Self, ModelError> {
        match self.warnings.is_empty() {
            true => Ok(self),
            false => Err(ModelError::Strict {
                findings: self.warnings,
            }),
        }
    }

    /// Applies [`Description::strict`] if `strict` is set.
    ///
    /// # Errors
    /// As [`Description::strict`].
    pub fn strict_if(self, strict: bool) -> Result<Self, ModelError> {
        match strict {
            true => self.strict(),
            false => Ok(self),
        }
    }

    /// Returns the same arm with another control rate \[Hz\]; the period is rounded to whole nanoseconds. If the damping of
    /// gravity hold or of held joints is unstable with the longer delay of a lower rate, it is reduced, with the stiffness
    /// of held joints.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a rate outside 10 Hz to 10 kHz.
    pub fn at_rate(mut self, rate_hz: f64) -> Result<Self, ModelError> {
        let file = &self.toml_file;
        let report = Reporter { file };
        report.positive("the control rate (Hz)", rate_hz)?;
        report.within("the control rate (Hz)", rate_hz, 10.0..=1e4, "Hz")?;
        let period_s = (1e9 / rate_hz).round() * 1e-9;
        let slower = period_s > self.settings.period_s;
        self.settings.period_s = period_s;
        if slower {
            // An arm with a number of joints that no controller supports keeps its values, because its configuration is an error.
            let shares = crate::with_dof!(self.dof(), N => self.allowed_damping_shares::<N>());
            self.reduce_damping(shares.unwrap_or([1.0; 2]));
        }
        Ok(self)
    }

    /// Returns the name of the arm.
    pub fn name(&self) -> &str {
        &self.settings.name
    }

    /// Returns the number of moving joints, including held joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Returns the names of the moving joints, from the base to the tip.
    pub fn joint_names(&self) -> &[String] {
        &self.names
    }

    /// Returns the text of the URDF, unchanged except for added declarations of missing XML prefixes.
    pub fn urdf(&self) -> &str {
        &self.urdf
    }

    /// Returns the text of the TOML, unchanged.
    pub fn toml(&self) -> &str {
        &self.toml
    }

    /// Returns the parsed TOML, with the defaults of missing sections.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the home pose, one angle per joint \[rad\].
    pub fn home_rad(&self) -> &[f64] {
        &self.home_rad
    }

    /// Returns the pose in which the arm stays without torque, one angle per joint \[rad\]; `None` if the TOML gives none.
    pub fn stow_rad(&self) -> Option<&[f64]> {
        self.stow_rad.as_deref()
    }

    /// Returns the settings of the drives on their bus; `None` if the TOML has no `[bus]`.
    pub fn bus(&self) -> Option<&BusDescription> {
        self.bus.as_ref()
    }

    /// Returns whether the arm falls without torque: motors on a `[bus]` have no brakes, while the motors of a WAM brake when
    /// shorted.
    pub fn falls_without_torque(&self) -> bool {
        self.bus.is_some()
    }

    /// Returns for each joint whether the impedance law acts on it: the law acts on joints that the TOML does not hold.
    pub fn active_joints(&self) -> Vec<bool> {
        self.joints
            .iter()
            .map(|joint| joint.held.is_none())
            .collect()
    }

    /// Returns the friction of each joint.
    pub fn friction(&self) -> &[Friction] {
        &self.friction
    }

    /// Returns motors and transmission.
    pub fn motors(&self) -> &Motors {
        &self.motors
    }

    /// Returns whether the TOML describes the motors, in `[motors]`.
    pub fn describes_motors(&self) -> bool {
        self.settings.motors.is_some()
    }

    /// Returns place and size of the trajectories, from the TOML or else from the paper.
    pub fn paths(&self) -> Paths {
        self.settings.paths.map_or(Paths::PAPER, Paths::from)
    }

    /// Returns the tool at the tip.
    pub fn tool(&self) -> Option<Tool> {
        self.tool
    }

    /// Returns simple shapes of the links, for drawing.
    pub fn capsules(&self) -> &[Capsule] {
        &self.capsules
    }

    /// Returns the pose of every URDF link in its parent link, at joint angles `q_rad`, one per moving joint: the data of
    /// a transform tree.
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if `q_rad` does not have one angle per moving joint.
    pub fn transforms(&self, q_rad: &[f64]) -> Result<Vec<Transform<'_>>, ModelError> {
        self.expect_dof(q_rad.len())?;
        Ok(shapes::transforms(&self.robot, &self.chain, q_rad))
    }

    /// Returns the joints that do not move, with their positions \[rad, m for a prismatic joint\].
    pub(crate) fn frozen(&self) -> &crate::frozen::FrozenJoints {
        &self.chain.frozen
    }

    /// Returns the file name of the TOML, for messages.
    pub(crate) fn toml_file(&self) -> &str {
        &self.toml_file
    }

    /// Returns the same arm with an extended TOML; the warnings stay those of the given files.
    pub(crate) fn with_toml(&self, toml: String) -> Result<Self, ModelError> {
        let settings = parse_toml(&self.toml_file, &toml)?;
        let mut description = Self::build(
            settings,
            self.toml_file.clone(),
            toml,
            self.urdf_file.clone(),
            self.urdf.clone(),
        )?;
        description.warnings.clone_from(&self.warnings);
        Ok(description)
    }

    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns an error if the caller expects another number of joints.
    pub(crate) fn expect_dof(&self, expected: usize) -> Result<(), ModelError> {
        if expected == self.dof() {
            return Ok(());
        }
        Err(ModelError::JointCount {
            file: self.toml_file.clone(),
            arm: self.settings.name.clone(),
            expected,
            found: self.dof(),
        })
    }
}

pub(crate) fn read(path: &Path, remedy: &'static str) -> Result<String, ModelError> {
    supple_files::read_text(path, Description::MAX_BYTES).map_err(|error| ModelError::Read {
        file: path.display().to_string(),
        error,
        remedy,
    })
}

fn parse_toml(file: &str, text: &str) -> Result<Settings, ModelError> {
    if text.trim_start().starts_with('<') {
        return Err(ModelError::Syntax {
            file: file.to_owned(),
            message: "this is XML, but a TOML is expected".to_owned(),
            remedy: "give the TOML of the arm, or the URDF under its own name, FILE.urdf",
        });
    }
    toml::from_str(text).map_err(|error| ModelError::Syntax {
        file: file.to_owned(),
        message: error.to_string().trim_end().to_owned(),
        remedy: "correct it: keys, types and units are those of assets/arm.schema.json",
    })
}
