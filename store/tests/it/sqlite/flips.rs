//! Single bits flipped in a database file, spread over its tables and indexes: each is told by `verify`, or harms nothing.
//!
//! `ACTUARY_FLIPS` says how many (20 unless it is set); the table of what became of them is printed.

use std::{collections::BTreeMap, fmt::Write, fs, path::Path};

use crate::fixture::{Backend, Database, component, everything::everything, operator, tail};
use domain::UploadStateKind;
use numerics::Stream;
use sqlx::{Connection, SqliteConnection};
use store::{HistoryOf, Store, StoreError};

/// Components and tails of the database.
const SERIALS: [&str; 4] = ["0001", "0002", "0003", "0004"];
const TAILS: [&str; 2] = ["EC-MXA", "EC-MXB"];
const UPLOADS: [UploadStateKind; 4] =
    [UploadStateKind::Pending, UploadStateKind::Processed, UploadStateKind::SetAside, UploadStateKind::Voided];

/// All that is answered of the database, as text.
async fn answers(store: &Store) -> Result<String, StoreError> {
    let (operator, mut text) = (operator(), String::new());
    let mut say = |answer: &dyn std::fmt::Debug| writeln!(text, "{answer:?}").expect("a text takes all");
    say(&store.tails(&operator, None, 100).await?);
    say(&store.installed_fleet(&operator, None, 100).await?);
    say(&store.issued_on_finished_lives(&operator, 200.0, 10).await?);
    say(&store.priors(&operator).await?);
    say(&store.bundles().await?);
    say(&store.model_use().await?);
    say(&store.work_figures().await?);
    say(&store.tokens(&operator).await?);
    say(&store.frame_keys(&operator).await?);
    say(&store.settings(&operator).await?);
    say(&store.fleet_checks(&operator, None, 100).await?);
    say(&store.audit(Some(&operator), 0, 100).await?);
    say(&store.digest().await?);
    for name in TAILS {
        say(&store.installed(&operator, &tail(name)).await?);
        say(&store.sensor_configurations(&operator, &tail(name)).await?);
        say(&store.plans(&operator, &tail(name)).await?);
        say(&store.checks(&operator, &tail(name)).await?);
    }
    for state in UPLOADS {
        say(&store.uploads(&operator, state, None, 100).await?);
    }
    for component in SERIALS.map(component) {
        say(&store.component(&component).await?);
        say(&store.events(&component).await?);
        for life in [0, 1] {
            let of = HistoryOf { life: Some(life), generation: None };
            say(&store.estimates(&component, of, None, None, None, 100).await?);
            say(&store.states(&component, of, None, None, None, 100).await?);
        }
    }
    Ok(text)
}

/// What became of a flip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fate {
    ToldAndRefused,
    ToldAndAnswered,
    ToldAndWrong,
    Harmless,
    WrongUntold,
    RefusedUntold,
}

/// What `verify` tells of a file, and what it answers.
async fn fate(url: &str, sound: &str) -> Fate {
    let Ok(store) = Store::open_read_only(url).await else { return Fate::ToldAndRefused };
    let broken = match store.verify_audit().await {
        Ok(chains) => chains.iter().any(|chain| chain.damage.is_some()),
        Err(_) => true,
    };
    let told = broken || !store.verify().await.is_ok_and(|found| found.damaged.is_empty());
    let answered = answers(&store).await;
    store.close().await;
    match (told, answered) {
        (true, Err(_)) => Fate::ToldAndRefused,
        (true, Ok(same)) if same == sound => Fate::ToldAndAnswered,
        (true, Ok(_)) => Fate::ToldAndWrong,
        (false, Ok(same)) if same == sound => Fate::Harmless,
        (false, Ok(_)) => Fate::WrongUntold,
        (false, Err(_)) => Fate::RefusedUntold,
    }
}

/// The pages of each table and index, and the size of a page.
async fn pages(path: &Path) -> (Vec<(String, Vec<u64>)>, u64) {
    let mut connection = SqliteConnection::connect(&format!("sqlite:{}", path.display())).await.unwrap();
    let rows: Vec<(String, i64)> = sqlx::query_as("select name, pageno from dbstat order by name, pageno")
        .fetch_all(&mut connection)
        .await
        .unwrap();
    let size: i64 = sqlx::query_scalar("pragma page_size").fetch_one(&mut connection).await.unwrap();
    connection.close().await.unwrap();
    let mut pages: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for (name, page) in rows {
        pages.entry(name).or_default().push(page.cast_unsigned());
    }
    (pages.into_iter().collect(), size.cast_unsigned())
}

#[tokio::test]
async fn a_flipped_bit_is_told_or_harms_nothing() {
    let flips: usize = std::env::var("ACTUARY_FLIPS").map_or(20, |flips| flips.parse().unwrap());
    let database = Database::new(Backend::Sqlite);
    let store = everything(&database).await;
    let sound = answers(&store).await.unwrap();
    store.close().await;
    let (pages, page_size) = pages(&database.path()).await;
    let (whole, copy) = (fs::read(database.path()).unwrap(), database.path().with_extension("flipped"));
    let url = format!("sqlite:{}", copy.display());
    let mut stream = Stream::new(34, &["flips"]);
    let mut draw = |below: usize| stream.below(below);
    let mut fates: BTreeMap<Fate, Vec<String>> = BTreeMap::new();
    for _ in 0..flips {
        let (name, of_table) = &pages[draw(pages.len())];
        let begin = ((of_table[draw(of_table.len())] - 1) * page_size) as usize;
        // Most of a page of a small table is nothing but zeros.
        let mut byte = begin + draw(page_size as usize);
        while whole[byte] == 0 && draw(20) > 0 {
            byte = begin + draw(page_size as usize);
        }
        let bit = draw(8);
        let mut flipped = whole.clone();
        flipped[byte] ^= 1 << bit;
        fs::write(&copy, flipped).unwrap();
        fates.entry(fate(&url, &sound).await).or_default().push(format!("bit {bit} of byte {byte} in {name}"));
        for beside in ["flipped-wal", "flipped-shm"] {
            let _ = fs::remove_file(database.path().with_extension(beside));
        }
    }
    for (fate, those) in &fates {
        println!("{fate:?}: {}", those.len());
    }
    let bad = [Fate::WrongUntold, Fate::RefusedUntold].map(|fate| fates.get(&fate));
    assert_eq!(bad, [None, None]);
}
