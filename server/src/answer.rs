//! Answers, assembled once for REST, gRPC and the pages.

use domain::{
    ADVISORY, AsOf, Component, ContentHash, Ensemble, FaultModel, OperatorId, Position, RulDistribution, Schedule,
    TailNumber, UtilisationSource,
};
use proto::answer::{
    EndOfLife, FailureProbability, Fault, MaskAnswer, ModelItem, MonteCarlo, Page, RulAnswer, RulQuantiles, TailAnswer,
    TailItem,
};
use store::{BundleRecord, ComponentRecord, Installed, LifeBeginning, SetAsideUploads, TailInShort, Unit};

use crate::{
    CODE_VERSION,
    dates::time_after,
    judged,
    present::Present,
    question::{Question, Sent},
    refusal::Refusal,
    state::State,
};

/// Hours for which P(failure within) is told unless asked otherwise.
const WITHIN_FH: [f64; 5] = [100.0, 250.0, 500.0, 1000.0, 2000.0];

/// What is asked about a remaining life.
#[derive(Debug, Clone, Default)]
pub struct RulQuestion {
    /// The hours for which P(failure within) is told; some where none are asked about.
    pub within_fh: Option<Vec<f64>>,
    /// What it has to last for.
    pub before: Question,
}

impl RulQuestion {
    /// A question about hours, and about what it has to last for as it was sent. A single hour is also that, unless a day or
    /// a check is.
    pub fn new(within_fh: Option<Vec<f64>>, sent: Sent, present: &Present) -> Result<Self, Refusal> {
        let within = match within_fh.as_deref() {
            Some(&[hours]) if sent.by.is_none() && sent.check.is_none() => Some(hours),
            _ => None,
        };
        let before = Sent { within_fh: within, ..sent }.checked(present)?;
        Ok(Self { within_fh, before })
    }
}

/// The remaining life of an installed component as it reads now.
pub fn rul(present: &Present, installed: &Installed, asked: &RulQuestion) -> RulAnswer {
    rul_by(present, installed, asked, None)
}

/// The same by other flight hours per day than those of its tail.
pub fn rul_by(present: &Present, installed: &Installed, asked: &RulQuestion, flown: Option<&Schedule>) -> RulAnswer {
    let judged = judged::installed(present, &asked.before, installed, flown);
    let prognosis = installed.prognosis.as_ref();
    let forecast = prognosis.and_then(|prognosis| prognosis.forecast.as_ref().ok());
    let distribution = forecast.map(|forecast| &forecast.rul);
    let within_fh = asked.within_fh.as_deref().unwrap_or(&WITHIN_FH);
    RulAnswer {
        tail: installed.tail.to_string(),
        position: installed.position.to_string(),
        displaced: !installed.place_known,
        part_number: installed.part_number.to_string(),
        serial_number: installed.serial_number.to_string(),
        life: installed.overhaul_index,
        as_of: prognosis.map(|prognosis| prognosis.as_of.clone()),
        status: judged.status,
        urgency: judged.urgency,
        before: judged.before,
        was_due_by: judged.was_due_by,
        data_age_days: judged.data_age_days,
        found_failed_fh: installed.found_failed_fh,
        missing: forecast.is_none().then(|| missing(&installed.in_short())).flatten(),
        rul_fh: distribution.map(RulQuantiles::from),
        censored_fraction: distribution.map(RulDistribution::censored_fraction),
        horizon_fh: distribution.map(RulDistribution::horizon_fh),
        probability_of_failure: distribution
            .map(|rul| within_fh.iter().map(|&hours| FailureProbability::new(rul, hours)).collect()),
        end_of_life: prognosis.zip(distribution).and_then(|(prognosis, rul)| {
            end_of_life(present, rul, &flown.cloned().unwrap_or_else(|| schedule(installed, &prognosis.as_of)))
        }),
        fault_vector: forecast.map(|forecast| Fault::by_name(&forecast.faults)),
        dominant_fault: forecast.map(|forecast| forecast.dominant_fault.clone()),
        estimator: forecast.map(|forecast| forecast.ensemble.clone().unwrap_or_else(Ensemble::growth)),
        explanation: forecast.map(|forecast| forecast.explanation.clone()),
        doubts: forecast.map(|forecast| forecast.doubts.clone()),
        load: prognosis.and_then(|prognosis| prognosis.load.clone()),
        pace: forecast.and_then(|forecast| forecast.pace.clone()),
        load_agreement: prognosis.and_then(|prognosis| prognosis.load_agreement.clone()),
        propagation: forecast.map(|forecast| forecast.propagation.clone()),
        monte_carlo: forecast.map(|forecast| MonteCarlo {
            draws: forecast.rul.draws(),
            seed: forecast.seed,
            p10_error_fh: forecast.p10_error_fh,
            median_error_fh: forecast.median_error_fh,
        }),
        model: prognosis.map(|prognosis| prognosis.model.to_string()),
        prior: prognosis.map(|prognosis| prognosis.prior.to_string()),
        mask_id: prognosis.and_then(|prognosis| prognosis.mask_id).map(String::from),
        generation: prognosis.map(|prognosis| prognosis.generation),
        numerics_version: prognosis.map(|prognosis| prognosis.numerics_version),
        code_version: CODE_VERSION.to_owned(),
        pending_uploads: installed.pending_uploads,
        set_aside_uploads: installed.set_aside.count,
        advisory: ADVISORY.to_owned(),
    }
}

