//! What is written, and by how much.

use domain::{EventKind, Finding, MaintenanceEvent};
use metrics_exporter_prometheus::PrometheusBuilder;
use store::{Completion, EventReceipt, Receipt, StoreError, Voiding};
use tokio::task::JoinSet;

use super::{execute, killed};
use crate::fixture::{
    Backend, Database, by_hand, component, day, finding, later_upload, lease, operator, prior, serve, upload,
};

/// Counts the rows that are written of where components are.
const COUNT_WRITES: &str = "
    create table writes (row integer primary key);
    create trigger a1 after insert on installations begin insert into writes values (null); end;
    create trigger a2 after delete on installations begin insert into writes values (null); end;
    create trigger a3 after update on installations begin insert into writes values (null); end;
    create trigger a4 after insert on observed_installations begin insert into writes values (null); end;
    create trigger a5 after delete on observed_installations begin insert into writes values (null); end;
    create trigger a6 after update on observed_installations begin insert into writes values (null); end;";

#[tokio::test]
async fn the_last_of_many_turns_at_a_place_writes_as_many_rows_as_the_first() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    execute(&database.path(), COUNT_WRITES).await;
    let seen = |turn: usize| later_upload(&format!("u{turn}"), ["0001", "0002"][turn % 2], turn as f64);
    let moved = |turn: usize| MaintenanceEvent {
        kind: [EventKind::Install, EventKind::Remove][turn % 2],
        occurred_at: day(100.0 + turn as f64),
        ..finding(&format!("e{turn}"), "0003", Finding::Serviceable, 0.0)
    };
    let mut written = Vec::new();
    for turn in 0..300 {
        if turn % 20 == 0 {
            written.push(execute(&database.path(), "delete from writes").await);
        }
        store.accept(&operator(), seen(turn), day(0.0)).await.unwrap();
        store.record_event(&operator(), &moved(turn), day(0.0)).await.unwrap();
    }
    assert!(written[2] > 20, "{written:?}");
    assert!(written[2..].iter().all(|rows| *rows == written[2]), "{written:?}");
    store.accept(&operator(), later_upload("late", "0002", 2.0), day(0.0)).await.unwrap();
    assert!(execute(&database.path(), "delete from writes").await <= written[2] + 8);
}

#[tokio::test]
async fn what_is_acknowledged_is_in_the_files() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    for i in 0..10 {
        store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
    }
    let events = ["kept", "voided"].map(|id| finding(id, "0001", Finding::Failed, 200.0));
    for event in &events {
        store.record_event(&operator(), event, day(0.0)).await.unwrap();
    }
    store.void_event(&operator(), &events[1].event_id, by_hand(0.0)).await.unwrap();
    store.add_prior(&operator(), &prior("learned", 10, 0.0), b"learned").await.unwrap();
    let left_behind = killed(&database);
    let store = left_behind.open().await;
    assert_eq!(store.pending().await.unwrap(), 10);
    for event in &events {
        assert_eq!(store.record_event(&operator(), event, day(1.0)).await.unwrap(), EventReceipt::Duplicate);
    }
    let voided = store.void_event(&operator(), &events[1].event_id, by_hand(1.0)).await.unwrap();
    assert_eq!(voided, Some(Voiding::AlreadyVoided));
    assert_eq!(store.component(&component("0001")).await.unwrap().unwrap().lives[0].found_failed_fh, Some(200.0));
    assert_eq!(store.priors(&operator()).await.unwrap(), [prior("learned", 10, 0.0)]);
    for i in 0..10 {
        let again = store.accept(&operator(), upload(&format!("u{i}"), "0001"), day(0.0)).await.unwrap();
        assert_eq!(again, Receipt::Duplicate);
    }
}

#[tokio::test]
async fn one_bad_upload_of_a_batch_fails_alone() {
    let database = Database::new(Backend::Sqlite);
    database.ready().await.close().await;
    let trigger = "create trigger bad before insert on uploads when new.upload_id like 'bad%'
                   begin select raise(abort, 'refused by the test'); end";
    execute(&database.path(), trigger).await;
    let store = database.open().await;
    let mut callers = JoinSet::new();
    for i in 0..40 {
        let store = store.clone();
        let id = if i % 17 == 5 { format!("bad{i}") } else { format!("u{i}") };
        callers.spawn(async move { (i, store.accept(&operator(), upload(&id, "0001"), day(0.0)).await) });
    }
    for (i, answer) in callers.join_all().await {
        match answer {
            Ok(receipt) => assert!(i % 17 != 5 && receipt == Receipt::Accepted, "{i}: {receipt:?}"),
            Err(error) => assert!(i % 17 == 5 && matches!(error, StoreError::Database(_)), "{i}: {error}"),
        }
    }
    assert_eq!(store.pending().await.unwrap(), 37);
}

#[tokio::test]
async fn a_transaction_that_the_database_ended_by_itself_is_the_last_of_its_connection_only() {
    let database = Database::new(Backend::Sqlite);
    database.ready().await.close().await;
    // As a full disk does, it leaves nothing to be rolled back; the other fails in the commit itself.
    for sql in [
        "create trigger gone before insert on uploads when new.upload_id like 'gone%'
         begin select raise(rollback, 'ended by the test'); end",
        "create table elsewhere (id text primary key)",
        "create table bound (id text references elsewhere deferrable initially deferred)",
        "create trigger late after insert on uploads when new.upload_id like 'late%'
         begin insert into bound values (new.upload_id); end",
    ] {
        execute(&database.path(), sql).await;
    }
    let store = database.open().await;
    for bad in ["gone", "late"] {
        let mut callers = JoinSet::new();
        for i in 0..20 {
            let (store, failing) = (store.clone(), i % 7 == 3);
            let id = if failing { format!("{bad}{i}") } else { format!("{i}-beside-{bad}") };
            callers.spawn(
                async move { (failing, store.accept(&operator(), upload(&id, "0001"), day(0.0)).await.is_err()) },
            );
        }
        for (failing, failed) in callers.join_all().await {
            assert_eq!(failing, failed, "{bad}");
        }
        store.ping().await.unwrap();
        let after = store.accept(&operator(), upload(&format!("after-{bad}"), "0001"), day(0.0)).await;
        assert_eq!(after.unwrap(), Receipt::Accepted);
    }
    assert_eq!(store.pending().await.unwrap(), 2 * 17 + 2);
}

#[tokio::test]
async fn every_commit_is_measured() {
    let recorder = PrometheusBuilder::new().build_recorder();
    let figures = recorder.handle();
    let _recording = metrics::set_default_local_recorder(&recorder);
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    let commits = || {
        let text = figures.render();
        let line = text.lines().find(|line| line.starts_with("actuary_commit_seconds_count")).unwrap();
        line.rsplit(' ').next().unwrap().parse::<u64>().unwrap()
    };
    let before = commits();
    for id in ["u1", "u2", "u3"] {
        store.accept(&operator(), upload(id, "0001"), day(0.0)).await.unwrap();
    }
    assert_eq!(commits(), before + 3);
}

#[tokio::test]
async fn a_reopened_database_leases_at_once_what_was_leased_before() {
    let database = Database::new(Backend::Sqlite);
    let store = database.ready().await;
    store.accept(&operator(), upload("u1", "0001"), day(0.0)).await.unwrap();
    let before = lease(&store).await;
    store.close().await;
    let store = database.open().await;
    assert_eq!(serve(&store, &before).await, Completion::Fenced);
    let after = lease(&store).await;
    assert_eq!((after.fence, after.attempts), (before.fence + 1, 1));
}
