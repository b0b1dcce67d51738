//! Operators, and the tokens of those who speak for them.

use axum::{body::Body, http::Request};
use domain::{Actor, Scope, TailNumber, Timestamp, Token};
use store::TokenRecord;

use super::{dice::Dice, input::Input, story::word};
use crate::in_process::service::Service;

/// From when on a revoked token must be refused, seconds.
const REVOCATION_S: f64 = 0.5;

/// The name of an operator.
pub fn name(operator: usize) -> String {
    word(operator).to_lowercase()
}

/// A token and what became of it.
#[derive(Debug, Clone)]
pub struct Key {
    operator: usize,
    scope: Scope,
    token: Token,
    revoked_at: Option<Timestamp>,
}

impl Key {
    /// What a request shows.
    pub fn shown(&self) -> String {
        format!("Bearer {}", self.token.reveal())
    }

    /// A request of its owner.
    pub fn signed(&self, mut request: Request<Body>) -> Request<Body> {
        let shown = self.shown().parse().expect("a header");
        request.headers_mut().insert("authorization", shown);
        request
    }

    /// Whether its owner may send an input.
    fn opens(&self, input: &Input) -> bool {
        match (&self.scope, input) {
            (Scope::Admin, _) => true,
            (Scope::Aircraft(tail), Input::Upload(upload)) => upload.tail == *tail,
            (Scope::Planner, Input::Upload(_) | Input::Configuration { .. }) => false,
            (Scope::Planner, _) => true,
            _ => false,
        }
    }

    /// Whether a request with it may be refused, and whether it must be.
    pub fn is_refused(&self, now: Timestamp) -> (bool, bool) {
        let since_s = self.revoked_at.map(|at| 3600.0 * now.hours_since(at));
        (since_s.is_some(), since_s.is_some_and(|seconds| seconds >= REVOCATION_S))
    }
}

/// All tokens that there ever were.
pub struct Keyring {
    keys: Vec<Key>,
    dice: Dice,
}

impl Keyring {
    /// A key for each who speaks for an operator: the first of each is its administrator's, and is never revoked.
    pub fn new(seed: u64, operators: usize, tails: &[(usize, TailNumber)]) -> Self {
        let mut keyring = Self { keys: Vec::new(), dice: Dice::new(seed, &["keys"]) };
        for operator in 0..operators {
            let aircraft =
                tails.iter().filter(|(of, _)| *of == operator).map(|(_, tail)| Scope::Aircraft(tail.clone()));
            for scope in [Scope::Admin, Scope::Admin, Scope::Planner, Scope::Ops].into_iter().chain(aircraft) {
                keyring.cut(operator, scope);
            }
        }
        keyring
    }

    /// Cuts a key that nobody knows yet.
    fn cut(&mut self, operator: usize, scope: Scope) -> usize {
        let mut random = [0; 32];
        random.chunks_mut(8).for_each(|word| word.copy_from_slice(&self.dice.bits().to_le_bytes()));
        self.keys.push(Key { operator, scope, token: Token::issue(random), revoked_at: None });
        self.keys.len() - 1
    }

    /// The key of a number.
    pub fn key(&self, number: usize) -> &Key {
        &self.keys[number]
    }

    /// The administrator of an operator.
    pub fn admin(&self, operator: usize) -> &Key {
        self.keys.iter().find(|key| key.operator == operator).expect("each has one")
    }

    /// A key that opens for all these inputs now.
    pub fn for_inputs(&self, operator: usize, inputs: &[&Input], dice: &mut Dice) -> usize {
        let opens = |key: &Key| inputs.iter().all(|input| key.opens(input));
        self.pick(operator, opens, dice)
    }

    /// A key of one who may read everything.
    pub fn for_questions(&self, operator: usize, dice: &mut Dice) -> usize {
        self.pick(operator, |key| !matches!(key.scope, Scope::Aircraft(_)), dice)
    }

    fn pick(&self, operator: usize, opens: impl Fn(&Key) -> bool, dice: &mut Dice) -> usize {
        let able = |key: &Key| key.operator == operator && key.revoked_at.is_none() && opens(key);
        let able: Vec<usize> = (0..self.keys.len()).filter(|&number| able(&self.keys[number])).collect();
        *dice.pick(&able)
    }

    /// Tells the service of all keys.
    pub async fn hand_over(&self, service: &Service, now: Timestamp) {
        for key in &self.keys {
            create(service, key, now).await;
        }
    }

    /// A key that may be replaced.
    pub fn spare(&self, dice: &mut Dice) -> usize {
        let spare: Vec<usize> = (0..self.keys.len()).filter(|&number| self.is_spare(number)).collect();
        *dice.pick(&spare)
    }

    /// Replaces a key: its owner is handed another one; of two in use the older one is revoked.
    pub async fn replace(&mut self, old: usize, service: &Service, now: Timestamp) -> &'static str {
        let Key { operator, scope, token, .. } = self.keys[old].clone();
        let twin = (old + 1..self.keys.len()).any(|number| {
            let key = &self.keys[number];
            key.operator == operator && key.scope == scope && key.revoked_at.is_none()
        });
        if twin {
            let act = Actor::Cli.at(now);
            let operator = name(operator).parse().expect("a name");
            let revoked = service.store().revoke_token(&operator, &token.id, act).await.expect("a write");
            assert_eq!(revoked, Some(store::Revocation::Revoked));
            self.keys[old].revoked_at = Some(now);
            return "revoked tokens";
        }
        let new = self.cut(operator, scope);
        create(service, &self.keys[new], now).await;
        "new tokens"
    }

    /// Whether a key may be replaced: the first one of each operator stays.
    fn is_spare(&self, number: usize) -> bool {
        let key = &self.keys[number];
        key.revoked_at.is_none() && !std::ptr::eq(self.admin(key.operator), key)
    }
}

async fn create(service: &Service, key: &Key, now: Timestamp) {
    let record = TokenRecord {
        id: key.token.id,
        operator: name(key.operator).parse().expect("a name"),
        scope: key.scope.clone(),
        name: Some(format!("{} {}", word(key.operator), key.scope.as_str()).parse().expect("a name")),
        secret: key.token.secret.hash(),
        created_at: now,
        expires_at: None,
        revoked_at: None,
    };
    service.store().create_token(&record, Actor::Cli).await.expect("a new token");
}