/// The lack that keeps a component from having a forecast; `None` when there is one.
pub fn missing(unit: &Unit) -> Option<String> {
    if unit.is_damaged {
        return Some("what is stored of this component is damaged: nothing of it is told; see the log".to_owned());
    }
    let missing = match &unit.prognosis {
        None if unit.set_aside.count > 0 => "no upload of this component counts",
        None => "no upload of this component has been judged yet",
        Some(prognosis) => &prognosis.outlook.as_ref().err()?.missing,
    };
    let missing = missing.to_owned() + &set_aside(unit) + &before_overhaul(unit);
    Some(match &unit.began {
        None => missing,
        Some(overhaul) => {
            let LifeBeginning { flight_hours, occurred_at, .. } = overhaul;
            format!("since the overhaul at {flight_hours:.1} flight hours ({occurred_at}): {missing}")
        }
    })
}

/// Tells that uploads were judged and are set aside, and why.
fn set_aside(unit: &Unit) -> String {
    let SetAsideUploads { count, reason, newest } = &unit.set_aside;
    let Some(reason) = reason else { return String::new() };
    let uploads = if *count == 1 { "1 upload is".to_owned() } else { format!("{count} uploads are") };
    let newest = newest.as_ref().map(|one| format!(". The newest, {}: {}", one.upload_id, one.detail));
    format!("; {uploads} set aside, most for {}{}", reason.as_str(), newest.unwrap_or_default())
}

/// Tells that uploads since the overhaul claim to be from before it.
fn before_overhaul(unit: &Unit) -> String {
    match unit.before_overhaul {
        0 => String::new(),
        count => format!(
            "; {count} recorded since have fewer hours and count before it: hours since new go on after an overhaul"
        ),
    }
}

/// Flight hours per day of the tail from the newest data on.
pub fn schedule(installed: &Installed, as_of: &AsOf) -> Schedule {
    installed.plan.schedule(as_of.recorded_at, installed.utilisation_fh_per_day)
}

/// Dates at which quantiles of remaining life are flown; `None` for a tail that does not fly, as far as is known.
pub fn end_of_life(present: &Present, rul: &RulDistribution, schedule: &Schedule) -> Option<EndOfLife> {
    dates(present, [0.10, 0.50, 0.90].map(|level| rul.quantile_fh(level)), schedule)
}

/// Dates at which the 10 %, 50 % and 90 % quantiles are flown.
pub fn dates(present: &Present, quantiles: [Option<f64>; 3], schedule: &Schedule) -> Option<EndOfLife> {
    let day = |hours| time_after(schedule, hours).map(|time| present.zone().day_of(time).to_string());
    let [date_p10, date_p50, date_p90] = quantiles.map(|hours| day(hours?));
    let first = quantiles.into_iter().flatten().next();
    let fh_per_day = match schedule.source() {
        UtilisationSource::Plan => first.and_then(|hours| schedule.mean_fh_per_day(hours)),
        UtilisationSource::Learned | UtilisationSource::Assumed => None,
    };
    let fh_per_day = fh_per_day.or(schedule.fh_per_day_at_first());
    fh_per_day.filter(|fh_per_day| *fh_per_day > 0.0).map(|utilisation_fh_per_day| EndOfLife {
        date_p10,
        date_p50,
        date_p90,
        utilisation_fh_per_day,
        utilisation_source: schedule.source(),
    })
}

/// The component that is installed at a position.
pub async fn installed_at(
    state: &State,
    operator: &OperatorId,
    tail: &TailNumber,
    position: &Position,
) -> Result<Installed, Refusal> {
    if let Some(found) = state.store.installed_at(operator, tail, position).await? {
        return Ok(found);
    }
    let known = state.store.knows_place(operator, tail, position).await?;
    let word = if known { "installed now" } else { "known" };
    Err(Refusal::NotFound(format!("nothing is {word} at position {position} of tail {tail}")))
}

/// The remaining life at every position of a tail.
pub async fn tail_ruls(
    state: &State,
    present: &Present,
    operator: &OperatorId,
    tail: &TailNumber,
    asked: &RulQuestion,
) -> Result<Vec<RulAnswer>, Refusal> {
    let installed = state.store.installed(operator, tail).await?;
    if installed.is_empty() && !state.store.knows_tail(operator, tail).await? {
        return Err(Refusal::NotFound(format!("tail {tail} is not known")));
    }
    Ok(installed.iter().map(|installed| rul(present, installed, asked)).collect())
}

