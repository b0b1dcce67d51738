//! Settings of operators: how each reads its forecasts.

use domain::{Act, Action, OperatorId, Settings, Timestamp};
use serde_json::Value;

use super::super::{
    Connection, Engine,
    ground::{
        check,
        versions::{Columns, VersionRow, Versioned},
        write::{Reach, Write},
    },
};
use super::audit::Trace;
use crate::{OperatorSettings, StoreError, Verification};

const SETTINGS: &str = "operator_settings";

impl Engine {
    /// The newest version of an operator's settings.
    pub(crate) async fn settings(&self, operator: &OperatorId) -> Result<Option<OperatorSettings>, StoreError> {
        let newest = newest(&mut *self.read(operator).await?, operator).await?;
        Ok(newest.map(OperatorSettings::from))
    }

    pub(crate) async fn set_settings(
        &self,
        operator: &OperatorId,
        settings: &Settings,
        act: Act,
    ) -> Result<OperatorSettings, StoreError> {
        let trace = Trace { act, action: Action::SettingsSet, subject: operator.to_string(), detail: Value::Null };
        let set = Set { operator: operator.clone(), settings: settings.clone(), act };
        self.act(set, trace, |(_, is_new)| *is_new).await.map(|(version, _)| version)
    }
}

async fn newest(connection: &mut Connection, operator: &OperatorId) -> Result<Option<Versioned<Settings>>, StoreError> {
    let row: Option<VersionRow> = sqlx::query_as(
        "select operator, version, set_at, set_by, body, checksum from operator_settings
         where operator = $1 order by version desc limit 1",
    )
    .bind(operator.as_str())
    .fetch_optional(connection)
    .await?;
    row.map(|row| row.read(SETTINGS)).transpose()
}

struct Set {
    operator: OperatorId,
    settings: Settings,
    act: Act,
}

impl Write for Set {
    /// The version in force, and whether it is new.
    type Output = (OperatorSettings, bool);

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(OperatorSettings, bool), StoreError> {
        let newest = newest(connection, &self.operator).await?;
        let (version, is_new) = Versioned::set(newest, &self.settings, self.act);
        if is_new {
            let columns = Columns::new(SETTINGS, &self.operator, None, &version)?;
            sqlx::query(
                "insert into operator_settings (operator, version, set_at, set_by, body, checksum)
                 values ($1, $2, $3, $4, $5, $6)",
            )
            .bind(self.operator.as_str())
            .bind(columns.version)
            .bind(columns.set_at)
            .bind(&columns.set_by)
            .bind(&columns.body)
            .bind(&columns.checksum)
            .execute(connection)
            .await?;
        }
        Ok((version.into(), is_new))
    }
}

impl From<Versioned<Settings>> for OperatorSettings {
    fn from(Versioned { version, set_at, set_by, noun: settings }: Versioned<Settings>) -> Self {
        Self { version, set_at, set_by, settings }
    }
}

/// Checks every version of all settings.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, version, set_at, set_by, body, checksum from operator_settings
               order by operator, version";
    check::each(connection, SETTINGS, sql, found, |row: VersionRow| row.read::<Settings>(SETTINGS).map(|_| ())).await
}
