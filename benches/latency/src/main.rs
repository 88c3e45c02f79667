//! Starts and measures one of three: a system, its messages alone, or an echo of datagrams, all at the same rate; prints all
//! times as JSON. `run.sh` alternates it with cyclictest.

mod common;
mod echo;
mod messages;
mod system;

use common::{Common, Failure};

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Parser)]
#[command(about)]
struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// The simulated arm and its controller as processes, in gravity hold.
    System {
        /// Folder of supple-sim and supple-rt.
        #[arg(long)]
        programs: PathBuf,
        #[command(flatten)]
        common: Common,
    },
    /// Two processes that exchange Unix datagrams of the sizes of a system's messages.
    Echo {
        #[command(flatten)]
        common: Common,
    },
    /// Two processes that exchange the messages of a system through shared memory without any computation.
    Messages {
        #[command(flatten)]
        common: Common,
    },
    /// The replying process of `messages`, which starts it.
    #[command(hide = true)]
    Answer {
        #[command(flatten)]
        common: Common,
    },
    /// The replying process of `echo`, which starts it with the socket as standard input.
    #[command(hide = true)]
    Reflect {
        #[command(flatten)]
        common: Common,
    },
}

fn run(what: &What) -> Result<(), Failure> {
    let measured = match what {
        What::System { programs, common } => system::measure(programs, common)?,
        What::Echo { common } => echo::measure(common)?,
        What::Messages { common } => messages::measure(common)?,
        What::Reflect { common } => return echo::answer_echo(common),
        What::Answer { common } => return messages::answer(common),
    };
    println!("{}", serde_json::to_string(&measured)?);
    Ok(())
}

fn main() -> ExitCode {
    match run(&Options::parse().what) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("latency: error: {error}");
            ExitCode::FAILURE
        }
    }
}
