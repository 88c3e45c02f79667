//! Tests of the server with a scripted controller on shared memory, and with a client that implements its protocols.

mod client;
mod controller;
mod live;
mod passing;
mod replay;
mod security;
mod stalled;
