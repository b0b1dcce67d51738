//! The same inputs, in order, into a fresh service with one worker: nothing may differ.

use std::{cmp::Ordering, collections::BTreeSet};

use serde_json::Value;

use super::{
    hands::{Hands, Stepped},
    input::{Input, get},
    ledger::{Effect, Ledger},
    operators::Keyring,
    question::Question,
};
use crate::in_process::{clock::Clock, database::Database, service::Service};

/// Compares digests and all answers with those of a fresh service.
pub async fn compare(service: &Service, ledger: &Ledger, keys: &Keyring, clock: &Clock) {
    let database = Database::sqlite();
    let fresh = replay(&database.url(), ledger, keys, clock).await;
    // Generations that are superseded before a worker comes by are never made, and then those after them count less.
    let is_remade = |effect: &Effect| matches!(effect, Effect::Activation { all_lives: true, .. });
    let remade = ledger.effects.iter().any(is_remade);
    let volatile: &[&str] = if remade { &["enrolled_at", "generation", "generations"] } else { &["enrolled_at"] };
    for (operator, book) in ledger.books.iter().enumerate() {
        for question in Question::all(book) {
            let path = question.path();
            let [served, expected] =
                [service, &fresh].map(|service| service.answer(keys.admin(operator).signed(get(&path))));
            let (served, expected) = (plain(&served.await.body, volatile), plain(&expected.await.body, volatile));
            // A scoreboard judges what was issued, and that depends on when workers came by.
            if !path.ends_with("/scoreboard") {
                let difference = difference(&served, &expected, "");
                assert!(difference.is_none(), "{operator}: {path}: {}", difference.unwrap_or_default());
            }
        }
    }
    if remade {
        return fresh.stop().await;
    }
    let digests = [service.store().digest().await, fresh.store().digest().await];
    let [served, expected] = digests.map(|digest| digest.expect("a digest"));
    assert_eq!(served, expected);
    fresh.stop().await;
}

/// A fresh service that got the inputs in order, each at the time at which it was first received.
async fn replay(url: &str, ledger: &Ledger, keys: &Keyring, clock: &Clock) -> Service {
    let end = clock.now();
    let service = Service::open(url, clock).await;
    service.provide(clock).await;
    keys.hand_over(&service, clock.now()).await;
    let mut epochs: Vec<Vec<&Effect>> = vec![Vec::new()];
    for effect in &ledger.effects {
        if let Effect::Activation { .. } = effect {
            epochs.push(Vec::new());
        }
        epochs.last_mut().expect("one at least").push(effect);
    }
    for mut epoch in epochs {
        epoch.sort_by(|a, b| in_order(a, b));
        for effect in epoch {
            apply(&service, effect, keys, clock).await;
        }
    }
    clock.set(end);
    let mut hands = Hands::new(&service, clock);
    while !matches!(hands.step(&service).await, Stepped::Idle) {}
    service
}

async fn apply(service: &Service, effect: &Effect, keys: &Keyring, clock: &Clock) {
    match effect {
        Effect::Activation { bundle, all_lives } => service.activate(*bundle, *all_lives, clock).await,
        Effect::Input { operator, input, at } => {
            clock.set(*at);
            let answer = service.answer(keys.admin(*operator).signed(input.request())).await;
            let words = String::from_utf8_lossy(&answer.body);
            assert!(answer.status.is_success(), "{}: {words}: {input:?}", answer.status);
        }
    }
}

/// The order of an epoch: its activation, configurations, what happened in the order of lives, what was taken back.
fn in_order(one: &Effect, other: &Effect) -> Ordering {
    let key = |effect: &Effect| match effect {
        Effect::Activation { .. } => (0, 0.0, String::new()),
        Effect::Input { input, .. } => match input {
            Input::Configuration { from, .. } => (1, 0.0, from.to_string()),
            Input::Upload(upload) => (2, upload.flight_hours, upload.recorded_at.to_string()),
            Input::Event { body, .. } => (2, body.flight_hours, body.occurred_at.clone()),
            Input::VoidUpload(_) | Input::VoidEvent { .. } | Input::Retry(_) => (3, 0.0, String::new()),
        },
    };
    let (one, other) = (key(one), key(other));
    one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)).then(one.2.cmp(&other.2))
}

/// An answer without what depends on when something came, or when workers came by.
fn plain(body: &[u8], volatile: &[&str]) -> Value {
    match serde_json::from_slice(body) {
        Ok(value) => without(value, volatile),
        Err(_) => Value::String(without_receipt(&String::from_utf8_lossy(body))),
    }
}

fn without(value: Value, volatile: &[&str]) -> Value {
    match value {
        Value::Object(fields) => {
            let kept = fields.into_iter().filter(|(name, _)| !volatile.contains(&name.as_str()));
            Value::Object(kept.map(|(name, value)| (name, without(value, volatile))).collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(|item| without(item, volatile)).collect()),
        Value::String(text) => Value::String(without_receipt(&text)),
        other => other,
    }
}

/// A text whose reasons do without the receipts by which they were found: a retry is judged by its own time, and the
/// fresh service has nothing to try again.
fn without_receipt(text: &str) -> String {
    let mut parts = text.split(" hours after it was received at ");
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        kept.truncate(kept.rfind(' ').unwrap_or_default());
        kept.push_str(part.split_once(';').map_or(part, |(_, after)| after));
    }
    kept
}

/// Where two answers differ first.
fn difference(served: &Value, expected: &Value, at: &str) -> Option<String> {
    match (served, expected) {
        (Value::Object(one), Value::Object(other)) => {
            let names: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
            let null = Value::Null;
            let of = |fields: &serde_json::Map<String, Value>, name: &String| {
                fields.get(name).cloned().unwrap_or(null.clone())
            };
            names.into_iter().find_map(|name| difference(&of(one, name), &of(other, name), &format!("{at}/{name}")))
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            let pairs = one.iter().zip(other).enumerate();
            pairs.into_iter().find_map(|(i, (one, other))| difference(one, other, &format!("{at}/{i}")))
        }
        _ => (served != expected).then(|| format!("{at}: {served} instead of {expected}")),
    }
}
