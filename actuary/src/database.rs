//! Where the data is, as the command line names it. Its password is in no message.

use std::{fmt, fs, io::ErrorKind, path::PathBuf, time::Duration};

use anyhow::Result;
use clap::Args;
use percent_encoding::percent_decode_str;
use reqwest::Url;
use store::{Options, Store, StoreError};

use crate::exit::Failure;

/// How often a migration is tried again.
const MIGRATIONS: u32 = 5;
const PAUSE: Duration = Duration::from_millis(500);

/// The database of a command.
#[derive(Clone, Args)]
pub struct Database {
    /// The database: sqlite:FILE, or postgres://USER@HOST/NAME.
    #[arg(
        long,
        env = "ACTUARY_DATABASE_URL",
        hide_env_values = true,
        value_name = "URL",
        default_value = "sqlite:actuary.sqlite"
    )]
    database_url: String,
    /// File that holds the password of the database's user, so that the URL need not.
    #[arg(long, env = "ACTUARY_DATABASE_PASSWORD_FILE", value_name = "FILE")]
    database_password_file: Option<PathBuf>,
}

impl Database {
    /// An SQLite file.
    pub fn file(path: &std::path::Path) -> Self {
        Self { database_url: format!("sqlite:{}", path.display()), database_password_file: None }
    }

    /// Whether it is a Postgres, which many processes share.
    pub fn is_postgres(&self) -> bool {
        ["postgres:", "postgresql:"].iter().any(|scheme| self.database_url.starts_with(scheme))
    }

    /// Opens it for a service.
    pub async fn open(&self) -> Result<Store> {
        Ok(Store::open(&self.url()?, Options::default()).await.map_err(|error| self.refuse(error))?)
    }

    /// Brings it to the schema of this build, and lets a role of a Postgres serve it.
    pub async fn migrate(&self, service_role: Option<&str>) -> Result<()> {
        let url = self.url()?;
        let mut migrated = Store::migrate(&url, service_role).await;
        // Of two that migrate at the same time one fails and has changed nothing: it looks again.
        for _ in 0..MIGRATIONS {
            let Err(StoreError::Migration(_)) = &migrated else { break };
            tokio::time::sleep(PAUSE).await;
            migrated = Store::migrate(&url, service_role).await;
        }
        Ok(migrated.map_err(|error| self.refuse(error))?)
    }

    /// Whether a Postgres holds tables of this service already.
    pub async fn has_schema(&self) -> Result<bool> {
        Ok(Store::has_schema(&self.url()?).await.map_err(|error| self.refuse(error))?)
    }

    /// Opens it for reading only.
    pub async fn open_read_only(&self) -> Result<Store> {
        Ok(Store::open_read_only(&self.url()?).await.map_err(|error| self.refuse(error))?)
    }

    /// Opens it for administrative acts, also while a service has it open.
    pub async fn open_beside(&self) -> Result<Store> {
        Ok(Store::open_beside(&self.url()?).await.map_err(|error| self.refuse(error))?)
    }

    /// Opens it for administrative acts, too; before, an SQLite file is created or migrated where it must be.
    pub async fn prepared(&self) -> Result<Store> {
        let is_to_be_prepared = match Store::open_beside(&self.url()?).await {
            Ok(store) => return Ok(store),
            Err(StoreError::Io { error, .. }) => error.kind() == ErrorKind::NotFound,
            Err(error) => matches!(error, StoreError::OlderSchema { .. }),
        };
        if is_to_be_prepared && !self.is_postgres() {
            self.migrate(None).await?;
        }
        self.open_beside().await
    }

    /// Where it is, if it is an SQLite file.
    pub fn sqlite_file(&self) -> Result<Option<PathBuf>, Failure> {
        let url = self.url()?;
        let Some(path) = url.strip_prefix("sqlite:") else { return Ok(None) };
        let path = path.strip_prefix("//").unwrap_or(path);
        if path.contains('?') || path.starts_with("file:") {
            return Err(self.refuse(StoreError::UnsupportedUrl { url: self.to_string() }));
        }
        Ok(Some(path.into()))
    }

    /// How a program of Postgres logs in: a URL without the password, and the password.
    pub fn login(&self) -> Result<(String, Option<String>), Failure> {
        let url: Url = self.url()?.parse().map_err(|error| Failure::BadInput(format!("--database-url: {error}")))?;
        let in_query = url.query_pairs().find(|(key, _)| key == "password").map(|(_, password)| password.into_owned());
        let decoded = |text: &str| percent_decode_str(text).decode_utf8_lossy().into_owned();
        Ok((self.to_string(), in_query.or_else(|| url.password().map(decoded))))
    }

