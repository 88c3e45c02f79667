//! Descriptions of arms: valid and invalid files, the built-in arms, the paper's arm.

mod common;
#[path = "../../../../tests/support/property.rs"]
mod property;

mod assets;
mod bad_input;
mod derived;
mod description;
mod paper;
mod paper_asset;
mod properties;
mod workspace;
