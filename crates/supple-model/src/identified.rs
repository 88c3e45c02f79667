//! Writes an identified model or other settings into a description (URDF and TOML).
//!
//! The texts are edited in place, so shapes, limits, gains and comments are kept. The inertia of each moving
//! link, including all links fixed to it and the tool, is written into the `<inertial>` of that link; the `<inertial>` of the
//! fixed links is removed.

use crate::description::Description;
use crate::error::{ModelError, Reporter};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use std::path::Path;
use supple_core::config::{JointGains, RippleTable};
use supple_core::friction::LoadTorque;
use supple_core::{Arm, Body, Friction, Pose};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value, value};

/// File name of the URDF of a saved description.
const URDF: &str = "arm.urdf";
/// File name of the TOML of a saved description.
const TOML: &str = "arm.toml";

/// The model that replaces the model of a description.
#[derive(Clone, Copy, Debug)]
pub struct IdentifiedModel<'a, const N: usize> {
    /// Masses, inertias and rotors; the kinematics must equal those of the description.
    pub arm: &'a Arm<N>,
    /// Friction of each joint.
    pub friction: &'a [Friction; N],
    /// Torque ripple of each motor; `None` keeps the ripple of the description.
    pub ripple: Option<&'a [RippleTable; N]>,
    /// Origin of the numbers, for `source` in the TOML.
    pub source: &'a str,
}

/// Minimum thresholds while the model is not identified; a zero keeps the value of the description.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimumThresholds {
    /// `collision.move_share`: collision thresholds in the modes with stiff joint loops, as a fraction of those of the other modes.
    pub move_share: f64,
    /// `collision_torque_nm` of each joint \[N m\]; `None` keeps those of the description.
    pub joint_torque_nm: Option<Vec<f64>>,
    /// `collision.tip_force_n`: threshold of the force at the tip \[N\].
    pub tip_force_n: f64,
    /// Whether gravity hold keeps the pose by position loops; `false` keeps the description's choice.
    pub hold_pose: bool,
    /// `plausible.load_n`: threshold of an unmodelled load at the tip \[N\].
    pub load_n: f64,
    /// `plausible.stiction_factor`: factor of the external torque that dry friction may hold.
    pub stiction_factor: f64,
    /// `plausible.against_share`: torque that may oppose the acceleration of a joint, as a fraction of its torque limit.
    pub against_share: f64,
    /// `limits.joint_tracking_error_rad`: deviation of a joint from its reference \[rad\].
    pub joint_tracking_error_rad: f64,
}

impl Description {
    /// Returns the same arm with another model.
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited texts.
    pub fn with_model<const N: usize>(
        &self,
        model: &IdentifiedModel<'_, N>,
    ) -> Result<Description, ModelError> {
        self.expect_dof(N)?;
        // Joint frames are those of the kinematics; how links are placed in them is the description's own choice.
        let own = self.arm::<N>()?;
        let bodies: [Body; N] = core::array::from_fn(|i| {
            model.arm.body(i).expressed_in(&Pose {
                rotation: own.link_from_joint(i),
                ..Pose::IDENTITY
            })
        });
        Description::from_text(&self.toml_with(model)?, &self.urdf_with(&bodies)?)
    }

