//! Bodies on their way in: how long their senders are waited for, and how much of what is unfinished is held.
//!
//! What is unfinished is a document, a line, or a message of which a part has come. Its first bytes are always taken,
//! so that a usual upload finds room whatever others do; what is beyond them comes out of one budget of the process. A
//! sender is waited for within limits: the time in which the service itself is busy, and reads nothing, is not its.

use std::{sync::Arc, time::Duration};

use axum::body::{Body, BodyDataStream, Bytes};
use futures_util::{StreamExt, stream};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::{Instant, timeout},
};
use tonic::Status;

use crate::refusal::Refusal;

/// The time for which the sender of a document or of a message is waited for until it is complete, and the longest
/// silence of
/// one that sends lines.
pub const PATIENCE: Duration = Duration::from_secs(20);
/// A sender of lines that is slower than that for long is not waited for, bytes per second.
const SLOWEST_BYTES_PER_S: f64 = 256.0;
/// The room for all that is unfinished, beyond what is always taken.
const BUDGET_BYTES: usize = 32 << 20;
/// The part of a document, a line or a message that is always taken.
const TAKEN_BYTES: usize = 16 << 10;
/// The flag and the length before every gRPC message.
const PREFIX_BYTES: usize = 5;

/// The room that unfinished bodies share. Clones share it.
#[derive(Clone)]
pub struct Budget(Arc<Semaphore>);

impl Default for Budget {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(BUDGET_BYTES)))
    }
}

/// The room that one thing takes; given back when it is dropped.
pub struct Room(OwnedSemaphorePermit);

impl Budget {
    /// Room for one thing, none of it taken yet.
    pub fn room(&self) -> Room {
        Room(self.0.clone().try_acquire_many_owned(0).expect("it is never closed"))
    }
}

impl Room {
    /// Takes room for `bytes` in all, or gives back what is beyond them.
    pub fn hold(&mut self, bytes: usize) -> Result<(), Refusal> {
        let (wanted, held) = (bytes.saturating_sub(TAKEN_BYTES), self.0.num_permits());
        if wanted < held {
            drop(self.0.split(held - wanted));
        } else if wanted > held {
            let more = u32::try_from(wanted - held).ok();
            let more = more.and_then(|more| self.0.semaphore().clone().try_acquire_many_owned(more).ok());
            self.0.merge(more.ok_or_else(full)?);
        }
        Ok(())
    }
}

fn full() -> Refusal {
    Refusal::Unavailable("too many large bodies and answers are under way".to_owned())
}

/// The parts of a body as they come.
pub struct Intake {
    body: BodyDataStream,
    room: Room,
    patience: Duration,
    waited: Duration,
}

impl Intake {
    /// The parts of `body`, for which there is room in `budget`.
    pub fn new(body: Body, budget: &Budget) -> Self {
        Self { body: body.into_data_stream(), room: budget.room(), patience: PATIENCE, waited: Duration::ZERO }
    }

    /// The next part of a document; `None` at its end.
    pub async fn next(&mut self) -> Result<Option<Bytes>, Refusal> {
        self.within(self.patience.saturating_sub(self.waited)).await
    }

    /// The next part of a body of lines of which so much has come; `None` at its end.
    pub async fn next_of_lines(&mut self, received: usize) -> Result<Option<Bytes>, Refusal> {
        let patience = self.patience + Duration::from_secs_f64(received as f64 / SLOWEST_BYTES_PER_S);
        self.within(patience.saturating_sub(self.waited).min(self.patience)).await
    }

    async fn within(&mut self, left: Duration) -> Result<Option<Bytes>, Refusal> {
        let begun = Instant::now();
        let part = timeout(left, self.body.next()).await.map_err(|_| Refusal::Interrupted)?;
        self.waited += begun.elapsed();
        part.transpose().map_err(|_| Refusal::Interrupted)
    }

    #[cfg(test)]
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { patience, ..self }
    }

    /// Says how much of what has come is held, because it is not finished.
    pub fn hold(&mut self, bytes: usize) -> Result<(), Refusal> {
        self.room.hold(bytes)
    }
}

/// The body of a gRPC call, within the same limits: a message that has begun has to come to its end. Between messages
/// a stream may be silent as long as it likes.
pub fn messages(body: Body, budget: &Budget) -> Body {
    let messages = Messages { intake: Intake::new(body, budget), cut: Cut::default() };
    let parts = stream::unfold(Some(messages), |messages| async move {
        let mut messages = messages?;
        match messages.next().await {
            Ok(part) => Some((Ok(part?), Some(messages))),
            Err(refusal) => Some((Err(Status::from(refusal)), None)),
        }
    });
    // tonic asks once more after the end.
    Body::from_stream(parts.fuse())
}

struct Messages {
    intake: Intake,
    cut: Cut,
}

impl Messages {
    async fn next(&mut self) -> Result<Option<Bytes>, Refusal> {
        let between = self.cut.unfinished() == 0;
        let part = match between {
            true => self.intake.within(Duration::MAX).await?,
            false => self.intake.next().await?,
        };
        let ended = part.as_ref().is_some_and(|part| self.cut.advance(part));
        if between || ended {
            self.intake.waited = Duration::ZERO;
        }
        self.intake.hold(self.cut.unfinished())?;
        Ok(part)
    }
}

/// The place in a message where a gRPC body is.
#[derive(Default)]
struct Cut {
    prefix: Vec<u8>,
    /// Bytes of the message that have come, and that are still to come, once its prefix is known.
    message: Option<(usize, usize)>,
}

impl Cut {
    /// What has come of a message that is not complete.
    fn unfinished(&self) -> usize {
        self.prefix.len() + self.message.map_or(0, |(come, _)| come)
    }

