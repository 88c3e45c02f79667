//! The server against a scripted controller on real shared memory, and a client of its protocols byte by byte.

mod client;
mod controller;
mod live;
mod passing;
mod replay;
mod security;
mod stalled;