/// A tail: what is installed on it, and what was last there and has no known place.
pub async fn tail(
    state: &State,
    present: &Present,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<TailAnswer, Refusal> {
    let asked = RulQuestion::default();
    let ruls = tail_ruls(state, present, operator, tail, &asked).await?;
    let mut displaced = state.store.displaced(operator).await?;
    displaced.retain(|one| one.tail == *tail);
    let displaced = displaced.iter().map(|one| rul(present, one, &asked)).collect();
    Ok(TailAnswer::new(tail.to_string(), ruls, displaced))
}

/// One page of tails, from the first after `after`.
pub async fn tails(
    state: &State,
    present: &Present,
    operator: &OperatorId,
    after: Option<&TailNumber>,
    limit: u32,
) -> Result<Page<TailItem>, Refusal> {
    let mut tails = state.store.tails_in_short(operator, after, limit + 1).await?;
    let next_cursor = next_cursor(&mut tails, limit, |tail| tail.tail.to_string());
    let item = |tail: TailInShort| TailItem {
        status: present.status_of_tail(&tail),
        rul_p10_fh: tail.p10_fh,
        positions: tail.positions,
        tail: tail.tail.into(),
    };
    Ok(Page { items: tails.into_iter().map(item).collect(), next_cursor })
}

/// Cuts the item that was read beyond `limit`, and tells the cursor after the last that stays.
pub fn next_cursor<T>(items: &mut Vec<T>, limit: u32, cursor: impl Fn(&T) -> String) -> Option<String> {
    let more = items.len() > limit as usize;
    items.truncate(limit as usize);
    items.last().filter(|_| more).map(cursor)
}

/// A component, if anything is known of it.
pub async fn known(state: &State, component: Component) -> Result<Component, Refusal> {
    match state.store.knows_component(&component).await? {
        false => Err(unknown(&component)),
        true => Ok(component),
    }
}

/// Refuses a tail that was never heard of: what is planned for it enrols nothing, and is taken for a slip.
pub async fn known_tail(state: &State, operator: &OperatorId, tail: &TailNumber) -> Result<(), Refusal> {
    match state.store.knows_tail(operator, tail).await? {
        true => Ok(()),
        false => Err(Refusal::NotFound(format!("tail {tail} is not known"))),
    }
}

/// The record of a component.
pub async fn record(state: &State, component: &Component) -> Result<ComponentRecord, Refusal> {
    state.store.component(component).await?.ok_or_else(|| unknown(component))
}

fn unknown(Component { part_number, serial_number, .. }: &Component) -> Refusal {
    Refusal::NotFound(format!("component {part_number} {serial_number} is not known"))
}

/// All bundles, the oldest first.
pub async fn models(state: &State) -> Result<Page<ModelItem>, Refusal> {
    let bundles = state.store.bundles().await?;
    let items = bundles.iter().map(|bundle| ModelItem::new(&bundle.summary, bundle.active)).collect();
    Ok(Page { items, next_cursor: None })
}

/// The bundle of a hash.
pub async fn bundle(state: &State, hash: &ContentHash) -> Result<BundleRecord, Refusal> {
    let mut bundles = state.store.bundles().await?.into_iter();
    let found = bundles.find(|bundle| bundle.summary.hash == *hash);
    found.ok_or_else(|| Refusal::NotFound(format!("model {hash} is not known: GET /v1/models names all")))
}

/// The mask to sample by for a bundle, or for the active one.
pub async fn mask(state: &State, hash: Option<&ContentHash>) -> Result<MaskAnswer, Refusal> {
    let record = match hash {
        Some(hash) => bundle(state, hash).await?,
        None => {
            let mut bundles = state.store.bundles().await?.into_iter();
            bundles.find(|bundle| bundle.active).ok_or_else(|| Refusal::NotFound("no model is active".to_owned()))?
        }
    };
    let none = || {
        let (hash, names) = (record.summary.hash, record.summary.faults.names.join(", "));
        Refusal::NotFound(format!("model {hash} reads no samples and has no mask: its uploads bring faults: {names}"))
    };
    let mask = record.summary.masks.first().ok_or_else(none)?;
    Ok(MaskAnswer::new(mask, record.summary.hash))
}

/// The fault model of each bundle.
pub async fn fault_models(state: &State) -> Result<Vec<(ContentHash, FaultModel)>, Refusal> {
    let bundles = state.store.bundles().await?;
    Ok(bundles.into_iter().map(|bundle| (bundle.summary.hash, bundle.summary.faults)).collect())
}

/// Names of the faults that `model` diagnoses.
pub fn fault_names<'a>(models: &'a [(ContentHash, FaultModel)], model: &ContentHash) -> &'a [String] {
    models.iter().find(|(hash, _)| hash == model).map(|(_, faults)| faults.names.as_slice()).unwrap_or_default()
}

/// The component that is installed.
pub fn component(operator: &OperatorId, installed: &Installed) -> Component {
    Component {
        operator: operator.clone(),
        part_number: installed.part_number.clone(),
        serial_number: installed.serial_number.clone(),
    }
}
