//! Confirmation by the operator that the arm is in its home pose: a request and an answer, each a file in the folder of the
//! system.
//!
//! The process that drives the arm writes the request file and waits; it removes the file when it stops waiting. The operator's
//! command renames the request file to the answer file. An answer therefore exists only for the current request.

use std::io;
use std::path::{Path, PathBuf};

/// Paths of the request file and of the answer file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HomePoseConfirmation {
    question: PathBuf,
    answer: PathBuf,
}

impl HomePoseConfirmation {
    pub(crate) fn of(folder: &Path, prefix: &str) -> HomePoseConfirmation {
        HomePoseConfirmation {
            question: folder.join(format!("at-home-{prefix}-question")),
            answer: folder.join(format!("at-home-{prefix}-answer")),
        }
    }

    /// Writes the request to confirm this pose, given as text for the operator; removes an older answer.
    ///
    /// # Errors
    /// If a file can neither be removed nor written.
    pub fn request(&self, pose: &str) -> io::Result<()> {
        remove(&self.answer)?;
        std::fs::write(&self.question, pose)
    }

    /// Returns whether the operator has answered, and removes the answer.
    pub fn take_answer(&self) -> bool {
        std::fs::remove_file(&self.answer).is_ok()
    }

    /// Removes the request, and an answer that arrives too late.
    pub fn remove_request(&self) {
        // Either file may be absent. In this order the operator cannot answer between the two calls.
        let _ = remove(&self.question);
        let _ = remove(&self.answer);
    }

    /// Returns the pose to confirm, as text, if a process waits for the confirmation.
    pub fn requested_pose(&self) -> Option<String> {
        std::fs::read_to_string(&self.question).ok()
    }

    /// Confirms the pose.
    ///
    /// # Errors
    /// If no process waits for the confirmation.
    pub fn confirm(&self) -> io::Result<()> {
        std::fs::rename(&self.question, &self.answer)
    }
}

fn remove(file: &Path) -> io::Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
