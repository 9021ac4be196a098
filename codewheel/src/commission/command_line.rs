//! Commands that people can copy: what undoes a change, and what should follow it.

use crate::arguments::commission::EncoderAddress;

/// The command `words` for the encoder at `at`, quoted for a shell. Parameters are left out: by then
/// the encoder works with them.
pub(super) fn command(words: &[&str], at: &EncoderAddress) -> String {
    let mut all = vec!["codewheel".to_owned()];
    all.extend(words.iter().map(|word| (*word).to_owned()));
    let bus = &at.bus;
    let mut option = |name: &str, value: Option<String>| {
        all.extend(value.into_iter().flat_map(|value| [name.to_owned(), value]));
    };
    option("--bus", bus.bus.as_ref().map(ToString::to_string));
    option("--baud", bus.baud.clone());
    option("--address", at.address.map(|address| address.to_string()));
    option("--master", bus.master.map(|address| address.to_string()));
    if bus.join {
        all.push("--join".to_owned());
    }
    let quoted = all.iter().map(|word| quote(word));
    quoted.collect::<Vec<_>>().join(" ")
}

/// What a shell reads as `word`. A NUL cannot be in an argument, so nothing is lost without it.
fn quote(word: &str) -> String {
    shlex::try_quote(&word.replace('\0', "")).map(Into::into).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use crate::arguments::{Arguments, Verb};

    use super::*;

    #[test]
    fn a_command_is_read_by_a_shell_as_what_was_meant() {
        let words = [
            "codewheel",
            "set",
            "direction",
            "ccw",
            "--bus",
            "slcan:./my adapter's port",
            "--address",
            "5",
            "--baud",
            "500k",
            "--master",
            "9",
            "--yes",
        ];
        let Some(Verb::Set(set)) = Arguments::parse_from(words).verb else { panic!("set") };
        let text = command(&["set", "direction", "cw"], &set.encoder);
        assert_eq!(
            shlex::split(&text).expect("well quoted"),
            [
                "codewheel",
                "set",
                "direction",
                "cw",
                "--bus",
                "slcan:./my adapter's port",
                "--baud",
                "500k",
                "--address",
                "5",
                "--master",
                "9",
            ]
        );
    }
}
