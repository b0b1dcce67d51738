//! `actuary due`: which components of a running service are due, for people.

use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use proto::json::{DueBody, Problem};
use reqwest::{Response, StatusCode, Url};

use crate::{
    exit::Failure,
    http::{self, Access},
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
    #[arg(long, env = "ACTUARY_URL", default_value = "http://127.0.0.1:8080")]
    url: String,
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
        return Ok(service.ask(&[("format", "csv")]).await?.text().await?);
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
        let refuse = |reason: &dyn std::fmt::Display| Failure::BadInput(format!("--url {}: {reason}", arguments.url));
        let mut url: Url = arguments.url.parse().map_err(|error| refuse(&error))?;
        if !["http", "https"].contains(&url.scheme()) {
            return Err(refuse(&"must begin with http:// or https://").into());
        }
        url.set_path(&format!("{}/v1/fleet/due", url.path().trim_end_matches('/')));
        let (within_fh, risk) = (arguments.within_fh.to_string(), arguments.risk.to_string());
        url.query_pairs_mut().clear().extend_pairs([("within_fh", within_fh), ("risk", risk)]);
        Ok(Self { http: arguments.access.client(&arguments.url, PATIENCE)?, url })
    }

    /// All pages as one list.
    async fn whole(&self) -> Result<DueBody> {
        let mut whole: Option<DueBody> = None;
        loop {
            let mut further = vec![("limit", "1000")];
            let cursor = whole.as_ref().and_then(|list| list.next_cursor.clone());
            further.extend(cursor.as_deref().map(|cursor| ("cursor", cursor)));
            let page: DueBody =
                self.ask(&further).await?.json().await.with_context(|| format!("{} answers oddly", self.url))?;
            let list = match whole {
                None => page,
                Some(mut list) => {
                    list.items.extend(page.items);
                    list.unknown.extend(page.unknown);
                    DueBody { next_cursor: page.next_cursor, ..list }
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
        let silent = |error| {
            let (origin, cause) = (self.url.origin().ascii_serialization(), http::cause(&error));
            Failure::NotReachable(format!("no service answers at {origin}: {cause}"))
        };
        let answer = self.http.get(url).send().await.map_err(silent)?;
        match answer.status() {
            StatusCode::OK => Ok(answer),
            StatusCode::UNPROCESSABLE_ENTITY | StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN => {
                Err(Failure::BadInput(refusal(answer).await).into())
            }
            StatusCode::SERVICE_UNAVAILABLE => Err(Failure::NotReachable(refusal(answer).await).into()),
            _ => Err(anyhow!("{}", refusal(answer).await)),
        }
    }
}

/// Why the service refuses, in its own words.
async fn refusal(answer: Response) -> String {
    let said = format!("{} answers {}", answer.url(), answer.status());
    answer.json().await.map_or(said, |problem: Problem| problem.detail)
}
