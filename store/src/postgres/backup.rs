//! Backups and checks of files, for which Postgres has its own tools.

use std::path::Path;

use super::Engine;
use crate::{DamagedRow, StoreError, Verification};

/// The indexes of the schema that are trees, and hold rows.
const INDEXES: &str = "select cast(c.oid as regclass)::text from pg_class c
    join pg_index i on i.indexrelid = c.oid join pg_am a on a.oid = c.relam
    where c.relnamespace = cast('public' as regnamespace) and c.relkind = 'i' and a.amname = 'btree' and i.indisvalid
    order by c.relname";
const INDEX: &str = "select cast(bt_index_check(cast($1 as regclass), true) as text)";
/// The tables of the schema that hold rows.
const TABLES: &str = "select cast(c.oid as regclass)::text from pg_class c
    where c.relnamespace = cast('public' as regnamespace) and c.relkind = 'r' order by c.relname";
const PAGES: &str = "select 'block ' || blkno || ': ' || msg from verify_heapam(cast($1 as regclass))";

impl Engine {
    pub(crate) async fn copy_to(&self, _: &Path) -> Result<(), StoreError> {
        Err(StoreError::NotAFile)
    }

    pub(crate) async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        Err(StoreError::NotAFile)
    }

    /// Compares indexes with their tables, and looks at pages, where the extension amcheck is there and this role may
    /// use it.
    pub(super) async fn verify_structure(&self, found: &mut Verification) -> Result<(), StoreError> {
        let (indexes, pages): (bool, bool) = sqlx::query_as(
            "select coalesce(has_function_privilege(to_regprocedure('bt_index_check(regclass,boolean)'), 'execute'),
                             false),
                    coalesce(has_function_privilege(
                      to_regprocedure('verify_heapam(regclass,boolean,boolean,text,bigint,bigint)'), 'execute'),
                             false)",
        )
        .fetch_one(&self.pool)
        .await?;
        if indexes {
            self.each_relation("indexes", INDEXES, INDEX, found).await?;
        }
        if pages {
            self.each_relation("pages", TABLES, PAGES, found).await?;
        }
        if !(indexes && pages) {
            found.unchecked.push("indexes and pages: extension amcheck is not there for this role".to_owned());
        }
        Ok(())
    }

    /// Has each of some relations checked by a statement, which names what is wrong with it.
    async fn each_relation(
        &self,
        table: &'static str,
        all: &'static str,
        check: &'static str,
        found: &mut Verification,
    ) -> Result<(), StoreError> {
        let relations: Vec<String> = sqlx::query_scalar(all).fetch_all(&self.pool).await?;
        for relation in relations {
            let told = sqlx::query_scalar::<_, String>(check).bind(&relation).fetch_all(&self.pool).await;
            let details = match told.map_err(StoreError::from) {
                Err(StoreError::Corrupt { detail, .. }) => vec![detail],
                told => told?,
            };
            let row = |detail| DamagedRow { table, row: relation.clone(), detail };
            found.damaged.extend(details.into_iter().filter(|detail| !detail.is_empty()).map(row));
        }
        Ok(())
    }
}
