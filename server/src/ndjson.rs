//! Many uploads in one body, one per line: answered line by line, in their order, while the body is
//! still coming in.

use std::{convert::Infallible, time::Duration};

use axum::body::{Body, BodyDataStream};
use bytes::{Bytes, BytesMut};
use domain::TailNumber;
use futures_util::{StreamExt, stream};
use proto::json::{self, LineResult, UploadBody};

use crate::{
    app::Shared,
    auth::{Caller, admitted},
    ingest::{IN_FLIGHT, Judged, Kept, Transport, check},
    refusal::Refusal,
    rest::MAX_UPLOAD_BYTES,
};

/// Largest body.
const MAX_BODY_BYTES: usize = 16 << 20;
/// Longest silence of the sender.
const SILENCE: Duration = Duration::from_secs(30);

/// The results of every line of `body`, one JSON object per line.
///
/// Lines are checked one after the other and queued in their order, so that of two lines with the
/// same upload_id the first one counts; only the wait for the disk is shared. A caller that is admitted no longer
/// is told so on a last line.
pub fn results(shared: Shared, caller: Caller, tail: TailNumber, body: Body) -> Body {
    let reader = Lines::new(body);
    let lines = stream::unfold(reader, |mut reader| async move { Some((reader.next().await?, reader)) });
    let lines = admitted(caller.clone(), lines).scan(0, |last, line| {
        let line = line.unwrap_or_else(|refusal| Line { number: *last + 1, text: Err(refusal) });
        *last = line.number;
        std::future::ready(Some(line))
    });
    let checker = shared.clone();
    let checked = lines.then(move |line| {
        let (shared, caller, tail) = (checker.clone(), caller.clone(), tail.clone());
        async move { judge(&shared, &caller, tail, line).await }
    });
    let results = checked.map(move |judged| {
        let shared = shared.clone();
        async move { Ok::<_, Infallible>(encode(&result(judged.keep(&shared, Transport::Ndjson).await))) }
    });
    Body::from_stream(results.buffered(IN_FLIGHT))
}

fn encode(result: &LineResult) -> Bytes {
    let mut line = serde_json::to_vec(result).expect("results have text keys only");
    line.push(b'\n');
    line.into()
}

async fn judge(shared: &Shared, caller: &Caller, tail: TailNumber, line: Line) -> Judged {
    let refused = |refusal| Judged { number: line.number, upload_id: None, outcome: Err(refusal) };
    let body: UploadBody = match line.text.and_then(|text| Ok(json::parse(&text)?)) {
        Ok(body) => body,
        Err(refusal) => return refused(refusal),
    };
    let upload_id = body.upload_id.parse().ok();
    let outcome = match body.into_upload(tail) {
        Ok(upload) => check(shared, caller, upload).await,
        Err(invalid) => Err(invalid.into()),
    };
    Judged { number: line.number, upload_id, outcome }
}

fn result(kept: Kept) -> LineResult {
    LineResult {
        line: kept.number,
        upload_id: kept.upload_id.map(String::from),
        status: kept.status,
        error: kept.refusal.map(|refusal| refusal.problem()),
    }
}

/// One line, or why it could not be read.
struct Line {
    number: u64,
    text: Result<Bytes, Refusal>,
}

/// Cuts a body into lines without ever holding more than one line and one chunk.
struct Lines {
    body: BodyDataStream,
    buffer: BytesMut,
    /// Bytes of the buffer that are known to hold no newline.
    searched: usize,
    /// Whether the rest of a line that is too long is being skipped.
    skipping: bool,
    received: usize,
    number: u64,
    ended: bool,
}

impl Lines {
    fn new(body: Body) -> Self {
        Self {
            body: body.into_data_stream(),
            buffer: BytesMut::new(),
            searched: 0,
            skipping: false,
            received: 0,
            number: 0,
            ended: false,
        }
    }

    /// The next line that is not blank; `None` at the end.
    async fn next(&mut self) -> Option<Line> {
        loop {
            if let Some(line) = self.cut() {
                return Some(line);
            }
            if self.ended {
                return None;
            }
            if let Err(refusal) = self.receive().await {
                self.ended = true;
                self.buffer.clear();
                self.number += 1;
                return Some(Line { number: self.number, text: Err(refusal) });
            }
        }
    }

