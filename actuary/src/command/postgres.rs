//! Backups of a Postgres, by its own tools.

use std::{io, path::Path};

use anyhow::{Result, anyhow};
use tokio::process::Command;

use super::verify::whole;
use crate::{
    database::Database,
    exit::Failure,
    files::database_copy::{COPY, beside, put},
    interrupt::interrupted,
    say::say,
    service::on_runtime,
};

/// Writes a backup by pg_dump.
pub fn dump(database: &Database, out: &Path) -> Result<()> {
    let folder = beside(out)?;
    let copy = folder.path().join(COPY);
    let (url, password) = database.login()?;
    let arguments = |file: &Path| -> Vec<String> {
        ["--format=custom", "--no-owner", "--dbname", &url, "--file"]
            .map(str::to_owned)
            .into_iter()
            .chain([file.display().to_string()])
            .collect()
    };
    on_runtime(run("pg_dump", &arguments(&copy), &arguments(out), password))?;
    put(folder, out)?;
    say!("{}: a copy of {database}; actuary restore checks it", out.display());
    Ok(())
}

/// Restores a backup by pg_restore into a database without tables, in one transaction, and checks it.
pub fn restore(database: &Database, from: &Path) -> Result<()> {
    on_runtime(async {
        if database.has_schema().await? {
            return Err(Failure::BadInput(format!("{database}: holds tables; a restore overwrites nothing")).into());
        }
        let (url, password) = database.login()?;
        let arguments = ["--exit-on-error", "--single-transaction", "--no-owner", "--dbname", &url];
        let mut arguments: Vec<String> = arguments.map(str::to_owned).into();
        arguments.push(from.display().to_string());
        run("pg_restore", &arguments, &arguments, password).await?;
        match database.open_read_only().await {
            Ok(store) => {
                let checked = whole(&store).await;
                store.close().await;
                say!("{database}: {}", checked?);
            }
            // Tables are restored by their owner, as whom nothing is read.
            Err(why) => say!("{database}: restored; check it by actuary verify --digest as the service ({why})"),
        }
        Ok(())
    })
}

/// Runs one of Postgres's programs, which goes with this process when a signal ends it; where there is none, the error is the line
/// to run elsewhere, `shown`.
async fn run(program: &str, arguments: &[String], shown: &[String], password: Option<String>) -> Result<()> {
    let mut command = Command::new(program);
    // Not in the arguments, which every user of the machine can read.
    command.args(arguments).envs(password.map(|password| ("PGPASSWORD", password))).kill_on_drop(true);
    let output = tokio::select! {
        output = command.output() => output,
        () = interrupted() => return Err(Failure::Interrupted(format!("{program} was ended")).into()),
    };
    let output = output.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Failure::NotReachable(format!(
            "{program} is not installed here; where it is, run: {program} {}",
            shown.iter().map(|argument| quoted(argument)).collect::<Vec<_>>().join(" ")
        )),
        _ => Failure::NotReachable(format!("{program}: {error}")),
    })?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(anyhow!("{program}: {}", said.lines().next().unwrap_or("failed without a word")))
}

/// An argument as a shell takes it.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=@".contains(c);
    if argument.chars().all(plain) { argument.to_owned() } else { format!("'{}'", argument.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_to_run_can_be_pasted() {
        assert_eq!(quoted("--dbname"), "--dbname");
        assert_eq!(quoted("postgres://owner@db/fleet?sslmode=require"), "'postgres://owner@db/fleet?sslmode=require'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }

    #[tokio::test]
    async fn a_program_that_is_missing_is_named_with_its_arguments() {
        let arguments = ["--file".to_owned(), "my copy".to_owned()];
        let error = run("no_such_program", &arguments, &arguments, None).await.unwrap_err();
        assert!(matches!(error.downcast_ref(), Some(Failure::NotReachable(_))), "{error}");
        assert!(error.to_string().ends_with("run: no_such_program --file 'my copy'"), "{error}");
    }
}
