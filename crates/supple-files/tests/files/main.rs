//! Files that a user names.

mod special_files;