    /// Goes on by a part of the body; tells whether a message ended in it.
    fn advance(&mut self, mut part: &[u8]) -> bool {
        let mut ended = false;
        while !part.is_empty() {
            let (come, left) = match self.message {
                Some(message) => message,
                None => {
                    let (prefix, rest) = part.split_at(part.len().min(PREFIX_BYTES - self.prefix.len()));
                    self.prefix.extend_from_slice(prefix);
                    part = rest;
                    let Ok([_, length @ ..]) = <[u8; PREFIX_BYTES]>::try_from(&self.prefix[..]) else { break };
                    (0, u32::from_be_bytes(length) as usize)
                }
            };
            let taken = left.min(part.len());
            part = &part[taken..];
            self.message = Some((come + taken, left - taken));
            if taken == left {
                *self = Self::default();
                ended = true;
            }
        }
        ended
    }
}

#[cfg(test)]
mod tests {
    use axum::body::to_bytes;
    use proptest::{collection::vec, prelude::*};

    use super::*;

    /// A message of gRPC of so many bytes.
    fn message(bytes: usize) -> Vec<u8> {
        let mut message = vec![0];
        message.extend_from_slice(&(bytes as u32).to_be_bytes());
        message.resize(PREFIX_BYTES + bytes, b'x');
        message
    }

    fn body(parts: Vec<Vec<u8>>) -> Body {
        Body::from_stream(stream::iter(parts.into_iter().map(Ok::<_, std::io::Error>)).chain(stream::pending()))
    }

    proptest! {
        #[test]
        fn what_is_unfinished_of_a_message_does_not_depend_on_the_parts(
            lengths in vec(0..40_usize, 0..6),
            left_out in 1..8_usize,
            size in 1..30_usize,
        ) {
            let whole: Vec<u8> = lengths.iter().flat_map(|&length| message(length)).collect();
            let mut cut = Cut::default();
            let ended = whole.chunks(size).filter(|part| cut.advance(part)).count();
            prop_assert_eq!(cut.unfinished(), 0);
            prop_assert!(ended <= lengths.len() && (ended > 0) != lengths.is_empty());
            let short = message(20);
            let short = &short[..short.len() - left_out];
            for part in short.chunks(size) {
                prop_assert!(!cut.advance(part));
            }
            prop_assert_eq!(cut.unfinished(), short.len());
        }
    }

    #[tokio::test]
    async fn a_document_that_drips_is_waited_for_in_all() {
        let drips = stream::unfold((), |()| async {
            tokio::time::sleep(Duration::from_millis(1)).await;
            Some((Ok::<_, std::io::Error>(" "), ()))
        });
        let mut intake = Intake::new(Body::from_stream(drips), &Budget::default());
        intake.patience = Duration::from_millis(20);
        let mut parts = 0;
        let end = loop {
            match intake.next().await {
                Ok(_) => parts += 1,
                Err(refusal) => break refusal,
            }
        };
        assert_eq!(end, Refusal::Interrupted);
        assert!((1..=20).contains(&parts), "{parts}");
    }

    #[tokio::test]
    async fn a_stream_is_silent_between_messages_only() {
        let wait = async |parts| {
            let intake = Intake { patience: Duration::from_millis(1), ..Intake::new(body(parts), &Budget::default()) };
            let mut messages = Messages { intake, cut: Cut::default() };
            messages.next().await.unwrap();
            timeout(Duration::from_millis(100), messages.next()).await
        };
        assert_eq!(wait(vec![message(9)[..7].to_vec()]).await, Ok(Err(Refusal::Interrupted)));
        assert!(wait(vec![message(9)]).await.is_err(), "it is still waited for");
    }

    #[tokio::test]
    async fn unfinished_bodies_share_one_room_and_small_ones_need_none() {
        let budget = Budget::default();
        let large = || messages(body(vec![message(1 << 20)[..256 << 10].to_vec()]), &budget).into_data_stream();
        let mut held = Vec::new();
        let end = loop {
            let mut body = large();
            match body.next().await.unwrap() {
                Ok(_) => held.push(body),
                Err(error) => break error,
            }
        };
        assert_eq!(held.len(), BUDGET_BYTES / ((256 << 10) - TAKEN_BYTES));
        let end = Status::from_error(Box::new(end));
        assert_eq!(end.code(), tonic::Code::Unavailable, "{end}");
        let mut small = messages(body(vec![message(TAKEN_BYTES)[..TAKEN_BYTES].to_vec()]), &budget).into_data_stream();
        small.next().await.unwrap().unwrap();
        drop(held);
        large().next().await.unwrap().unwrap();
        assert_eq!(budget.0.available_permits(), BUDGET_BYTES, "all room is given back");
    }

    #[tokio::test]
    async fn a_body_that_has_ended_goes_on_ending() {
        let broken = stream::iter([Ok("\0"), Err(std::io::Error::other("reset"))]);
        for body in [Body::empty(), Body::from_stream(broken)] {
            let mut passed = messages(body, &Budget::default()).into_data_stream();
            while passed.next().await.is_some() {}
            assert!(passed.next().await.is_none());
        }
    }

    #[tokio::test]
    async fn whole_bodies_pass_unchanged() {
        let whole: Vec<u8> = [0, 7, 300_000].into_iter().flat_map(message).collect();
        let parts = whole.chunks(1000).map(|part| Ok::<_, std::io::Error>(part.to_vec())).collect::<Vec<_>>();
        let passed = messages(Body::from_stream(stream::iter(parts)), &Budget::default());
        assert_eq!(to_bytes(passed, usize::MAX).await.unwrap(), whole);
    }
}
