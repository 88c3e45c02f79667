//! Tests of the access to files that a user names, and of the excerpts of their content in messages.

mod excerpts;
mod special_files;
