//! Messages of faults, refusals and the drive guard, with the joint names of the arm.

use crate::record::Text;
use core::fmt;

/// Name of a joint in messages: `joint elbow`, or for a joint without a name its index from 0, `joint 2`.
#[derive(Clone, Copy, Debug)]
pub struct JointLabel<'a> {
    joint: usize,
    names: &'a [Text],
}

impl<'a> JointLabel<'a> {
    /// Returns the label of the joint with this index.
    pub fn new(joint: usize, names: &'a [Text]) -> JointLabel<'a> {
        JointLabel { joint, names }
    }
}

impl fmt::Display for JointLabel<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.names.get(self.joint).map(Text::as_str) {
            None | Some("") => write!(f, "joint {}", self.joint),
            Some(name) => write!(f, "joint {name}"),
        }
    }
}

/// A message that names joints.
pub trait NamesJoints {
    /// Writes the message; a joint without an element in `names` is written by its index.
    ///
    /// # Errors
    /// Those of the formatter.
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result;

    /// Returns the message with these joint names.
    fn with_names<'a>(&'a self, names: &'a [Text]) -> WithNames<'a, Self>
    where
        Self: Sized,
    {
        WithNames {
            message: self,
            names,
        }
    }
}

/// A message with the names of an arm's joints, see [`NamesJoints::with_names`].
#[derive(Clone, Copy, Debug)]
pub struct WithNames<'a, M> {
    message: &'a M,
    names: &'a [Text],
}

impl<M: NamesJoints> fmt::Display for WithNames<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.message.write(f, self.names)
    }
}