    /// The URL, with the password of the file.
    fn url(&self) -> Result<String, Failure> {
        let Some(file) = &self.database_password_file else { return Ok(self.database_url.clone()) };
        if !self.is_postgres() {
            return Err(Failure::BadInput(format!(
                "{self}: only a Postgres takes a password, from --database-password-file"
            )));
        }
        let unreadable = |error| Failure::BadInput(format!("{}: {error}", file.display()));
        let password = fs::read_to_string(file).map_err(unreadable)?;
        let mut url: Url =
            self.database_url.parse().map_err(|error| Failure::BadInput(format!("--database-url: {error}")))?;
        url.query_pairs_mut().append_pair("password", password.trim_end_matches(['\n', '\r']));
        Ok(url.into())
    }

    fn refuse(&self, error: StoreError) -> Failure {
        let text = match error {
            // It would repeat the URL as it was given.
            StoreError::UnsupportedUrl { .. } => {
                "is not supported: use sqlite:FILE, without parameters, or postgres://USER@HOST/NAME".to_owned()
            }
            StoreError::Unavailable(_) => return Failure::NotReachable(format!("{self}: {error}")),
            error => error.to_string(),
        };
        Failure::BadInput(format!("{self}: {text}"))
    }
}

impl fmt::Display for Database {
    /// The URL without a password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Ok(mut url) = self.database_url.parse::<Url>() else { return f.write_str("the database URL") };
        if url.scheme() == "sqlite" {
            // It takes no parameters, and who gives some takes it for a Postgres.
            return match self.database_url.split_once('?') {
                Some((file, _)) => write!(f, "{file}?..."),
                None => f.write_str(&self.database_url),
            };
        }
        // A URL that takes no password has none.
        let _ = url.set_password(None);
        let kept: Vec<(String, String)> =
            url.query_pairs().filter(|(key, _)| key != "password").map(|(k, v)| (k.into(), v.into())).collect();
        url.set_query(None);
        if !kept.is_empty() {
            url.query_pairs_mut().extend_pairs(kept);
        }
        f.write_str(url.as_str())
    }
}

impl fmt::Debug for Database {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Database({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(url: &str) -> Database {
        Database { database_url: url.to_owned(), database_password_file: None }
    }

    #[test]
    fn no_message_holds_the_password() {
        for url in [
            "postgres://actuary:sesame@db/fleet",
            "postgresql://actuary:sesame@db:5432/fleet?sslmode=require",
            "postgres:///fleet?host=/run/postgres&password=sesame&user=actuary",
            "postgress://actuary:sesame@db/fleet",
            "postgres://actuary:sesame@db:port/fleet",
            "sqlite:fleet.sqlite?password=sesame",
        ] {
            let database = at(url);
            let refused = database.refuse(StoreError::UnsupportedUrl { url: url.to_owned() }).to_string();
            for text in [database.to_string(), format!("{database:?}"), refused] {
                assert!(!text.contains("sesame"), "{text}");
            }
        }
        assert_eq!(at("sqlite:data/fleet.sqlite").to_string(), "sqlite:data/fleet.sqlite");
    }

    #[test]
    fn a_program_of_postgres_gets_the_password_apart_from_the_url() {
        for (url, shown) in [
            ("postgres://owner:se%26s%2Fa@db/fleet?sslmode=require", "postgres://owner@db/fleet?sslmode=require"),
            (
                "postgres:///fleet?host=/run/postgres&user=owner&password=se%26s/a",
                "postgres:///fleet?host=%2Frun%2Fpostgres&user=owner",
            ),
        ] {
            assert_eq!(at(url).login().unwrap(), (shown.to_owned(), Some("se&s/a".to_owned())));
        }
        assert_eq!(at("postgres://owner@db/fleet").login().unwrap().1, None);
    }

    #[test]
    fn the_password_comes_from_a_file_whatever_is_in_it() {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), "se&s/a me?#\n").unwrap();
        let of_file = |url: &str| Database { database_password_file: Some(file.path().to_owned()), ..at(url) };
        for url in ["postgres://actuary@db/fleet", "postgres:///fleet?host=/run/postgres&user=actuary"] {
            let with: Url = of_file(url).url().unwrap().parse().unwrap();
            let password = with.query_pairs().find(|(key, _)| key == "password").unwrap().1.into_owned();
            assert_eq!(password, "se&s/a me?#");
        }
        for url in ["nonsense", "sqlite:fleet.sqlite", "sqlite://fleet.sqlite"] {
            let refused = of_file(url).url().unwrap_err().to_string();
            assert!(refused.contains("only a Postgres takes a password") && !refused.contains("se&s"), "{refused}");
        }
    }
}
