//! Settings by environment variables: one that is misspelt would be passed over in silence, and a service would start on another
//! database, or open to others.

use std::env;

use clap::Command;

use crate::say::note;

/// How settings of this program begin.
const PREFIX: &str = "ACTUARY_";
/// So near to a setting that it is meant.
const NEAR: usize = 2;

/// Notes variables that are no setting of any command, but nearly one.
pub fn note_misspelt(program: &Command) {
    let known = settings(program);
    for name in env::vars_os().filter_map(|(name, _)| name.into_string().ok()) {
        if let Some(meant) = meant(&name, &known) {
            note!("note: the environment variable {name} is no setting: is {meant} meant?");
        }
    }
}

/// The variables that a command and those below it know.
fn settings(command: &Command) -> Vec<String> {
    let own = command.get_arguments().filter_map(|argument| argument.get_env());
    let own = own.map(|name| name.to_string_lossy().into_owned());
    own.chain(command.get_subcommands().flat_map(settings)).collect()
}

/// The setting that is nearest to a name that is none.
fn meant<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    if !name.to_ascii_uppercase().starts_with(PREFIX) || known.iter().any(|setting| setting == name) {
        return None;
    }
    let distance = |setting: &String| strsim::osa_distance(&name.to_ascii_uppercase(), setting);
    known.iter().filter(|setting| distance(setting) <= NEAR).min_by_key(|setting| distance(setting)).map(String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variable_that_is_nearly_a_setting_is_told_which() {
        let known = ["ACTUARY_DATABASE_URL", "ACTUARY_PORT", "ACTUARY_TLS_KEY"].map(str::to_owned);
        assert_eq!(meant("ACTUARY_DATABASE_ULR", &known), Some("ACTUARY_DATABASE_URL"));
        assert_eq!(meant("ACTUARY_DATABASEURL", &known), Some("ACTUARY_DATABASE_URL"));
        assert_eq!(meant("Actuary_Port", &known), Some("ACTUARY_PORT"));
        for fine in ["ACTUARY_PORT", "ACTUARY_TEST_POSTGRES", "PORT", "ACTUARY_"] {
            assert_eq!(meant(fine, &known), None, "{fine}");
        }
    }
}
