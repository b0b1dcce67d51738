//! A running service as commands ask it: one way for all of them to say where it is, to join pages, and to tell why there is
//! no answer.

use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use reqwest::{
    Client, RequestBuilder, Response, StatusCode, Url,
    header::{CONTENT_TYPE, ETAG, IF_NONE_MATCH},
};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

use crate::{
    exit::Failure,
    http::{self, Access, Address, shown},
};

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// Items of a page.
const PAGE: &str = "1000";

/// The service that a command asks.
#[derive(Debug, Args)]
pub struct Endpoint {
    /// The service.
    #[arg(long, env = "ACTUARY_URL", hide_env_values = true, default_value = "http://127.0.0.1:8080")]
    url: Address,
    #[command(flatten)]
    access: Access,
}

impl Endpoint {
    /// The service there.
    pub fn service(&self) -> Result<Service> {
        let mut base = self.url.url()?;
        base.set_query(None);
        base.set_fragment(None);
        Ok(Service { http: self.access.client(&base, PATIENCE)?, base })
    }
}

/// A path of the service, and what is asked of it.
#[derive(Debug, Clone)]
pub struct Question {
    path: Vec<String>,
    query: Vec<(&'static str, String)>,
}

impl Question {
    /// Asks a path, by its segments.
    pub fn new<'a>(path: impl IntoIterator<Item = &'a str>) -> Self {
        Self { path: path.into_iter().map(str::to_owned).collect(), query: Vec::new() }
    }

    /// The same with a parameter more, where there is one.
    pub fn with(mut self, name: &'static str, value: Option<impl ToString>) -> Self {
        self.query.extend(value.map(|value| (name, value.to_string())));
        self
    }
}

/// A page that a caller has, and its tag.
#[derive(Debug, Clone, PartialEq)]
pub struct Tagged {
    tag: String,
    /// The page.
    pub page: Value,
}

/// A service that is asked.
#[derive(Debug)]
pub struct Service {
    http: Client,
    base: Url,
}

impl Service {
    /// The answer, read as `T`.
    pub async fn get<T: DeserializeOwned>(&self, question: &Question) -> Result<T> {
        let url = self.url(question);
        read(&url, answered(&url, self.http.get(url.clone())).await?).await
    }

    /// The answer to a body.
    pub async fn post<T: DeserializeOwned>(&self, question: &Question, body: &impl Serialize) -> Result<T> {
        let url = self.url(question);
        read(&url, answered(&url, self.http.post(url.clone()).json(body)).await?).await
    }

    /// The answer to a body that takes the place of what was there.
    pub async fn put<T: DeserializeOwned>(&self, question: &Question, body: &impl Serialize) -> Result<T> {
        let url = self.url(question);
        read(&url, answered(&url, self.http.put(url.clone()).json(body)).await?).await
    }

    /// The answer to a table that takes the place of what was there.
    pub async fn put_csv<T: DeserializeOwned>(&self, question: &Question, table: Vec<u8>) -> Result<T> {
        let url = self.url(question);
        let request = self.http.put(url.clone()).header(CONTENT_TYPE, "text/csv").body(table);
        read(&url, answered(&url, request).await?).await
    }

    /// The answer as CSV.
    pub async fn csv(&self, question: &Question) -> Result<String> {
        let url = self.url(&question.clone().with("format", Some("csv")));
        let answer = answered(&url, self.http.get(url.clone())).await?;
        let kind = answer.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
        if !kind.starts_with("text/csv") {
            return Err(anyhow!("{}: {kind:?} is no CSV", oddly(&url)));
        }
        answer.text().await.with_context(|| oddly(&url))
    }

    /// All pages of a list as one answer, whose arrays `lists` are joined.
    pub async fn whole(&self, question: &Question, lists: &[&str]) -> Result<Value> {
        let mut pages = Vec::new();
        loop {
            let page: Value = self.get(&page_after(question, pages.last())).await?;
            let is_last = next(&page).is_none();
            pages.push(page);
            if is_last {
                return Ok(joined(pages, lists));
            }
        }
    }

    /// All pages of a list, of which those that did not change since `known` are not sent again.
    pub async fn pages(&self, question: &Question, known: &[Tagged]) -> Result<Vec<Tagged>> {
        let mut pages: Vec<Tagged> = Vec::new();
        loop {
            let asked = page_after(question, pages.last().map(|last| &last.page));
            let page = self.page(&asked, known.get(pages.len())).await?;
            let is_last = next(&page.page).is_none();
            pages.push(page);
            if is_last {
                return Ok(pages);
            }
        }
    }

