//! Files that a user names.

mod excerpts;
mod special_files;
