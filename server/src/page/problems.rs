//! Kinds of problems for people: what each means, and what to do.

use askama::Template;
use axum::response::Response;
use serde::Deserialize;

use super::html;
use crate::{
    path::Named,
    refusal::{Kind, Refusal},
};

#[derive(Template)]
#[template(path = "problems.html")]
struct ProblemsPage {
    kinds: &'static [Kind],
}

#[derive(Template)]
#[template(path = "problem.html")]
struct ProblemPage {
    kind: Kind,
}

/// A kind of problem in a path.
#[derive(Deserialize)]
pub struct One {
    kind: String,
}

/// `GET /problems`
pub async fn list() -> Result<Response, Refusal> {
    html(&ProblemsPage { kinds: Kind::ALL })
}

/// `GET /problems/{kind}`
pub async fn get(Named(One { kind: name }): Named<One>) -> Result<Response, Refusal> {
    let known = Kind::named(&name);
    let kind = known.ok_or_else(|| Refusal::NotFound("there is no such kind of problem: see /problems".to_owned()))?;
    html(&ProblemPage { kind })
}
