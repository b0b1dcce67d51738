//! Answers that were built before. One is told again as long as nothing of what it shows has changed, and no clock or date
//! makes it read otherwise: the version of what is shown is part of its key, the moments are its own.
//!
//! The key names the operator, so that nobody is told what belongs to another one; so does the tag by which a caller asks
//! whether it has the answer already. A tag is a hash of the answer: as long as that reads the same it stays, whatever was
//! stored meanwhile.

use std::{fmt, sync::Arc};

use axum::{
    body::{Body, Bytes},
    http::{
        HeaderMap, HeaderValue,
        header::{CONTENT_ENCODING, CONTENT_LENGTH},
    },
    response::{IntoResponse, Response},
};
use domain::{ContentHash, OperatorId, Timestamp};
use quick_cache::{OptionsBuilder, Weighter, sync::Cache};
use store::Version;
use tokio::sync::OnceCell;

use crate::{
    encoding::{Encoding, is_worth},
    present::Present,
    refusal::Refusal,
};

/// What all of them may take together.
const KEPT_BYTES: u64 = 32 << 20;
/// The largest one takes no more than a shard has room for.
const SHARDS: usize = 2;
/// What an answer takes beside its body.
const OVERHEAD_BYTES: u64 = 1024;
/// The length of an answer that tells how many are kept.
const USUAL_BYTES: u64 = 16 << 10;
/// Answers that were begun by others so little later count as begun now, microseconds.
const CONCURRENT_US: i64 = 1_000_000;
/// Characters of a tag.
const TAG_CHARACTERS: usize = 32;

/// The name of an answer.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Key {
    /// The operator whose data it shows.
    pub operator: OperatorId,
    /// What was asked for: path, query, and form.
    pub target: String,
    /// The version of what it shows.
    pub version: Version,
}

/// An answer, and how long it holds.
pub struct Kept {
    begun: Timestamp,
    until: Timestamp,
    tag: String,
    headers: HeaderMap,
    body: Bytes,
    encoded: [OnceCell<Bytes>; Encoding::ALL.len()],
}

/// Answers as they were built, by their keys.
pub struct KeptAnswers(Cache<Key, Arc<Kept>, Bytewise>);

/// Weighs by bytes: encodings that come later are smaller together than the body.
#[derive(Clone)]
struct Bytewise;

impl Weighter<Key, Arc<Kept>> for Bytewise {
    fn weight(&self, key: &Key, kept: &Arc<Kept>) -> u64 {
        OVERHEAD_BYTES + (key.target.len() + 2 * kept.body.len()) as u64
    }
}

impl Default for KeptAnswers {
    fn default() -> Self {
        let items = (KEPT_BYTES / USUAL_BYTES) as usize;
        let mut options = OptionsBuilder::new();
        options.shards(SHARDS).estimated_items_capacity(items).weight_capacity(KEPT_BYTES);
        let options = options.build().expect("capacities are given");
        Self(Cache::with_options(options, Bytewise, Default::default(), Default::default()))
    }
}

impl fmt::Debug for KeptAnswers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KeptAnswers").field("answers", &self.0.len()).field("weight", &self.0.weight()).finish()
    }
}

impl KeptAnswers {
    /// The answer of a key as it reads `now`: as it was kept, or as `make` builds it with the moment of it. Of those who ask
    /// for the same at the same time one builds it.
    pub async fn get<R: IntoResponse>(
        &self,
        key: Key,
        now: Timestamp,
        make: impl AsyncFnOnce() -> Result<(R, Present), Refusal>,
    ) -> Result<Arc<Kept>, Refusal> {
        match self.0.get_value_or_guard_async(&key).await {
            Ok(kept) if kept.holds_at(now) => Ok(kept),
            Ok(_) => {
                let kept = Arc::new(Kept::build(&key, make().await?).await?);
                self.0.insert(key, kept.clone());
                Ok(kept)
            }
            Err(guard) => {
                let kept = Arc::new(Kept::build(&key, make().await?).await?);
                // Whoever waited has it, though it may be too large to be kept.
                let _ = guard.insert(kept.clone());
                Ok(kept)
            }
        }
    }
}

impl Kept {
    async fn build(key: &Key, (answer, present): (impl IntoResponse, Present)) -> Result<Self, Refusal> {
        let (mut head, body) = answer.into_response().into_parts();
        let body = axum::body::to_bytes(body, usize::MAX).await.map_err(|_| Refusal::Internal)?;
        head.headers.remove(CONTENT_LENGTH);
        let hash = ContentHash::of_parts([key.operator.as_str().as_bytes(), &body]);
        let tag = hash.to_string()[..TAG_CHARACTERS].to_owned();
        let (begun, until) = (present.now(), present.until());
        Ok(Self { begun, until, tag, headers: head.headers, body, encoded: Default::default() })
    }

    fn holds_at(&self, now: Timestamp) -> bool {
        now < self.until && self.begun.micros() - now.micros() < CONCURRENT_US
    }

