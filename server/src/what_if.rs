//! What if a component flew otherwise: answered for both transports and the page, without any effect.

use std::sync::Arc;

use domain::{
    Ahead, AsOf, Assumption, Invalid, OperatorId, Pace, Position, Prognosis, Schedule, TailNumber, ahead::LoadAhead,
};
use proto::answer::{AskedProbability, FailureProbability, WhatIfAnswer};
use store::Installed;

use crate::{
    answer::{self, RulQuestion},
    forecaster::ForecastError,
    refusal::Refusal,
    state::Shared,
};

/// Questions that are computed at the same time.
pub const AT_ONCE: usize = 2;

/// The remaining life of what is at a position, as it is and under an assumption.
pub async fn what_if(
    shared: &Shared,
    operator: &OperatorId,
    (tail, position): (&TailNumber, &Position),
    assumption: &Assumption,
) -> Result<WhatIfAnswer, Refusal> {
    let installed = answer::installed_at(&shared.state, operator, tail, position).await?;
    let (as_of, pace) = forecast_of(&installed)?;
    must_be_known(pace, assumption)?;
    let before = answer::schedule(&installed, as_of);
    let schedule = assumption.schedule(&before);
    let (flown, assumed) = (installed.plan.ahead(&before), assumption.ahead(&installed.plan, &schedule));
    let extrapolation = pace.and_then(|pace| extrapolation(pace, &assumed));
    // Without a pace, what lies ahead changes no hours.
    let prognosis = match pace.is_none() || assumed == flown {
        true => installed.prognosis.clone(),
        false => Some(prognosis(shared, operator, &installed, assumed).await?),
    };
    let (present, asked) = (shared.state.present(operator).await?, RulQuestion::default());
    let varied = Installed { prognosis, ..installed.clone() };
    Ok(WhatIfAnswer {
        probability: probability(assumption, (&installed, &before), (&varied, &schedule))?,
        now: answer::rul(&present, &installed, &asked),
        assumed: answer::rul_by(&present, &varied, &asked, Some(&schedule)),
        extrapolation: extrapolation.is_some(),
        extrapolation_reason: extrapolation,
    })
}

/// The newest data of a forecast, and its pace.
fn forecast_of(installed: &Installed) -> Result<(&AsOf, Option<&Pace>), Refusal> {
    let prognosis = installed.prognosis.as_ref();
    let forecast = prognosis.and_then(|prognosis| Some((&prognosis.as_of, prognosis.forecast.as_ref().ok()?)));
    let missing = || {
        let Installed { tail, position, .. } = installed;
        let missing = answer::missing(&installed.in_short()).unwrap_or_default();
        Refusal::Contradiction(format!("there is no forecast for position {position} of tail {tail} yet: {missing}"))
    };
    forecast.map(|(as_of, forecast)| (as_of, forecast.pace.as_ref())).ok_or_else(missing)
}

/// Refuses what nobody can reckon with.
fn must_be_known(pace: Option<&Pace>, assumption: &Assumption) -> Result<(), Refusal> {
    const UNKNOWN: &str = "cannot be reckoned with: nobody knows what load and temperature do to this component (its RUL \
                           tells no pace); hours a day and dates can";
    let mut invalid = Invalid::default();
    if pace.is_none() {
        assumption.load_factor.inspect(|_| invalid.push("#/load_factor", UNKNOWN));
        assumption.temperature_offset_c.inspect(|_| invalid.push("#/temperature_offset_c", UNKNOWN));
    }
    Ok(invalid.into_result(Some(()))?)
}

/// Why a forecast reaches beyond what was ever seen, if it does.
fn extrapolation(pace: &Pace, ahead: &Ahead) -> Option<String> {
    let told = |stretch: &domain::ahead::Stretch| match stretch.load {
        None => None,
        Some(LoadAhead::Times(times)) => Some(pace.load * times),
        Some(LoadAhead::Ratio(ratio)) => Some(ratio),
    };
    let mut loads = ahead.stretches.iter().filter_map(told);
    match pace.seen_loads {
        None => {
            loads.next().map(|_| "no past life tells what other loads do: the exponent is taken as given".to_owned())
        }
        Some([least, greatest]) => {
            let outside = loads.find(|load| !(least..=greatest).contains(load))?;
            Some(format!("a load of {outside:.2} is outside {least:.2} to {greatest:.2}, which past lives have flown"))
        }
    }
}

/// The prognosis for other flights ahead. Few are computed at a time; one that nobody waits for any longer keeps its
/// place until it has ended.
async fn prognosis(
    shared: &Shared,
    operator: &OperatorId,
    installed: &Installed,
    ahead: Ahead,
) -> Result<Prognosis, Refusal> {
    let busy = |_| Refusal::Unavailable(format!("{AT_ONCE} such questions are being computed already"));
    let place = Arc::clone(&shared.what_ifs).try_acquire_owned().map_err(busy)?;
    let forecasting = shared.state.forecaster.what_if(answer::component(operator, installed), ahead);
    let forecasting = tokio::spawn(async move {
        let forecast = forecasting.await;
        drop(place);
        forecast
    });
    match forecasting.await {
        Ok(Ok(Some(prognosis))) => Ok(prognosis),
        Ok(Ok(None)) => Err(Refusal::Contradiction("nothing counts of this component any longer".to_owned())),
        Ok(Err(ForecastError::Store(error))) => Err(error.into()),
        Ok(Err(ForecastError::Analysis(reason))) => {
            tracing::error!(reason, "what was asked about cannot be forecast");
            Err(Refusal::Internal)
        }
        Err(error) => {
            tracing::error!(%error, "a forecast ended abnormally");
            Err(Refusal::Internal)
        }
    }
}

/// The probability of a failure by the time, or within the hours, that was asked about: as it is, and as assumed.
fn probability(
    assumption: &Assumption,
    now: (&Installed, &Schedule),
    assumed: (&Installed, &Schedule),
) -> Result<Option<AskedProbability>, Refusal> {
    let told = |(installed, schedule): (&Installed, &Schedule)| {
        let hours = assumption.within_fh.or_else(|| schedule.hours_until(assumption.by?))?;
        let forecast = installed.prognosis.as_ref()?.forecast.as_ref().ok()?;
        Some(FailureProbability::new(&forecast.rul, hours))
    };
    if assumption.by.is_none() && assumption.within_fh.is_none() {
        return Ok(None);
    }
    let told = AskedProbability { by: assumption.by.map(|by| by.to_string()), now: told(now), assumed: told(assumed) };
    if told.assumed.is_none() && told.now.is_none() {
        let unknown = "nobody knows how much the tail flies until then: give utilisation_fh_per_day, or within_fh";
        return Err(Refusal::Invalid(Invalid::one("#/by", unknown)));
    }
    Ok(Some(told))
}
