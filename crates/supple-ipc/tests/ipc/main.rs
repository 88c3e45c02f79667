//! Tests of messages and services between the threads of one process.

#[path = "../../../../tests/support/property.rs"]
mod property;
#[path = "../support/mod.rs"]
mod support;

mod leaving;
mod messages;
mod services;
mod short_waits;
mod wake_request;
mod writers;