    /// Returns the same arm with other collision thresholds for the modes with stiff joint loops \[N m\], one per
    /// joint; `None` keeps the threshold of the description.
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited text.
    pub fn with_move_collision(
        &self,
        threshold_nm: &[Option<f64>],
    ) -> Result<Description, ModelError> {
        self.expect_dof(threshold_nm.len())?;
        let mut document = self.document()?;
        for (joint, threshold_nm) in threshold_nm.iter().enumerate() {
            if let Some(threshold_nm) = threshold_nm {
                let joint = self.joint_table(&mut document, joint)?;
                put(joint, "move_collision_torque_nm", (*threshold_nm).into());
            }
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Returns the same arm with other gains of the move mode.
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited text.
    pub fn with_move_gains<const N: usize>(
        &self,
        gains: &JointGains<N>,
    ) -> Result<Description, ModelError> {
        self.expect_dof(N)?;
        let mut document = self.document()?;
        for joint in 0..N {
            let (stiffness, damping) = (gains.stiffness_nm_per_rad, gains.damping_nm_s_per_rad);
            let table = self.joint_table(&mut document, joint)?;
            put(table, "move_stiffness_nm_per_rad", stiffness[joint].into());
            put(table, "move_damping_nm_s_per_rad", damping[joint].into());
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Returns the same arm with this compliance between encoder and link of each joint \[rad/(N m)\].
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited text.
    pub fn with_compliance(
        &self,
        compliance_rad_per_nm: &[f64],
    ) -> Result<Description, ModelError> {
        self.expect_dof(compliance_rad_per_nm.len())?;
        let mut document = self.document()?;
        for (joint, compliance) in compliance_rad_per_nm.iter().enumerate() {
            let joint = self.joint_table(&mut document, joint)?;
            put(joint, "compliance_rad_per_nm", (*compliance).into());
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Returns the same arm with every joint active: no joint is held.
    ///
    /// # Errors
    /// Any [`ModelError`] of the edited text.
    pub fn with_all_joints_active(&self) -> Result<Description, ModelError> {
        let mut document = self.document()?;
        for joint in 0..self.dof() {
            self.joint_table(&mut document, joint)?.remove("held");
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Returns the same arm with thresholds of at least `minimum`; greater thresholds of the description stay. `joint_torque_nm`
    /// replaces the collision thresholds of the joints.
    ///
    /// # Errors
    /// Any [`ModelError`] of the edited text.
    pub fn with_minimum_thresholds(
        &self,
        minimum: &MinimumThresholds,
    ) -> Result<Description, ModelError> {
        let mut document = self.document()?;
        let settings = self.settings();
        for (key, entry, threshold) in [
            (
                "collision",
                "move_share",
                minimum.move_share.max(settings.collision.move_share),
            ),
            (
                "collision",
                "tip_force_n",
                minimum.tip_force_n.max(settings.collision.tip_force_n),
            ),
            (
                "plausible",
                "load_n",
                minimum.load_n.max(settings.plausible.load_n),
            ),
            (
                "plausible",
                "stiction_factor",
                minimum
                    .stiction_factor
                    .max(settings.plausible.stiction_factor),
            ),
            (
                "plausible",
                "against_share",
                minimum.against_share.max(settings.plausible.against_share),
            ),
            (
                "limits",
                "joint_tracking_error_rad",
                minimum
                    .joint_tracking_error_rad
                    .max(settings.limits.joint_tracking_error_rad),
            ),
        ] {
            let section = document.entry(key).or_insert_with(toml_edit::table);
            section[entry] = value(threshold);
        }
        for joint in 0..self.dof() {
            let table = self.joint_table(&mut document, joint)?;
            table.remove("move_collision_torque_nm");
            let given_nm = minimum
                .joint_torque_nm
                .as_deref()
                .and_then(|nm| nm.get(joint));
            if let Some(torque_nm) = given_nm {
                put(table, "collision_torque_nm", (*torque_nm).into());
            }
        }
        if minimum.hold_pose {
            document["hold_pose"] = value(true);
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Returns the same arm that holds exactly the held joints of `of`, at the same angles and with the same gains, and has the
    /// same damping of gravity hold.
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited text.
    pub fn with_held_joints_of(&self, of: &Description) -> Result<Description, ModelError> {
        self.expect_dof(of.dof())?;
        let (mut document, mut other) = (self.document()?, of.document()?);
        for joint in 0..self.dof() {
            for key in ["held", "hold_damping_nm_s_per_rad"] {
                let given = of.joint_table(&mut other, joint)?.remove(key);
                let table = self.joint_table(&mut document, joint)?;
                match given {
                    Some(given) => _ = table.insert(key, given),
                    None => _ = table.remove(key),
                }
            }
        }
        Description::from_text(&document.to_string(), self.urdf())
    }

    /// Writes `arm.toml` and `arm.urdf` into a folder, which it creates if necessary; [`Description::load`] reads
    /// them. Existing files of these names are replaced.
    ///
    /// # Errors
    /// [`ModelError::Write`]; nothing is written if a device, FIFO, socket or folder has one of the names.
    pub fn save(&self, folder: &Path) -> Result<(), ModelError> {
        let write_error = |path: &Path, error| ModelError::Write {
            file: path.display().to_string(),
            error,
        };
        let files = [(URDF, self.urdf()), (TOML, &self.toml_named(URDF)?)];
        let files = files.map(|(name, text)| (folder.join(name), text));
        // Check both files before writing either, so that no incomplete arm is left.
        for (path, _) in &files {
            supple_files::check_output(path).map_err(|error| write_error(path, error))?;
        }
        std::fs::create_dir_all(folder).map_err(|error| write_error(folder, error))?;
        files.iter().try_for_each(|(path, text)| {
            let written = supple_files::write_atomic(path, text.as_bytes());
            written.map_err(|error| write_error(path, error))
        })
    }

    fn urdf_with(&self, bodies: &[Body]) -> Result<String, ModelError> {
        let text = self.urdf();
        let document = Document::parse(text).map_err(|error| syntax(URDF, error.to_string()))?;
        // New inertia of each link: the lumped body, or none if the link is fixed to another.
        let mut wanted: BTreeMap<&str, Option<&Body>> = BTreeMap::new();
        let mut seen = vec![false; bodies.len()];
        for placed in &self.chain.links {
            if let Some(carrier) = placed.carrier {
                let first = !std::mem::replace(&mut seen[carrier], true);
                let name = self.robot().links[placed.link].name.as_str();
                wanted.insert(name, first.then_some(&bodies[carrier]));
            }
        }
        let links = document
            .root_element()
            .children()
            .filter(|node| node.has_tag_name("link"));
        let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
        for link in links {
            let body = link.attribute("name").and_then(|name| wanted.get(name));
            if let Some(body) = body {
                edits.extend(edit(&link, text, *body));
            }
        }
        edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
        let mut edited = text.to_owned();
        for (range, replacement) in edits {
            edited.replace_range(range, &replacement);
        }
        Ok(edited)
    }

    fn toml_with<const N: usize>(
        &self,
        model: &IdentifiedModel<'_, N>,
    ) -> Result<String, ModelError> {
        let mut document = self.document()?;
        document["urdf"] = value(URDF);
        document["source"] = value(model.source);
        // This entry belongs to the model that is replaced.
        document.remove("learned");
        for i in 0..N {
            let joint = self.joint_table(&mut document, i)?;
            put(joint, "source", model.source.into());
            put(joint, "armature_kg_m2", model.arm.armature()[i].into());
            put(joint, "friction", friction(&model.friction[i]).into());
        }
        if let Some(tool) = document.get_mut("tool").and_then(Item::as_table_like_mut) {
            for key in ["mass_kg", "com_m", "inertia_kg_m2"] {
                tool.remove(key);
            }
        }
        if let Some(tables) = model.ripple {
            self.put_ripple(&mut document, tables)?;
        }
        Ok(document.to_string())
    }

    /// Returns the table of a joint in the TOML; adds the table if it is missing.
    pub(crate) fn joint_table<'a>(
        &self,
        document: &'a mut DocumentMut,
        joint: usize,
    ) -> Result<&'a mut Table, ModelError> {
        let name = self.joint_names()[joint].as_str();
        if !document.contains_key("joints") {
            document["joints"] = Item::ArrayOfTables(ArrayOfTables::new());
        }
        let Some(joints) = document["joints"].as_array_of_tables_mut() else {
            return Err(self.not_tables("joints"));
        };
        let named = |table: &Table| table.get("name").and_then(Item::as_str) == Some(name);
        let at = joints.iter().position(named).unwrap_or(joints.len());
        if at == joints.len() {
            let mut table = Table::new();
            table["name"] = value(name);
            joints.push(table);
        }
        joints.get_mut(at).ok_or_else(|| self.not_tables("joints"))
    }

    fn put_ripple(
        &self,
        document: &mut DocumentMut,
        tables: &[RippleTable],
    ) -> Result<(), ModelError> {
        let mut list = toml_edit::Array::new();
        for (motor, table) in tables.iter().enumerate() {
            for line in table.harmonics() {
                let mut entry = InlineTable::new();
                entry.insert("motor", i64::try_from(motor).unwrap_or(i64::MAX).into());
                entry.insert("harmonic", i64::from(line.harmonic).into());
                entry.insert("sine_nm", line.sine_nm.into());
                entry.insert("cosine_nm", line.cosine_nm.into());
                if line.sine_share != 0.0 || line.cosine_share != 0.0 {
                    entry.insert("sine_share", line.sine_share.into());
                    entry.insert("cosine_share", line.cosine_share.into());
                }
                list.push(entry);
            }
        }
        if !document.contains_key("motors") {
            let mut motors = Table::new();
            let limits: toml_edit::Array = self.motors().torque_nm.iter().copied().collect();
            motors["torque_nm"] = value(limits);
            document["motors"] = Item::Table(motors);
        }
        let Some(motors) = document["motors"].as_table_mut() else {
            return Err(self.not_tables("motors"));
        };
        put(motors, "ripple", list.into());
        Ok(())
    }

    fn toml_named(&self, urdf: &str) -> Result<String, ModelError> {
        let mut document = self.document()?;
        document["urdf"] = value(urdf);
        Ok(document.to_string())
    }

    pub(crate) fn document(&self) -> Result<DocumentMut, ModelError> {
        let document = self.toml().parse::<DocumentMut>();
        document.map_err(|error| syntax(TOML, error.to_string()))
    }

    fn not_tables(&self, key: &str) -> ModelError {
        let report = Reporter {
            file: &self.toml_file,
        };
        report.invalid(
            format!("`{key}`"),
            "must be written as tables, to be edited",
            "an inline value",
            format!("write it as [{key}] or [[{key}]]"),
        )
    }
}

fn syntax(file: &str, message: String) -> ModelError {
    ModelError::Syntax {
        file: file.to_owned(),
        message,
        remedy: "correct the text",
    }
}

/// Sets a key and removes the comment before it, which described the old value.
pub(crate) fn put(table: &mut Table, key: &str, new: Value) {
    table[key] = value(new);
    if let Some(mut key) = table.key_mut(key) {
        key.leaf_decor_mut().clear();
    }
}

fn friction(f: &Friction) -> InlineTable {
    let mut table = InlineTable::new();
    table.insert("viscous_nm_s_per_rad", f.viscous_nm_s_per_rad.into());
    if f.viscous_asymmetry_nm_s_per_rad != 0.0 {
        table.insert(
            "viscous_asymmetry_nm_s_per_rad",
            f.viscous_asymmetry_nm_s_per_rad.into(),
        );
    }
    table.insert("coulomb_nm", f.coulomb_nm.into());
    table.insert("breakaway_nm", f.breakaway_nm.into());
    table.insert("stribeck_rad_per_s", f.stribeck_rad_per_s.into());
    table.insert("offset_nm", f.offset_nm.into());
    if f.stribeck_offset_nm != 0.0 {
        table.insert("stribeck_offset_nm", f.stribeck_offset_nm.into());
    }
    table.insert("band_rad_per_s", f.band_rad_per_s.into());
    if f.presliding_rad > 0.0 {
        table.insert("presliding_rad", f.presliding_rad.into());
    }
    if f.load_coefficient > 0.0 {
        table.insert("load_coefficient", f.load_coefficient.into());
        if f.load_torque == LoadTorque::Motor {
            table.insert("load_torque", "motor".into());
        }
        table.insert("coulomb_at_nm", f.coulomb_at_nm.into());
    }
    table
}

/// Returns the edits of one `<link>`.
fn edit(
    link: &Node<'_, '_>,
    text: &str,
    body: Option<&Body>,
) -> Option<(std::ops::Range<usize>, String)> {
    let old = link.children().find(|child| child.has_tag_name("inertial"));
    let new = body.map(inertial);
    match (old, new) {
        (Some(old), new) => Some((old.range(), new.unwrap_or_default())),
        (None, None) => None,
        (None, Some(new)) => {
            let range = link.range();
            match link.first_child() {
                Some(first) => Some((first.range().start..first.range().start, new)),
                None => {
                    let tag = text[range.clone()]
                        .trim_end_matches("</link>")
                        .trim_end_matches("/>")
                        .trim_end_matches('>');
                    Some((range, format!("{tag}>{new}</link>")))
                }
            }
        }
    }
}

/// Returns the `<inertial>` element of a body. Debug format prints numbers with enough digits to read back the same number.
fn inertial(body: &Body) -> String {
    let (c, i) = (&body.com_m, &body.inertia_kg_m2);
    format!(
        "<inertial>\n      <origin xyz=\"{:?} {:?} {:?}\" rpy=\"0 0 0\"/>\n      \
         <mass value=\"{:?}\"/>\n      <inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" \
         iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/>\n    </inertial>",
        c.x,
        c.y,
        c.z,
        body.mass_kg,
        i[(0, 0)],
        i[(0, 1)],
        i[(0, 2)],
        i[(1, 1)],
        i[(1, 2)],
        i[(2, 2)],
    )
}
