//! What one answer must not say.

use axum::http::HeaderMap;

use super::names::Owner;
use crate::in_process::service::Answer;

/// An answer as plain text, with every name of `of` that the request itself told put as its ghost's: what is asked
/// about may be echoed, and nothing else.
pub fn plain(answer: &Answer, request: &str, of: Owner) -> String {
    let mut text = format!("{}\n{}\n{}", answer.status, headers(&answer.headers), text(&answer.body));
    for name in told(request, of) {
        text = text.replace(&name, &name.replace(of.word(), of.ghost().word()));
    }
    text
}

/// Fails where an answer tells anything of an operator, beyond what was asked in its words.
pub fn keep_silent(answer: &Answer, request: &str, about: Owner, cell: &str) {
    let text = plain(answer, request, about);
    let found = text.to_uppercase().find(about.word());
    assert!(found.is_none(), "{cell}: {} leaks: {text}", about.word());
}

/// All names of an operator in a request: whole words, the longest first.
fn told(request: &str, of: Owner) -> Vec<String> {
    let part_of_name = |c: char| c.is_ascii_alphanumeric() || "-.:_".contains(c);
    let words = request.split(|c: char| !part_of_name(c)).filter(|word| word.contains(of.word()));
    let mut names: Vec<String> = words.map(str::to_owned).collect();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    names.dedup();
    names
}

fn headers(headers: &HeaderMap) -> String {
    // The details of a gRPC status are a message in base64.
    let details = tonic::Status::from_header_map(headers).map(|status| text(status.details())).unwrap_or_default();
    let plain = headers.iter().filter(|(name, _)| *name != "grpc-status-details-bin");
    let mut lines: Vec<String> = plain.map(|(name, value)| format!("{name}: {}", text(value.as_bytes()))).collect();
    lines.push(details);
    lines.sort();
    lines.join("\n")
}

/// Bytes of a message as text: what is readable in them stays so, and none is lost.
fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}
