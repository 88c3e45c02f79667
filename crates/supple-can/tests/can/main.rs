//! The process that owns the bus, and its parts.

mod command_line;
mod guard;
mod shared_memory;
