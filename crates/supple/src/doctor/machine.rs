//! Reads machine properties from the kernel's files, below a root directory that tests can replace.

use std::fs;
use std::path::{Path, PathBuf};

/// The files of a machine.
pub struct Machine {
    root: PathBuf,
}

impl Machine {
    /// Creates the access to a machine whose files are below `root`.
    pub fn new(root: &Path) -> Machine {
        Machine {
            root: root.to_owned(),
        }
    }

    /// Path of a file.
    pub fn path(&self, file: &str) -> PathBuf {
        self.root.join(file)
    }

    /// Content of a file without surrounding white space; `None` if it cannot be read.
    pub fn read(&self, file: &str) -> Option<String> {
        let text = fs::read_to_string(self.path(file)).ok()?;
        Some(text.trim().to_owned())
    }

    /// Content of a file as a number.
    pub fn number(&self, file: &str) -> Option<i64> {
        self.read(file)?.parse().ok()
    }

    /// Sorted names in a folder; empty if the folder does not exist.
    pub fn list(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).into_iter().flatten();
        let mut names: Vec<_> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .collect();
        names.sort();
        names
    }

    /// Returns a limit of this process by its name in `/proc/self/limits`; the inner `None` means unlimited, the outer unknown.
    pub fn limit(&self, name: &str) -> Option<Option<u64>> {
        let limits = self.read("proc/self/limits")?;
        let line = limits.lines().find(|line| line.starts_with(name))?;
        let soft = line[name.len()..].split_whitespace().next()?;
        match soft {
            "unlimited" => Some(None),
            number => number.parse().ok().map(Some),
        }
    }

    /// Whether this process has a capability, by its number in `linux/capability.h`.
    pub fn has_capability(&self, number: u32) -> bool {
        let mask = self.read("proc/self/status").and_then(|status| {
            let line = status.lines().find(|line| line.starts_with("CapEff:"))?;
            u64::from_str_radix(line["CapEff:".len()..].trim(), 16).ok()
        });
        mask.is_some_and(|mask| mask >> number & 1 == 1)
    }
}
