//! Tokens for people.

use std::fmt::Write;

use domain::Timestamp;
use store::TokenRecord;

use super::minute;

/// One line per token.
pub fn tokens(tokens: &[TokenRecord], now: Timestamp) -> String {
    let mut table = String::new();
    line(&mut table, ["id", "scope", "status", "created", "expires", "revoked", "name"].map(str::to_owned));
    for token in tokens {
        let at = |time: Option<Timestamp>| time.map_or_else(|| "-".to_owned(), minute);
        let name = token.name.as_ref().map_or("-", |name| name.as_str());
        line(
            &mut table,
            [
                token.id.to_string(),
                token.scope.to_string(),
                token.status(now).as_str().to_owned(),
                minute(token.created_at),
                at(token.expires_at),
                at(token.revoked_at),
                name.to_owned(),
            ],
        );
    }
    table
}

fn line(table: &mut String, [id, scope, status, created, expires, revoked, name]: [String; 7]) {
    writeln!(table, "{id:<16}  {scope:<19}  {status:<7}  {created:<17}  {expires:<17}  {revoked:<17}  {name}")
        .expect("writing to a string");
}
