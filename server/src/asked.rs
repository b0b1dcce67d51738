//! A question that may have been answered before: whoever has the answer already is told so, without its being built or
//! sent again.

use axum::{
    extract::FromRequestParts,
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{ETAG, IF_NONE_MATCH},
        request::Parts,
    },
    response::{IntoResponse, Response},
};
use domain::OperatorId;
use store::Scope;

use crate::{
    auth::Caller,
    encoding::{Encoding, varies_by},
    kept::Key,
    present::Present,
    refusal::Refusal,
    state::Shared,
};

/// A question for what is shown of an operator.
pub struct Asked {
    operator: OperatorId,
    target: String,
    wanted: Option<Encoding>,
    known: Known,
}

/// The tags of answers that a caller has.
#[derive(Debug, PartialEq)]
enum Known {
    /// Whichever there is.
    Any,
    /// These; their weakness does not matter.
    Tags(Vec<String>),
}

impl Known {
    fn read(headers: &HeaderMap) -> Self {
        let given = headers.get_all(IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
        let tags: Vec<&str> = given.flat_map(|list| list.split(',')).map(str::trim).collect();
        match tags[..] {
            ["*"] => Self::Any,
            _ => Self::Tags(tags.into_iter().map(|tag| tag.strip_prefix("W/").unwrap_or(tag).to_owned()).collect()),
        }
    }

    fn includes(&self, tag: &HeaderValue) -> bool {
        match self {
            Self::Any => true,
            Self::Tags(tags) => tags.iter().any(|known| known.as_bytes() == tag.as_bytes()),
        }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Asked {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let caller = Caller::from_request_parts(parts, state).await?;
        Ok(Self {
            operator: caller.operator().clone(),
            target: parts.uri.path_and_query().map(|target| target.as_str().to_owned()).unwrap_or_default(),
            wanted: Encoding::wanted(&parts.headers),
            known: Known::read(&parts.headers),
        })
    }
}

impl Asked {
    /// The same question for a form that the path and the query do not tell.
    pub fn in_form(mut self, form: &str) -> Self {
        self.target = format!("{form} {}", self.target);
        self
    }

    /// Tells what `make` answers of a scope: as it was kept while it holds, or only that the caller has it.
    pub async fn tell<R: IntoResponse>(
        self,
        shared: &Shared,
        scope: Scope<'_>,
        make: impl AsyncFnOnce(&Present) -> Result<R, Refusal>,
    ) -> Result<Response, Refusal> {
        // Before anything is read: what is kept under this version is at least as new.
        let version = shared.state.store.version(&self.operator, scope).await?;
        let key = Key { operator: self.operator.clone(), target: self.target, version };
        let made = async || {
            let present = shared.state.present(&self.operator).await?;
            make(&present).await.map(|answer| (answer, present))
        };
        let kept = shared.kept.get(key, (shared.state.clock)(), made).await?;
        let encoding = kept.encoding(self.wanted);
        let tag = kept.tag(encoding);
        let mut response = match self.known.includes(&tag) {
            true => StatusCode::NOT_MODIFIED.into_response(),
            false => kept.response(encoding).await?,
        };
        response.headers_mut().insert(ETAG, tag);
        varies_by(response.headers_mut(), HeaderValue::from_static("accept-encoding"));
        Ok(response)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_compared_weakly() {
        let known = |values: &[&str]| {
            let values = values.iter().map(|value| (IF_NONE_MATCH, value.parse().unwrap()));
            let mut headers = HeaderMap::new();
            for (name, value) in values {
                headers.append(name, value);
            }
            Known::read(&headers).includes(&HeaderValue::from_static("\"ab-br\""))
        };
        for values in [&["\"ab-br\""][..], &["W/\"ab-br\""], &["\"x\", W/\"ab-br\" "], &["\"x\"", "\"ab-br\""], &["*"]]
        {
            assert!(known(values), "{values:?}");
        }
        for values in [&[][..], &[""], &["ab-br"], &["\"ab\""], &["w/\"ab-br\""], &["\"ab-gzip\""], &["\"*\""]] {
            assert!(!known(values), "{values:?}");
        }
    }
}
