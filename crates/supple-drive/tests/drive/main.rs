//! Tests of the plant loop: safe action, laying down, and link to the controller.

mod guard;
mod shared_memory;
mod stow;
