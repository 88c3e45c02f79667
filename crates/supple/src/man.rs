//! `supple man`: creates the manual page of every command from the definition of its arguments.

use clap::Command;
use std::fs;
use std::path::{Path, PathBuf};
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;

/// Section of the manual for programs.
const SECTION: &str = "1";

/// Writes one page for each command into a folder.
///
/// # Errors
/// [`Failure::File`].
pub fn run(mut command: Command, folder: &Path, as_json: bool) -> Result<(), Failure> {
    command.build();
    let mut pages = Vec::new();
    add(&command, "supple", &mut pages).map_err(|error| Failure::file("write", folder, error))?;
    let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
    if let Some(parent) = folder.parent() {
        fs::create_dir_all(parent).map_err(|error| Failure::file("create", parent, error))?;
    }
    let staging = Staging::new(folder, &names)?;
    for (name, text) in &pages {
        staging.write(name, text)?;
    }
    staging.publish()?;
    let written: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    match as_json {
        true => print_json(&written),
        false => print_line(&format!("{} pages in {}", written.len(), folder.display())),
    }
}

/// Adds the pages of a command and of its subcommands, with names such as `supple-log-info.1`.
fn add(command: &Command, name: &str, pages: &mut Vec<(String, Vec<u8>)>) -> std::io::Result<()> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone().display_name(name.to_owned()))
        .section(SECTION)
        .render(&mut text)?;
    pages.push((format!("{name}.{SECTION}"), text));
    for sub in command.get_subcommands() {
        if sub.get_name() != "help" && !sub.is_hide_set() {
            add(sub, &format!("{name}-{}", sub.get_name()), pages)?;
        }
    }
    Ok(())
}
