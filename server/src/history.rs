//! The history of a life of a component, a page at a time, assembled once for both transports.

use domain::Component;
use proto::answer::{HealthItem, Page, StateItem};
use store::{HistoryOf, LifeCursor, LifeRecord};

use crate::{
    answer::{self, fault_models, fault_names, next_cursor},
    cursor,
    refusal::Refusal,
    state::State,
};

/// A part of a history, and the length of its pages.
pub struct Range {
    /// First flight hours of interest.
    pub from_fh: Option<f64>,
    /// Flight hours before which to end.
    pub to_fh: Option<f64>,
    /// Which life; the newest one unless it is named.
    pub life: Option<u32>,
    /// Which generation of the life; the one that answers unless it is named.
    pub generation: Option<u32>,
    /// Most items.
    pub limit: u32,
}

impl Range {
    fn of(&self) -> HistoryOf {
        HistoryOf { life: self.life, generation: self.generation }
    }
}

/// The kind of the items, and the one after which to begin.
pub enum View {
    /// One estimate per upload.
    Estimates(Option<LifeCursor>),
    /// The closed blocks of 20 flight hours.
    States(Option<u64>),
}

impl View {
    /// The view of estimates from a cursor's text.
    pub fn estimates_after(text: &str) -> Option<Self> {
        cursor::decode(text).map(|after| Self::Estimates(Some(after)))
    }

    /// The view of states from a cursor's text.
    pub fn states_after(text: &str) -> Option<Self> {
        text.parse().ok().map(|after| Self::States(Some(after)))
    }
}

/// A page of either view.
pub enum History {
    /// Estimates.
    Estimates(Page<HealthItem>),
    /// States.
    States(Page<StateItem>),
}

/// One page of the history of a component.
pub async fn history(state: &State, component: &Component, range: &Range, view: View) -> Result<History, Refusal> {
    if range.life.is_some() || range.generation.is_some() {
        must_have(state, component, range).await?;
    }
    match view {
        View::Estimates(after) => estimates(state, component, range, after).await.map(History::Estimates),
        View::States(after) => states(state, component, range, after).await.map(History::States),
    }
}

/// Refuses a life that a component has not had yet, and a generation that the life has not.
async fn must_have(state: &State, component: &Component, range: &Range) -> Result<(), Refusal> {
    let lives = answer::record(state, component).await?.lives;
    let life = life(component, &lives, range.life)?;
    let Component { part_number, serial_number, .. } = component;
    let has = |wanted: u32| life.generations.iter().any(|one| one.generation.number == wanted);
    match range.generation {
        Some(wanted) if !has(wanted) => Err(Refusal::NotFound(format!(
            "life {} of component {part_number} {serial_number} has no generation {wanted}: generation {} answers",
            life.overhaul_index, life.generation.number
        ))),
        _ => Ok(()),
    }
}

/// The life of a component by its number, or the newest one.
pub fn life<'a>(
    component: &Component,
    lives: &'a [LifeRecord],
    wanted: Option<u32>,
) -> Result<&'a LifeRecord, Refusal> {
    let newest = lives.len().saturating_sub(1);
    let number = wanted.map_or(newest, |life| life as usize);
    lives.get(number).ok_or_else(|| {
        let told = match newest {
            0 => "it has not been overhauled, its only life is 0".to_owned(),
            newest => format!("its lives are 0 to {newest}"),
        };
        let Component { part_number, serial_number, .. } = component;
        Refusal::NotFound(format!("component {part_number} {serial_number} has no life {number}: {told}"))
    })
}

async fn estimates(
    state: &State,
    component: &Component,
    range: &Range,
    after: Option<LifeCursor>,
) -> Result<Page<HealthItem>, Refusal> {
    let read =
        state.store.estimates(component, range.of(), range.from_fh, range.to_fh, after.as_ref(), range.limit + 1);
    let mut estimates = read.await?;
    let next_cursor = next_cursor(&mut estimates, range.limit, |estimate| cursor::encode(&LifeCursor::from(estimate)));
    let models = fault_models(state).await?;
    let items = estimates.iter().map(|estimate| HealthItem::new(estimate, fault_names(&models, &estimate.model)));
    Ok(Page { items: items.collect(), next_cursor })
}

async fn states(
    state: &State,
    component: &Component,
    range: &Range,
    after: Option<u64>,
) -> Result<Page<StateItem>, Refusal> {
    let mut states =
        state.store.states(component, range.of(), range.from_fh, range.to_fh, after, range.limit + 1).await?;
    let next_cursor = next_cursor(&mut states, range.limit, |state| state.block.to_string());
    Ok(Page { items: states.iter().map(StateItem::from).collect(), next_cursor })
}
