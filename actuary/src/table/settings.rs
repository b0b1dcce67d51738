//! Settings of an operator in the terminal.

use proto::answer::{FunctionItem, SettingsAnswer};

use super::minute;

/// One line per setting.
pub fn settings(settings: &SettingsAnswer) -> String {
    let function = |function: &FunctionItem| {
        format!("{}: {} of {}", function.name, function.needed, function.positions.join(", "))
    };
    let functions: Vec<String> = settings.functions.iter().map(function).collect();
    let functions = if functions.is_empty() { "none".to_owned() } else { functions.join("; ") };
    let set = match (settings.set_at, &settings.set_by) {
        (Some(at), Some(by)) => format!("{} by {by}", minute(at)),
        _ => "never: these are the defaults".to_owned(),
    };
    let lines = [
        ("act now within", format!("{} days or {} fh", settings.act_within_days, settings.act_within_fh)),
        ("risk before a check", format!("{} %", (1e11 * settings.risk).round() / 1e9)),
        ("data are stale after", format!("{} days", settings.stale_after_days)),
        ("time zone", settings.time_zone.clone()),
        ("day begins", settings.day_begins.clone()),
        ("functions", functions),
        ("set", set),
    ];
    lines.iter().map(|(name, value)| format!("{name:<22}{value}\n")).collect()
}
