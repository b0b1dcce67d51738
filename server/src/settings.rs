//! Settings of operators, read and set, for both transports.

use domain::{Act, OperatorId, Settings, Timestamp};
use proto::answer::SettingsAnswer;
use store::OperatorSettings;

use crate::{refusal::Refusal, state::State};

const DAY_S: f64 = 86_400.0;

/// The settings of an operator that are in force, with who set them when.
pub async fn get(state: &State, operator: &OperatorId) -> Result<SettingsAnswer, Refusal> {
    Ok(match state.store.settings(operator).await? {
        Some(version) => told(state, &version),
        None => SettingsAnswer::new(&Settings::default(), None, stale_after_days(state)),
    })
}

/// Sets the settings of an operator.
pub async fn set(
    state: &State,
    operator: &OperatorId,
    settings: &Settings,
    act: Act,
) -> Result<SettingsAnswer, Refusal> {
    Ok(told(state, &state.store.set_settings(operator, settings, act).await?))
}

fn told(state: &State, version: &OperatorSettings) -> SettingsAnswer {
    let set: Option<(Timestamp, _)> = Some((version.set_at, version.set_by));
    SettingsAnswer::new(&version.settings, set, stale_after_days(state))
}

fn stale_after_days(state: &State) -> f64 {
    state.stale_after.as_secs_f64() / DAY_S
}
