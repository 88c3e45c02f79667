//! Adds settings to the text of a TOML, each with its reason as a comment.

use super::derived::Derived;
use crate::description::Description;
use crate::error::{ModelError, Reporter};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, Value, value};

/// What the comment of a derived setting begins with.
pub(super) const MARK: &str = " # derived:";

/// The TOML of an arm while settings are added to it.
pub(super) struct Writer {
    document: DocumentMut,
    joints: Vec<String>,
    has_given_joints: bool,
    derived: Vec<Derived>,
}

impl Writer {
    pub fn new(description: &Description) -> Result<Self, ModelError> {
        let file = description.toml_file();
        let document = description.toml().parse::<DocumentMut>();
        let mut document = document.map_err(|error| ModelError::Syntax {
            file: file.to_owned(),
            message: error.to_string(),
            remedy: "correct the text",
        })?;
        for key in [
            "joints",
            "fixed_joints_rad",
            "limits",
            "law",
            "latch",
            "plausible",
            "collision",
            "paths",
        ] {
            // Settings are added with a comment each, for which an inline table has no place.
            let Some(item) = document.get_mut(key) else {
                continue;
            };
            let given = std::mem::take(item);
            let tables = match key {
                "joints" => given.into_array_of_tables().map(Item::ArrayOfTables),
                _ => given.into_table().map(Item::Table),
            };
            *item = tables.map_err(|_| {
                Reporter { file }.invalid(
                    format!("`{key}`"),
                    "must be a table, or tables",
                    "another value",
                    format!("write it as [{key}] or [[{key}]]"),
                )
            })?;
        }
        Ok(Self {
            document,
            joints: description.joint_names().to_vec(),
            has_given_joints: !description.settings().joints.is_empty(),
            derived: Vec::new(),
        })
    }

    /// Returns whether the original text has entries of joints.
    pub fn has_given_joints(&self) -> bool {
        self.has_given_joints
    }

    /// Returns whether the text gives a key of a joint.
    pub fn has_joint(&self, joint: &str, key: &str) -> bool {
        let tables = self
            .document
            .get("joints")
            .and_then(Item::as_array_of_tables);
        tables.is_some_and(|tables| {
            let mut tables = tables.iter();
            tables.any(|table| name_of(table) == Some(joint) && table.contains_key(key))
        })
    }

    /// Adds a key to the joint with this index, unless the text gives it; returns whether it was added.
    pub fn joint(&mut self, joint: usize, key: &str, new: impl Into<Value>, why: &str) -> bool {
        let name = self.joints[joint].clone();
        if self.has_joint(&name, key) {
            return false;
        }
        let new = new.into();
        self.note(&format!("joint `{name}` {key}"), &new, why);
        let item = self.document.entry("joints");
        let tables = item.or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
        let Some(tables) = tables.as_array_of_tables_mut() else {
            return false;
        };
        let at = tables
            .iter()
            .position(|table| name_of(table) == Some(&name));
        let at = at.unwrap_or_else(|| {
            let mut table = Table::new();
            table["name"] = value(name.as_str());
            tables.push(table);
            tables.len() - 1
        });
        if let Some(table) = tables.get_mut(at) {
            put(table, key, new, why);
        }
        true
    }

    /// Adds a key to a section, or to the top with an empty `section`, unless the text gives it.
    pub fn set(&mut self, section: &str, key: &str, new: impl Into<Value>, why: &str) {
        let new = new.into();
        let table = match section {
            "" => self.document.as_table_mut(),
            _ => {
                let item = self.document.entry(section);
                let Some(table) = item.or_insert(Item::Table(Table::new())).as_table_mut() else {
                    return;
                };
                table
            }
        };
        if table.contains_key(key) {
            return;
        }
        put(table, key, new.clone(), why);
        let place = if section.is_empty() {
            key.to_owned()
        } else {
            format!("[{section}] {key}")
        };
        self.note(&place, &new, why);
    }

    /// Reads the arm again, with what was added.
    pub fn read(&self, description: &Description) -> Result<Description, ModelError> {
        description.with_toml(self.document.to_string())
    }

    /// Returns the added settings, in order.
    pub fn finish(self) -> Vec<Derived> {
        self.derived
    }

    fn note(&mut self, key: &str, new: &Value, why: &str) {
        self.derived.push(Derived {
            key: key.to_owned(),
            value: new.to_string().trim().to_owned(),
            why: why.to_owned(),
        });
    }
}

fn name_of(table: &Table) -> Option<&str> {
    table.get("name").and_then(Item::as_str)
}

/// Adds `key = value # why`.
fn put(table: &mut Table, key: &str, mut new: Value, why: &str) {
    new.decor_mut().set_suffix(format!("{MARK} {why}"));
    table.insert(key, Item::Value(new));
}

/// Returns a list of numbers.
pub(super) fn list(values: &[f64]) -> Value {
    Value::Array(values.iter().copied().collect())
}
