//! Writes a folder of results atomically.
//!
//! Files are written to a hidden folder beside the target, on the same file system. When all files are complete, they
//! are synced to disk and moved: the whole folder if the target does not exist, otherwise file by file, each
//! atomically replacing a file of the same name. Other files in the folder are kept. A run that fails or is
//! interrupted leaves no file. If a device, a FIFO, a socket or a folder has the name of a result, the run does not start
//! and no file is written.

use crate::exit::Failure;
use crate::interrupt;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use supple_files::{check_output, create_output};

/// File that is moved last; its presence marks the results as complete.
const LAST: &str = "summary.json";

/// Results that have not been moved to the target folder.
#[derive(Debug)]
pub struct Staging {
    target: PathBuf,
    partial: PathBuf,
}

impl Staging {
    /// Prepares results for the folder `target`; `names` are files that will be written.
    ///
    /// # Errors
    /// [`Failure::File`] if the folder is not writable, or one of the names is not a regular file.
    pub fn new(target: &Path, names: &[&str]) -> Result<Staging, Failure> {
        let process = std::process::id();
        let partial = if target.is_dir() {
            target.join(format!(".partial-{process}"))
        } else {
            let name = target.file_name().unwrap_or_default().to_string_lossy();
            target.with_file_name(format!(".{name}.partial-{process}"))
        };
        if !target.is_dir() && target.symlink_metadata().is_ok() {
            let error = std::io::ErrorKind::NotADirectory.into();
            return Err(Failure::file("write into", target, error));
        }
        for target in names.iter().map(|name| target.join(name)) {
            reject_special_file(&target)?;
        }
        fs::create_dir_all(&partial).map_err(|error| Failure::file("create", target, error))?;
        interrupt::set_partial_folder(Some(partial.clone()));
        Ok(Staging {
            target: target.to_owned(),
            partial,
        })
    }

    /// Creates a folder in the results.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn folder(&self, name: &str) -> Result<PathBuf, Failure> {
        let folder = self.partial.join(name);
        fs::create_dir_all(&folder)
            .map_err(|error| Failure::file("create", &self.target.join(name), error))?;
        Ok(folder)
    }

    /// Writes a complete file to the results.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.partial.join(name);
        let written = create_output(&path).and_then(|mut file| file.write_all(bytes));
        written.map_err(|error| Failure::file("write", &self.target.join(name), error))
    }

    /// Moves all results to the target folder.
    ///
    /// # Errors
    /// [`Failure::File`]; files that have been moved are complete even then. No file is moved if the target of one is
    /// not a regular file.
    pub fn publish(self) -> Result<(), Failure> {
        let files =
            files_in(&self.partial).map_err(|error| Failure::file("read", &self.partial, error))?;
        for file in &files {
            let synced = File::open(self.partial.join(file)).and_then(|file| file.sync_all());
            synced.map_err(|error| Failure::file("write", &self.target.join(file), error))?;
        }
        if !self.target.exists() && fs::rename(&self.partial, &self.target).is_ok() {
            return Ok(());
        }
        for target in files.iter().map(|file| self.target.join(file)) {
            reject_special_file(&target)?;
        }
        let (last, others): (Vec<_>, Vec<_>) = files
            .iter()
            .partition(|file| file.as_path() == Path::new(LAST));
        for file in others.into_iter().chain(last) {
            let target = self.target.join(file);
            let moved = target
                .parent()
                .map_or(Ok(()), fs::create_dir_all)
                .and_then(|()| fs::rename(self.partial.join(file), &target));
            moved.map_err(|error| Failure::file("replace", &target, error))?;
        }
        Ok(())
    }
}

fn reject_special_file(target: &Path) -> Result<(), Failure> {
    match check_output(target) {
        // A file in the place of a folder is reported when the folder is created.
        Err(error) if error.kind() != std::io::ErrorKind::NotADirectory => {
            Err(Failure::file("replace", target, error))
        }
        _ => Ok(()),
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // The folder does not exist any more if it was moved as a whole; otherwise its remaining files are removed.
        let _ = fs::remove_dir_all(&self.partial);
        interrupt::set_partial_folder(None);
    }
}

/// Lists every file below a folder, relative to the folder.
fn files_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut open = vec![PathBuf::new()];
    while let Some(relative) = open.pop() {
        for entry in fs::read_dir(folder.join(&relative))? {
            let entry = entry?;
            let path = relative.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                open.push(path);
            } else {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let files = files_in(folder).expect("a folder");
        let names = files.iter().map(|file| file.to_string_lossy().into_owned());
        names.collect()
    }

    fn staged(target: &Path) -> Staging {
        let staging = Staging::new(target, &[]).expect("the folder can be written");
        staging.folder("figures").expect("a folder");
        for name in ["figures/a.svg", "report.html", LAST] {
            staging.write(name, b"complete").expect("written");
        }
        staging
    }

    #[test]
    fn a_new_folder_is_published_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("deep/down");
        let staging = staged(&target);
        assert!(!target.exists());
        staging.publish().expect("published");
        assert_eq!(names(&target), ["figures/a.svg", "report.html", LAST]);
        assert_eq!(
            names(folder.path()).len(),
            3,
            "no other file is in the folder"
        );
    }

    #[test]
    fn dropped_results_leave_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("other"), "kept").expect("written");
        drop(staged(folder.path()));
        drop(staged(&folder.path().join("new")));
        assert_eq!(names(folder.path()), ["other"]);
    }

    #[test]
    fn a_folder_with_the_name_of_a_result_is_rejected_and_nothing_is_moved() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path();
        fs::create_dir_all(target.join("report.html/in the way")).expect("a folder");
        let failure = staged(target)
            .publish()
            .expect_err("a folder is in the way");
        assert_eq!(failure.code(), 6);
        assert!(failure.to_string().contains("report.html"), "{failure}");
        assert!(names(target).is_empty(), "{:?}", names(target));
        Staging::new(target, &["report.html"])
            .expect_err("rejected before the run if the name is given");
        assert!(names(target).is_empty() && target.join("report.html").is_dir());
    }

    #[cfg(unix)]
    #[test]
    fn a_fifo_with_the_name_of_a_result_is_not_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().expect("a folder");
        let fifo = folder.path().join(LAST);
        let made = std::process::Command::new("mkfifo").arg(&fifo).status();
        assert!(made.expect("mkfifo exists").success());
        let failure = Staging::new(folder.path(), &[LAST]).expect_err("refused");
        let later = staged(folder.path()).publish().expect_err("refused");
        for failure in [failure, later] {
            assert_eq!(failure.code(), 6);
            for word in [LAST, "a FIFO", "regular file"] {
                assert!(failure.to_string().contains(word), "{failure}");
            }
        }
        assert_eq!(names(folder.path()), [LAST]);
        let kind = fs::metadata(&fifo).expect("there").file_type();
        assert!(kind.is_fifo());
    }
}
