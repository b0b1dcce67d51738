//! Every row that carries a checksum, read and compared with it.
//!
//! Tables are read one after the other in one transaction, a row at a time. What a damaged row says is
//! told and never used.

use domain::{Checks, Plan};

use super::super::{
    Connection, Engine,
    access::{settings, tokens},
    events::recorded,
    ground::versions,
    models::{bundles, priors},
    places::sensor_configurations,
    results::{checkpoints, estimates, prognoses, states},
    uploads::received,
};
use super::{derivation, relations, sealing};
use crate::{StoreError, Verification};

impl Engine {
    pub(crate) async fn verify(&self) -> Result<Verification, StoreError> {
        self.verify_tables(true).await
    }

    /// Verifies the tables from which all others can be made anew.
    pub(crate) async fn verify_sources(&self) -> Result<Verification, StoreError> {
        self.verify_tables(false).await
    }

    async fn verify_tables(&self, results: bool) -> Result<Verification, StoreError> {
        let mut found = Verification::default();
        self.verify_structure(&mut found).await?;
        let (now, mut transaction) = (self.now().await?, self.read_all().await?);
        bundles::verify(&mut transaction, &mut found).await?;
        relations::verify_operators(&mut transaction, &mut found).await?;
        for wall in self.walls(&mut transaction).await? {
            self.enter(&mut transaction, &wall).await?;
            sources(&mut transaction, &mut found).await?;
            if results {
                sealing::verify_derived(&mut transaction, &mut found).await?;
                estimates::verify(&mut transaction, &mut found).await?;
                states::verify(&mut transaction, &mut found).await?;
                checkpoints::verify_all(&mut transaction, &mut found).await?;
                prognoses::verify(&mut transaction, &mut found).await?;
                relations::verify(&mut transaction, now, &mut found).await?;
                for operator in derivation::operators(&mut transaction).await? {
                    derivation::verify(&mut transaction, &operator, &mut found).await?;
                }
            }
        }
        if results {
            let mut installation = self.read_installation().await?;
            derivation::verify_installation(&mut installation, &mut found).await?;
        }
        let Verification { tables, damaged, .. } = &mut found;
        damaged.sort_by_key(|row| tables.iter().position(|(table, _)| *table == row.table));
        Ok(found)
    }
}

/// The tables of operators from which all others can be made anew.
async fn sources(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    priors::verify_all(connection, found).await?;
    received::verify(connection, found).await?;
    recorded::verify(connection, found).await?;
    sealing::verify_sources(connection, found).await?;
    sensor_configurations::verify_all(connection, found).await?;
    versions::verify_all::<Plan>(connection, found).await?;
    versions::verify_all::<Checks>(connection, found).await?;
    settings::verify_all(connection, found).await?;
    tokens::verify_all(connection, found).await
}
