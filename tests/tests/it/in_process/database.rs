//! Where a service keeps its data.

use store::Store;
use tempfile::TempDir;
use tests::postgres::TestDatabase;

/// A database, removed when dropped.
pub enum Database {
    /// A file in a folder of its own.
    Sqlite(TempDir),
    /// A database in the cluster that the tests share.
    Postgres(TestDatabase),
}

impl Database {
    /// An empty file.
    pub fn sqlite() -> Self {
        Self::Sqlite(tempfile::tempdir().expect("a folder"))
    }

    /// An empty database in a cluster; `None` where there is no Postgres.
    pub async fn postgres() -> Option<Self> {
        let migrate = async |url: &str, role: &str| Store::migrate(url, Some(role)).await.expect("a schema");
        TestDatabase::create(migrate).await.map(Self::Postgres)
    }

    /// As the service calls it.
    pub fn url(&self) -> String {
        match self {
            Self::Sqlite(folder) => format!("sqlite:{}", folder.path().join("actuary.sqlite").display()),
            Self::Postgres(database) => database.service_url(),
        }
    }

    /// Whether one process owns it, so that leases end with the process.
    pub fn has_one_owner(&self) -> bool {
        matches!(self, Self::Sqlite(_))
    }
}
