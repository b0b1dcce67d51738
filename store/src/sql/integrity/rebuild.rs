//! Throwing away what can be made anew.
//!
//! Card. *What:* uploads, voids, events, sensor configurations, bundles, priors, and by which generations
//! lives are judged are sources; prognoses are the record of what was issued. All else that is known of
//! components follows from the sources: estimates, states, exclusions, checkpoints and set-aside marks of
//! the generations that answer or will, where components were installed, and which finding ended each life.
//! *Rule:* per operator first the installations, in one transaction; then per component, some in a
//! transaction: its results go, its uploads wait again, and a worker finds the rest. Generations that
//! answered before are history and stay. *Invariant:* what is left between two transactions is a database
//! like any other, in which some uploads wait.

use domain::{Component, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    access::operators,
    board::following::{self, Flown},
    ground::{
        key::BindKey,
        write::{Reach, Write},
    },
    lives::{components, endings, mending, waiting},
    places::{settling, tails},
    queue::revisions,
    uploads::inbox,
};
use crate::StoreError;

/// Components in one transaction.
const BATCH: u32 = 50;

impl Engine {
    pub(crate) async fn forget_derived(
        &self,
        after: Option<&Component>,
        since: Timestamp,
    ) -> Result<Option<Component>, StoreError> {
        let operators = operators::all(&mut *self.read_all().await?).await?;
        for operator in operators.into_iter().filter(|operator| after.is_none_or(|after| after.operator <= *operator)) {
            let after = after.filter(|after| after.operator == operator).cloned();
            if after.is_none() {
                self.write(Reinstall { operator: operator.clone() }).await?;
            }
            let last = self.write(Forget { operator, after, since }).await?;
            if last.is_some() {
                return Ok(last);
            }
        }
        Ok(None)
    }
}

/// Makes the installations of an operator anew, and the list of its tails.
struct Reinstall {
    operator: OperatorId,
}

impl Write for Reinstall {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        settling::remake(connection, &self.operator).await?;
        let told = tails::defined(connection, &self.operator).await?;
        tails::mend(connection, &self.operator, told).await?;
        following::remake(connection, &self.operator).await
    }
}

/// Throws away the results of the next components of an operator; the last of them, if there was any.
struct Forget {
    operator: OperatorId,
    after: Option<Component>,
    since: Timestamp,
}

impl Write for Forget {
    type Output = Option<Component>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<Component>, StoreError> {
        let components = components::next_components(connection, &self.operator, self.after.as_ref(), BATCH).await?;
        for component in &components {
            let ends = endings::ends_of(connection, component).await?;
            mending::mend(connection, component, &ends).await?;
            revisions::mend(connection, component, now).await?;
            waiting::revise(connection, component, now).await?;
            revisions::mend(connection, component, now).await?;
            forget(connection, component).await?;
            send_back(connection, component, self.since).await?;
            endings::find_ends(connection, component).await?;
            following::follow(connection, component, Flown::Otherwise).await?;
        }
        Ok(components.into_iter().last())
    }
}

/// A statement that removes the rows of a component but those of generations that answered before.
macro_rules! forget {
    ($table:literal) => {
        concat!(
            "delete from ",
            $table,
            " where operator = $1 and part_number = $2 and serial_number = $3
                and not exists (
                  select 1 from lives l
                  where l.operator = $1 and l.part_number = $2 and l.serial_number = $3
                    and l.overhaul_index = ",
            $table,
            ".overhaul_index and l.generation > ",
            $table,
            ".generation)"
        )
    };
}

/// Removes the results of a component.
async fn forget(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    for sql in [
        forget!("estimates"),
        forget!("states"),
        forget!("exclusions"),
        forget!("checkpoints"),
        "delete from set_aside where operator = $1 and part_number = $2 and serial_number = $3",
        "delete from inbox where operator = $1 and part_number = $2 and serial_number = $3",
    ] {
        sqlx::query(sql).bind_component(component).execute(&mut *connection).await?;
    }
    Ok(())
}

/// Lets all uploads of a component that are not voided wait.
async fn send_back(connection: &mut Connection, component: &Component, since: Timestamp) -> Result<(), StoreError> {
    let moments = sqlx::query_as(
        "select u.recorded_at, u.upload_id from uploads u
         where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)",
    );
    let moments = moments.bind_component(component).fetch_all(&mut *connection).await?;
    inbox::let_wait(connection, component, moments, since).await
}
