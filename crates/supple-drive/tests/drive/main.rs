//! The plant loop: its guard, and its link to the controller.

mod guard;
mod shared_memory;
mod stow;
