//! Parsing of a command line.

use clap::{ArgAction, Command, Parser};

/// Parses the program's arguments, or ends it with clap's message. `--speed -1` is a value out of range, not an unknown
/// option `-1`.
pub fn parse<P: Parser>() -> P {
    let matches = with_negative_numbers(P::command()).get_matches();
    P::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

/// Makes every option with a value also accept negative numbers.
pub fn with_negative_numbers(command: Command) -> Command {
    command
        .mut_args(|argument| match argument.get_action() {
            ArgAction::Set | ArgAction::Append
                if !argument.is_positional() && !argument.is_allow_hyphen_values_set() =>
            {
                argument.allow_negative_numbers(true)
            }
            _ => argument,
        })
        .mut_subcommands(with_negative_numbers)
}

#[cfg(test)]
mod tests {
    use super::with_negative_numbers;
    use clap::{Arg, Command};

    #[test]
    fn a_negative_number_is_the_value_of_the_option_before_it() {
        let sub = Command::new("track").arg(Arg::new("speed").long("speed"));
        let command = with_negative_numbers(Command::new("supple").subcommand(sub));
        let matches = command
            .try_get_matches_from(["supple", "track", "--speed", "-1"])
            .expect("a value");
        let (_, track) = matches.subcommand().expect("a subcommand");
        assert_eq!(track.get_one::<String>("speed").expect("given"), "-1");
    }
}
