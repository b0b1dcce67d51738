//! The commands at a glance: in groups by what they are for, each with the first sentence of its help.

use clap::{Command, CommandFactory};

use crate::terminal::{self, wrapped};

/// Groups of commands, in the order in which a newcomer meets them. A test holds them against the commands that there are.
const GROUPS: [(&str, &[&str]); 8] = [
    ("Ask a running service", &["fleet", "due", "rul", "component", "what-if", "watch", "checks", "settings"]),
    ("Run it", &["demo", "serve", "worker", "migrate", "healthcheck"]),
    ("Keep its database", &["backup", "restore", "verify", "rebuild"]),
    ("Give out keys", &["token", "frame"]),
    ("Make and choose models", &["train", "model"]),
    ("Work on recorded data", &["backtest", "diagnose", "loads"]),
    ("Simulate", &["simulate"]),
    ("Your shell", &["completions"]),
];
/// No line of help is wider, as clap has it.
const WIDEST: usize = 100;
/// Where the sentences begin: wider than the longest name and its margins.
const INDENT: usize = 15;

/// The command line, with its commands in groups.
pub fn program<C: CommandFactory>() -> Command {
    let program = C::command();
    let list = listed(&program, terminal::width().min(WIDEST));
    program.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}\nOptions:\n{{options}}\n\n\
         `actuary COMMAND --help` tells more, with an example. Begin with `actuary demo`, then `actuary fleet`.\n"
    ))
}

fn listed(program: &Command, width: usize) -> String {
    let group = |(heading, names): &(&str, &[&str])| {
        let lines: String =
            names.iter().filter_map(|name| program.find_subcommand(name)).map(|it| line(it, width)).collect();
        format!("{heading}:\n{lines}")
    };
    GROUPS.iter().map(group).collect::<Vec<_>>().join("\n")
}

fn line(command: &Command, width: usize) -> String {
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let sentence = [". ", ": ", "; "].iter().fold(about.as_str(), |text, end| text.split(end).next().unwrap_or(text));
    wrapped(&format!("{:<INDENT$}", format!("  {}", command.get_name())), sentence, width) + "\n"
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::Cli;

    #[test]
    fn each_command_is_in_one_group() {
        let program = Cli::command();
        let there: BTreeSet<_> = program.get_subcommands().map(Command::get_name).collect();
        let grouped: Vec<_> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        assert_eq!(grouped.iter().copied().collect::<BTreeSet<_>>(), there);
        assert_eq!(grouped.len(), there.len(), "none is in two");
    }

    #[test]
    fn the_list_fits_its_width() {
        for width in [40, 80, 100] {
            let list = listed(&Cli::command(), width);
            let widest = list.lines().map(terminal::cells).max();
            assert!(widest <= Some(width), "{list}");
            assert!(list.lines().all(|line| !line.trim().is_empty() || line.is_empty()), "{list}");
        }
        assert!(GROUPS.iter().flat_map(|(_, names)| *names).all(|name| name.len() + 4 <= INDENT));
    }
}