    async fn page(&self, question: &Question, known: Option<&Tagged>) -> Result<Tagged> {
        let url = self.url(question);
        let request = self.http.get(url.clone());
        let request = match known {
            Some(known) => request.header(IF_NONE_MATCH, &known.tag),
            None => request,
        };
        let answer = answered(&url, request).await?;
        match known {
            Some(known) if answer.status() == StatusCode::NOT_MODIFIED => Ok(known.clone()),
            _ => {
                let tag = answer.headers().get(ETAG).and_then(|tag| tag.to_str().ok()).unwrap_or_default().to_owned();
                Ok(Tagged { tag, page: read(&url, answer).await? })
            }
        }
    }

    fn url(&self, question: &Question) -> Url {
        let mut url = self.base.clone();
        if let Ok(mut path) = url.path_segments_mut() {
            path.pop_if_empty().extend(&question.path);
        }
        if !question.query.is_empty() {
            url.query_pairs_mut().extend_pairs(&question.query);
        }
        url
    }
}

/// What a command asks, to its end.
pub fn wait<T>(asking: impl Future<Output = Result<T>>) -> Result<T> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(asking)
}

/// The pages of a list as one answer, whose arrays `lists` are joined.
pub fn joined(pages: impl IntoIterator<Item = Value>, lists: &[&str]) -> Value {
    let mut pages = pages.into_iter();
    let mut whole = pages.next().unwrap_or_default();
    for mut page in pages {
        for list in lists {
            if let (Some(items), Some(further)) = (whole[*list].as_array_mut(), page[*list].as_array_mut()) {
                items.append(further);
            }
        }
        whole["next_cursor"] = page["next_cursor"].take();
    }
    whole
}

fn next(page: &Value) -> Option<&str> {
    page["next_cursor"].as_str()
}

fn page_after(question: &Question, last: Option<&Value>) -> Question {
    question.clone().with("limit", Some(PAGE)).with("cursor", last.and_then(next))
}

fn oddly(url: &Url) -> String {
    format!("{} answers oddly", shown(url))
}

async fn read<T: DeserializeOwned>(url: &Url, answer: Response) -> Result<T> {
    answer.json().await.with_context(|| oddly(url))
}

/// An answer that is one, or why there is none: 2 for what cannot be answered, 3 for who cannot be reached.
async fn answered(url: &Url, request: RequestBuilder) -> Result<Response> {
    let answer = request.send().await.map_err(|error| http::silent(url, &error))?;
    let status = answer.status();
    if status.is_success() || status == StatusCode::NOT_MODIFIED {
        return Ok(answer);
    }
    if status == StatusCode::NOT_FOUND && !is_problem(&answer) {
        let reason = "nothing of a service is there (404 Not Found): --url is the address of the service as a whole";
        return Err(Failure::BadInput(format!("{}: {reason}", shown(url))).into());
    }
    let said = format!("{} answers {}", shown(url), http::said(answer).await);
    match status {
        StatusCode::SERVICE_UNAVAILABLE => Err(Failure::NotReachable(said).into()),
        status if status.is_client_error() => Err(Failure::BadInput(said).into()),
        _ => Err(anyhow!(said)),
    }
}

/// Whether an answer is in the words of a service of this kind.
fn is_problem(answer: &Response) -> bool {
    let kind = answer.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
    kind.is_some_and(|kind| kind.starts_with("application/problem+json"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_question_keeps_its_names_whatever_they_hold_and_nothing_of_the_address_but_its_place() {
        let _ = rustls::crypto::ring::default_provider().install_default();
        let base = "https://host/actuary/".parse().unwrap();
        let service = Service { http: Client::builder().tls_certs_only([]).build().unwrap(), base };
        let question =
            Question::new(["v1", "components", "A/B", "S 1?"]).with("risk", Some(0.1)).with("by", None::<&str>);
        assert_eq!(service.url(&question).as_str(), "https://host/actuary/v1/components/A%2FB/S%201%3F?risk=0.1");
        assert_eq!(service.url(&Question::new(["version"])).as_str(), "https://host/actuary/version");
    }

    #[test]
    fn pages_are_joined_and_what_is_no_list_is_of_the_first() {
        let pages = [
            json!({"items": [1], "unknown": [], "total": 3, "next_cursor": "a"}),
            json!({"items": [2], "unknown": [3], "total": 3, "next_cursor": null}),
        ];
        let whole = joined(pages, &["items", "unknown"]);
        assert_eq!(whole, json!({"items": [1, 2], "unknown": [3], "total": 3, "next_cursor": null}));
    }
}
