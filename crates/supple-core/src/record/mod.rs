//! The layout of a record: a list of fields, each with a name, a shape and a description, and the same fields as a
//! sequence of 64-bit words.
//!
//! [`crate::controller::CycleRecord`] declares the record of a control cycle once. Telemetry carries its words; the
//! message definition of the log, exported tables, fault files and Python columns are derived from its [`Field`]s.

mod columns;
mod layout;
mod text;

pub use layout::{Element, Field, List, Pack, Recorded, Shape, Term, Unpack, words_of};

pub use columns::{Cell, Column, Part, for_each_column};
pub use text::{Text, valid_utf8};
