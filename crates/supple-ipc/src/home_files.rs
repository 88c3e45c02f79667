//! The question to the operator whether the arm is in its home pose, and the answer: two files in the folder of the system.
//!
//! The process that drives the arm writes the question while it waits, and withdraws it if it stops waiting. The answer is the
//! question's file under another name, so that there is none without a question, and none to an earlier one.

use std::io;
use std::path::{Path, PathBuf};

/// Paths of the question and of its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HomeFiles {
    question: PathBuf,
    answer: PathBuf,
}

impl HomeFiles {
    pub(crate) fn of(folder: &Path, prefix: &str) -> HomeFiles {
        HomeFiles {
            question: folder.join(format!("at-home-{prefix}-question")),
            answer: folder.join(format!("at-home-{prefix}-answer")),
        }
    }

    /// Asks whether the arm is in this pose, in words. An older answer is removed.
    ///
    /// # Errors
    /// If a file can neither be removed nor written.
    pub fn ask(&self, pose: &str) -> io::Result<()> {
        remove(&self.answer)?;
        std::fs::write(&self.question, pose)
    }

    /// Whether the operator has answered; the answer is removed.
    pub fn take_answer(&self) -> bool {
        std::fs::remove_file(&self.answer).is_ok()
    }

    /// Withdraws the question, and an answer that comes too late.
    pub fn withdraw(&self) {
        // Either may be absent. In this order an operator cannot answer in between.
        let _ = remove(&self.question);
        let _ = remove(&self.answer);
    }

    /// The pose that is asked for, if anybody waits.
    pub fn question(&self) -> Option<String> {
        std::fs::read_to_string(&self.question).ok()
    }

    /// Answers the question.
    ///
    /// # Errors
    /// If nobody waits any more.
    pub fn answer(&self) -> io::Result<()> {
        std::fs::rename(&self.question, &self.answer)
    }
}

fn remove(file: &Path) -> io::Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
