//! The order of a component's flight hours and times, parted by its overhauls.

use domain::{Component, Timestamp};

use super::super::{
    Connection,
    ground::{key::BindKey, row::hours_column, sealed::Sealed},
};
use super::life::{LifeRow, life_columns, lives};
use crate::{LifeBeginning, StoreError};

/// The overhauls of a component that count, as places in its order of hours and times.
pub(crate) struct Overhauls(Vec<(f64, i64)>);

impl Overhauls {
    /// The overhauls with which lives began, in their order.
    pub(crate) fn from_lives(rows: Vec<LifeRow>) -> Result<Self, StoreError> {
        let places = rows.into_iter().map(|row| row.checked().map(|row| (row.began_fh, row.began_at)));
        places.collect::<Result<_, _>>().map(Self)
    }

    /// The life in which a component is at some hours and time: as many overhauls are before.
    pub(crate) fn life_at(&self, flight_hours: f64, at: Timestamp) -> i64 {
        self.0.partition_point(|overhaul| *overhaul < (flight_hours, at.micros())) as i64
    }

    /// The life that the component is in.
    pub(crate) fn newest_life(&self) -> i64 {
        self.0.len() as i64
    }

    /// The component's hours since new at which a life began.
    pub(crate) fn began_fh(&self, overhaul_index: i64) -> f64 {
        let before = usize::try_from(overhaul_index - 1).ok();
        before.and_then(|before| self.0.get(before)).map_or(0.0, |(flight_hours, _)| *flight_hours)
    }
}

/// The overhauls with which the lives of a component began.
pub(crate) async fn of_component(connection: &mut Connection, component: &Component) -> Result<Overhauls, StoreError> {
    let query = sqlx::query_as(lives!("and l.overhaul_index > 0 order by l.overhaul_index"));
    let rows: Vec<LifeRow> = query.bind_component(component).fetch_all(connection).await?;
    Overhauls::from_lives(rows)
}

/// The last place in the order (flight_hours, time) that is still of a life.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LifeEnd {
    pub(crate) flight_hours: f64,
    pub(crate) at: i64,
}

impl LifeEnd {
    pub(crate) const NEVER: Self = Self { flight_hours: f64::MAX, at: i64::MAX };

    pub(crate) fn from_overhaul(overhaul: &LifeBeginning) -> Self {
        Self { flight_hours: hours_column(overhaul.flight_hours), at: overhaul.occurred_at.micros() }
    }
}
