//! `actuary due`: which components of a running service are due, for people.

use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use proto::answer::DueAnswer;
use reqwest::{Response, StatusCode, Url, header::CONTENT_TYPE};

use crate::{
    exit::Failure,
    http::{self, Access, Address, shown},
    say, table,
};

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// List the actuators that have failed, or whose probability of failure within some flight hours exceeds
/// a risk: worst first, with the hours until which each is safe; and those whose state is unknown.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary due --within-fh 300 --risk 0.05\n  actuary due --csv > due.csv\n\n\
    Hours count from the newest data of each actuator; hours flown since then are to be subtracted.")]
pub struct Arguments {
    /// The service.
    #[arg(long, env = "ACTUARY_URL", hide_env_values = true, default_value = "http://127.0.0.1:8080")]
    url: Address,
    #[command(flatten)]
    access: Access,
    /// Flight hours from the newest data of each actuator, 0 to 10000.
    #[arg(long, value_name = "H", default_value_t = 500.0, allow_negative_numbers = true)]
    within_fh: f64,
    /// Probability of failure within them, above which an actuator is due.
    #[arg(long, value_name = "P", default_value_t = 0.1, allow_negative_numbers = true)]
    risk: f64,
    /// Print the list as CSV.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

/// Prints the list.
pub fn run(arguments: &Arguments) -> Result<()> {
    let text = tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(list(arguments))?;
    say::text(text);
    Ok(())
}

async fn list(arguments: &Arguments) -> Result<String> {
    let service = Service::new(arguments)?;
    if arguments.csv {
        return service.csv().await;
    }
    let list = service.whole().await?;
    Ok(if arguments.json { serde_json::to_string_pretty(&list)? + "\n" } else { table::due(&list) })
}

/// The service that is asked, and the question.
struct Service {
    http: reqwest::Client,
    url: Url,
}

impl Service {
    fn new(arguments: &Arguments) -> Result<Self> {
        let mut url = arguments.url.url()?;
        let http = arguments.access.client(&url, PATIENCE)?;
        url.set_path(&format!("{}/v1/fleet/due", url.path().trim_end_matches('/')));
        let (within_fh, risk) = (arguments.within_fh.to_string(), arguments.risk.to_string());
        url.query_pairs_mut().clear().extend_pairs([("within_fh", within_fh), ("risk", risk)]);
        Ok(Self { http, url })
    }

    async fn csv(&self) -> Result<String> {
        let answer = self.ask(&[("format", "csv")]).await?;
        let kind = answer.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
        if !kind.starts_with("text/csv") {
            return Err(anyhow!("{}: {kind:?} is no CSV", self.oddly()));
        }
        answer.text().await.with_context(|| self.oddly())
    }

    fn oddly(&self) -> String {
        format!("{} answers oddly", shown(&self.url))
    }

    /// All pages as one list.
    async fn whole(&self) -> Result<DueAnswer> {
        let mut whole: Option<DueAnswer> = None;
        loop {
            let mut further = vec![("limit", "1000")];
            let cursor = whole.as_ref().and_then(|list| list.next_cursor.clone());
            further.extend(cursor.as_deref().map(|cursor| ("cursor", cursor)));
            let page: DueAnswer = self.ask(&further).await?.json().await.with_context(|| self.oddly())?;
            let list = match whole {
                None => page,
                Some(mut list) => {
                    list.items.extend(page.items);
                    list.unknown.extend(page.unknown);
                    DueAnswer { next_cursor: page.next_cursor, ..list }
                }
            };
            if list.next_cursor.is_none() {
                return Ok(list);
            }
            whole = Some(list);
        }
    }

    async fn ask(&self, further: &[(&str, &str)]) -> Result<Response> {
        let mut url = self.url.clone();
        url.query_pairs_mut().extend_pairs(further);
        let answer = self.http.get(url).send().await.map_err(|error| http::silent(&self.url, &error))?;
        match answer.status() {
            StatusCode::OK => Ok(answer),
            StatusCode::UNPROCESSABLE_ENTITY | StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN => {
                Err(Failure::BadInput(refusal(answer).await).into())
            }
            StatusCode::SERVICE_UNAVAILABLE => Err(Failure::NotReachable(refusal(answer).await).into()),
            StatusCode::NOT_FOUND => {
                let reason = "no due list is there (404 Not Found): --url is the address of the service as a whole";
                Err(Failure::BadInput(format!("{}: {reason}", shown(&self.url))).into())
            }
            _ => Err(anyhow!("{}", refusal(answer).await)),
        }
    }
}

/// Why the service refuses, in its own words.
async fn refusal(answer: Response) -> String {
    let from = shown(answer.url());
    format!("{from} answers {}", http::said(answer).await)
}