    /// The encoding in which a caller gets it that would like one.
    pub fn encoding(&self, wanted: Option<Encoding>) -> Option<Encoding> {
        wanted.filter(|_| is_worth(&self.headers, self.body.len()))
    }

    /// The tag of it in an encoding, as it stands in headers.
    pub fn tag(&self, encoding: Option<Encoding>) -> HeaderValue {
        let tag = match encoding {
            None => format!("\"{}\"", self.tag),
            Some(encoding) => format!("\"{}-{}\"", self.tag, encoding.name()),
        };
        HeaderValue::try_from(tag).expect("digits and letters make a header")
    }

    /// The answer in an encoding.
    pub async fn response(&self, encoding: Option<Encoding>) -> Result<Response, Refusal> {
        let body = match encoding {
            None => self.body.clone(),
            Some(one) => self.encoded[one as usize].get_or_try_init(|| one.compress(self.body.clone())).await?.clone(),
        };
        let mut response = Response::new(Body::from(body));
        *response.headers_mut() = self.headers.clone();
        if let Some(encoding) = encoding {
            response.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static(encoding.name()));
        }
        Ok(response)
    }
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicU64, Ordering},
        time::Duration,
    };

    use store::{Options, Scope, Store};

    use super::*;

    /// A store without anything, and the key of an answer about an operator of it.
    async fn key(operator: &str, target: &str) -> Key {
        let folder = tempfile::tempdir().unwrap();
        let url = format!("sqlite:{}", folder.path().join("empty.sqlite").display());
        let store = Store::open(&url, Options::default()).await.unwrap();
        let operator: OperatorId = operator.parse().unwrap();
        let version = store.version(&operator, Scope::Fleet).await.unwrap();
        store.close().await;
        Key { operator, target: target.to_owned(), version }
    }

    fn at(hours: f64) -> Timestamp {
        let noon: Timestamp = "2026-03-01T12:00:00Z".parse().unwrap();
        noon.plus_hours(hours)
    }

    fn present(now: Timestamp) -> Present {
        Present::at(now, Duration::MAX)
    }

    #[tokio::test]
    async fn an_answer_is_built_once_as_long_as_it_holds() {
        let (kept, built) = (KeptAnswers::default(), AtomicU64::new(0));
        let (mine, theirs) = (key("mine", "/v1/tails").await, key("theirs", "/v1/tails").await);
        assert_eq!(mine.version, theirs.version, "both show nothing");
        let get = async |key: &Key, now: Timestamp| {
            let build = async || {
                built.fetch_add(1, Ordering::Relaxed);
                let present = present(now);
                Ok((format!("{} days", present.days_since("2026-03-01T00:00:00Z".parse().unwrap())), present))
            };
            kept.get(key.clone(), now, build).await
        };
        let tags = futures_util::future::join_all((0..20).map(|_| get(&mine, at(0.0)))).await;
        let tag = tags[0].as_ref().unwrap().tag(None);
        assert!(tags.iter().all(|kept| kept.as_ref().unwrap().tag(None) == tag));
        assert_eq!(built.load(Ordering::Relaxed), 1, "of those who ask at once one builds it");
        get(&mine, at(11.9)).await.unwrap();
        assert_eq!(built.load(Ordering::Relaxed), 1, "the same day");
        let later = get(&mine, at(12.0)).await.unwrap();
        assert_eq!((built.load(Ordering::Relaxed), &later.body[..]), (2, &b"1 days"[..]));
        assert_ne!(later.tag(None), tag);
        get(&mine, at(13.0)).await.unwrap();
        assert_eq!(built.load(Ordering::Relaxed), 2, "the later one is kept");
        let other = get(&theirs, at(12.0)).await.unwrap();
        assert_eq!(built.load(Ordering::Relaxed), 3, "another operator's is another");
        assert_ne!(other.tag(None), later.tag(None), "though it reads the same");
    }

    #[tokio::test]
    async fn what_fails_is_not_kept_and_what_is_kept_is_bounded() {
        let kept = KeptAnswers::default();
        let one = key("mine", "/v1/tails").await;
        let fail = async || Err::<(String, Present), _>(Refusal::Internal);
        assert!(kept.get(one.clone(), at(0.0), fail).await.is_err());
        assert!(kept.get(one.clone(), at(0.0), async || Ok(("there", present(at(0.0))))).await.is_ok());
        for number in 0..40 {
            let key = Key { target: number.to_string(), ..one.clone() };
            let large = async || Ok(("x".repeat(1 << 20), present(at(0.0))));
            assert_eq!(kept.get(key, at(0.0), large).await.unwrap().body.len(), 1 << 20);
        }
        assert!(kept.0.weight() <= KEPT_BYTES && kept.0.len() >= 8, "{kept:?}");
        let whole = async || Ok(("x".repeat(KEPT_BYTES as usize), present(at(0.0))));
        assert!(kept.get(Key { target: "whole".to_owned(), ..one }, at(0.0), whole).await.is_ok(), "told, if not kept");
        assert!(kept.0.weight() <= KEPT_BYTES, "{kept:?}");
    }
}
