//! A write that changes nothing and yet has to reach the disk: whether anything can be stored.

use domain::{Component, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::write::{Reach, Write},
};
use crate::StoreError;

impl Engine {
    /// Tells whether something can be stored. While all goes well nothing is tried; after a failure, a row is written
    /// and removed again.
    pub(crate) async fn can_store(&self) -> Result<(), StoreError> {
        if self.outages().current().is_none() {
            return Ok(());
        }
        self.write(Probe(component())).await?;
        self.outages().current().map_or(Ok(()), Err)
    }
}

struct Probe(Component);

/// A component that nobody has: the row's operator is walled off from all others.
fn component() -> Component {
    let name = "probe";
    Component {
        operator: OperatorId::default(),
        part_number: name.parse().expect("a part number"),
        serial_number: name.parse().expect("a serial number"),
    }
}

impl Write for Probe {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Component(&self.0)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        let Component { operator, part_number, .. } = &self.0;
        sqlx::query(
            "insert into lesson_claims (operator, part_number, model, attempts, claimed_until)
             values ($1, $2, $3, 0, 0)",
        )
        .bind(operator.as_str())
        .bind(part_number.as_str())
        .bind(b"".as_slice())
        .execute(&mut *connection)
        .await?;
        sqlx::query("delete from lesson_claims where operator = $1 and part_number = $2 and model = $3")
            .bind(operator.as_str())
            .bind(part_number.as_str())
            .bind(b"".as_slice())
            .execute(connection)
            .await?;
        Ok(())
    }
}
