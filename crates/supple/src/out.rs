//! A folder of results that is never half of anything.
//!
//! Files are written to a hidden folder beside their place, on the same file system. When all are
//! whole they are waited for until they are on the disk, and moved: the folder as one where there was
//! none, otherwise file by file, each replacing one of its name at once. What else is in the folder
//! stays. A run that fails or is interrupted leaves no file. Where a device, a FIFO, a socket or a folder has
//! the name of a result, nothing is run and nothing is written.

use crate::exit::Failure;
use crate::interrupt;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use supple_files::{check_output, create_output};

/// The file whose presence says that the results are whole: it is moved last.
const LAST: &str = "summary.json";

/// Results on their way.
#[derive(Debug)]
pub struct Staging {
    target: PathBuf,
    partial: PathBuf,
}

impl Staging {
    /// For results that are to end up in `target`, `names` among them.
    ///
    /// # Errors
    /// [`Failure::File`] where nothing can be written there, or what has one of the names is no file.
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
        for place in names.iter().map(|name| target.join(name)) {
            refuse_special(&place)?;
        }
        fs::create_dir_all(&partial).map_err(|error| Failure::file("create", target, error))?;
        interrupt::guard(Some(partial.clone()));
        Ok(Staging {
            target: target.to_owned(),
            partial,
        })
    }

    /// A folder among the results.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn folder(&self, name: &str) -> Result<PathBuf, Failure> {
        let folder = self.partial.join(name);
        fs::create_dir_all(&folder)
            .map_err(|error| Failure::file("create", &self.target.join(name), error))?;
        Ok(folder)
    }

    /// A file among the results, all of it.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.partial.join(name);
        let written = create_output(&path).and_then(|mut file| file.write_all(bytes));
        written.map_err(|error| Failure::file("write", &self.target.join(name), error))
    }

    /// Moves everything to its place.
    ///
    /// # Errors
    /// [`Failure::File`]; every file that is in its place is whole then too. None is moved where what has the
    /// name of one is no file.
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
        for place in files.iter().map(|file| self.target.join(file)) {
            refuse_special(&place)?;
        }
        let (last, others): (Vec<_>, Vec<_>) = files
            .iter()
            .partition(|file| file.as_path() == Path::new(LAST));
        for file in others.into_iter().chain(last) {
            let place = self.target.join(file);
            let moved = place
                .parent()
                .map_or(Ok(()), fs::create_dir_all)
                .and_then(|()| fs::rename(self.partial.join(file), &place));
            moved.map_err(|error| Failure::file("replace", &place, error))?;
        }
        Ok(())
    }
}

fn refuse_special(place: &Path) -> Result<(), Failure> {
    match check_output(place) {
        // A file where a folder is wanted is found when the folder is made.
        Err(error) if error.kind() != std::io::ErrorKind::NotADirectory => {
            Err(Failure::file("replace", place, error))
        }
        _ => Ok(()),
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // Gone already where it was moved as one; what is left otherwise is of no use.
        let _ = fs::remove_dir_all(&self.partial);
        interrupt::guard(None);
    }
}

/// Every file below a folder, relative to it.
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
        let staging = Staging::new(target, &[]).expect("it can be written");
        staging.folder("figures").expect("a folder");
        for name in ["figures/a.svg", "report.html", LAST] {
            staging.write(name, b"whole").expect("written");
        }
        staging
    }

    #[test]
    fn a_new_folder_appears_as_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("deep/down");
        let staging = staged(&target);
        assert!(!target.exists());
        staging.publish().expect("published");
        assert_eq!(names(&target), ["figures/a.svg", "report.html", LAST]);
        assert_eq!(names(folder.path()).len(), 3, "nothing beside it");
    }

    #[test]
    fn what_is_dropped_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("other"), "kept").expect("written");
        drop(staged(folder.path()));
        drop(staged(&folder.path().join("new")));
        assert_eq!(names(folder.path()), ["other"]);
    }

    #[test]
    fn a_folder_in_the_place_of_a_file_is_refused_and_nothing_is_moved() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path();
        fs::create_dir_all(target.join("report.html/in the way")).expect("a folder");
        let failure = staged(target)
            .publish()
            .expect_err("a folder is in the way");
        assert_eq!(failure.code(), 6);
        assert!(failure.to_string().contains("report.html"), "{failure}");
        assert!(names(target).is_empty(), "{:?}", names(target));
        Staging::new(target, &["report.html"]).expect_err("before anything is run, if told");
        assert!(names(target).is_empty() && target.join("report.html").is_dir());
    }

    #[cfg(unix)]
    #[test]
    fn a_fifo_in_the_place_of_a_file_stays() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().expect("a folder");
        let fifo = folder.path().join(LAST);
        let made = std::process::Command::new("mkfifo").arg(&fifo).status();
        assert!(made.expect("mkfifo is there").success());
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