    /// A line out of the buffer, as long as there is one.
    fn cut(&mut self) -> Option<Line> {
        loop {
            let newline = self.buffer[self.searched..].iter().position(|&byte| byte == b'\n');
            let text = match newline {
                Some(at) => self.buffer.split_to(self.searched + at + 1),
                None if self.ended && !self.buffer.is_empty() => self.buffer.split(),
                None => {
                    self.searched = self.buffer.len();
                    return self.begin_skipping();
                }
            };
            self.searched = 0;
            if std::mem::take(&mut self.skipping) {
                continue;
            }
            self.number += 1;
            let text = text.freeze();
            let text = text.slice_ref(text.trim_ascii());
            if text.len() > MAX_UPLOAD_BYTES {
                return Some(self.too_long());
            }
            if !text.is_empty() {
                return Some(Line { number: self.number, text: Ok(text) });
            }
        }
    }

    /// Drops what has come of a line that is too long; reports it when it is first noticed.
    fn begin_skipping(&mut self) -> Option<Line> {
        if self.buffer.len() <= MAX_UPLOAD_BYTES && !self.skipping {
            return None;
        }
        self.buffer.clear();
        self.searched = 0;
        if std::mem::replace(&mut self.skipping, true) {
            return None;
        }
        self.number += 1;
        Some(self.too_long())
    }

    fn too_long(&self) -> Line {
        Line { number: self.number, text: Err(Refusal::TooLarge { limit_bytes: MAX_UPLOAD_BYTES }) }
    }

    async fn receive(&mut self) -> Result<(), Refusal> {
        let chunk = tokio::time::timeout(SILENCE, self.body.next()).await.map_err(|_| Refusal::Interrupted)?;
        match chunk {
            None => self.ended = true,
            Some(Err(_)) => return Err(Refusal::Interrupted),
            Some(Ok(chunk)) => {
                self.received += chunk.len();
                if self.received > MAX_BODY_BYTES {
                    return Err(Refusal::TooLarge { limit_bytes: MAX_BODY_BYTES });
                }
                self.buffer.extend_from_slice(&chunk);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of a body that comes in `chunks`: number and text, or the status of the refusal.
    async fn lines(chunks: Vec<Vec<u8>>) -> Vec<(u64, Result<Vec<u8>, u16>)> {
        let chunks = chunks.into_iter().map(|chunk| Ok::<_, Infallible>(Bytes::from(chunk)));
        let mut reader = Lines::new(Body::from_stream(stream::iter(chunks)));
        let mut lines = Vec::new();
        while let Some(line) = reader.next().await {
            let text = line.text.map(|text| text.to_vec()).map_err(|refusal| refusal.status().as_u16());
            lines.push((line.number, text));
        }
        lines
    }

    #[tokio::test]
    async fn lines_do_not_depend_on_the_chunks() {
        let body = b"one\r\n\n  two\nthree".to_vec();
        let expected = vec![(1, Ok(b"one".to_vec())), (3, Ok(b"two".to_vec())), (4, Ok(b"three".to_vec()))];
        for size in 1..=body.len() {
            assert_eq!(lines(body.chunks(size).map(<[u8]>::to_vec).collect()).await, expected, "{size}");
        }
    }

    #[tokio::test]
    async fn a_line_that_is_too_long_is_refused_and_the_next_is_read() {
        let mut body = vec![b'x'; MAX_UPLOAD_BYTES + 1];
        body.extend_from_slice(b"\nnext\n");
        let expected = vec![(1, Err(413)), (2, Ok(b"next".to_vec()))];
        for size in [1000, MAX_UPLOAD_BYTES, body.len()] {
            assert_eq!(lines(body.chunks(size).map(<[u8]>::to_vec).collect()).await, expected, "{size}");
        }
    }

    #[tokio::test]
    async fn a_body_that_is_too_large_ends_in_a_refusal() {
        let chunk = vec![b'\n'; 1 << 20];
        let read = lines(vec![chunk; 17]).await;
        assert_eq!(read.len(), 1);
        assert_eq!(read[0].1, Err(413));
    }
}
