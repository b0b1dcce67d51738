//! A body cut into lines, whatever the parts in which it comes, and however it ends.

use axum::body::Bytes;
use bytes::BytesMut;

use crate::{
    intake::Intake,
    limits::{MAX_BODY_BYTES, MAX_UPLOAD_BYTES},
    refusal::Refusal,
};

/// One line, or why it could not be read.
pub struct Line {
    /// Its number, from 1.
    pub number: u64,
    /// Its text without blanks around it.
    pub text: Result<Bytes, Refusal>,
}

/// Cuts a body into lines without ever holding more than one line and one part.
pub struct Lines {
    intake: Intake,
    held: Held,
    /// Whether the rest of a line that is too long is being skipped.
    skipping: bool,
    received: usize,
    number: u64,
    ended: bool,
}

/// The part of a body that has come and was not taken yet.
#[derive(Default)]
struct Held {
    bytes: BytesMut,
    /// So many of the bytes are known to hold no newline.
    searched: usize,
}

impl Held {
    /// The bytes up to a newline, and the newline.
    fn take_line(&mut self) -> Option<Bytes> {
        match self.bytes[self.searched..].iter().position(|&byte| byte == b'\n') {
            Some(at) => {
                let line = self.bytes.split_to(self.searched + at + 1);
                self.searched = 0;
                Some(line.freeze())
            }
            None => {
                self.searched = self.bytes.len();
                None
            }
        }
    }

    /// All bytes, if there are any.
    fn take_rest(&mut self) -> Option<Bytes> {
        let rest = std::mem::take(self).bytes;
        (!rest.is_empty()).then(|| rest.freeze())
    }
}

impl Lines {
    /// The lines of a body.
    pub fn new(intake: Intake) -> Self {
        Self { intake, held: Held::default(), skipping: false, received: 0, number: 0, ended: false }
    }

    /// The next line that is not blank; `None` at the end.
    pub async fn next(&mut self) -> Option<Line> {
        loop {
            if let Some(line) = self.cut() {
                return Some(line);
            }
            if self.ended {
                return None;
            }
            if let Err(refusal) = self.receive().await {
                // A line of which a part has come is that which is refused.
                self.ended = true;
                self.held = Held::default();
                return Some(self.refused(refusal));
            }
        }
    }

    /// A line out of what is held, as long as there is one.
    fn cut(&mut self) -> Option<Line> {
        loop {
            let text = match self.held.take_line() {
                None if self.ended => self.held.take_rest(),
                line => line,
            };
            let Some(text) = text else { return self.begin_skipping() };
            if std::mem::take(&mut self.skipping) {
                continue;
            }
            let text = text.slice_ref(text.trim_ascii());
            if text.len() > MAX_UPLOAD_BYTES {
                return Some(self.refused(too_long()));
            }
            self.number += 1;
            if !text.is_empty() {
                return Some(Line { number: self.number, text: Ok(text) });
            }
        }
    }

    /// Drops what has come of a line that is too long; reports it when it is first noticed.
    fn begin_skipping(&mut self) -> Option<Line> {
        if self.held.bytes.len() <= MAX_UPLOAD_BYTES && !self.skipping {
            return None;
        }
        self.held = Held::default();
        let noticed_before = std::mem::replace(&mut self.skipping, true);
        (!noticed_before).then(|| self.refused(too_long()))
    }

    fn refused(&mut self, refusal: Refusal) -> Line {
        self.number += 1;
        Line { number: self.number, text: Err(refusal) }
    }

    async fn receive(&mut self) -> Result<(), Refusal> {
        self.intake.hold(self.held.bytes.len())?;
        match self.intake.next_of_lines(self.received).await? {
            None => self.ended = true,
            Some(part) => {
                self.received += part.len();
                if self.received > MAX_BODY_BYTES {
                    return Err(Refusal::TooLarge { limit_bytes: MAX_BODY_BYTES });
                }
                self.held.bytes.extend_from_slice(&part);
            }
        }
        Ok(())
    }
}

fn too_long() -> Refusal {
    Refusal::TooLarge { limit_bytes: MAX_UPLOAD_BYTES }
}

#[cfg(test)]
mod tests {
    use std::{io, time::Duration};

    use axum::body::Body;
    use futures_util::{StreamExt, stream};
    use proptest::{collection::vec, prelude::*};

    use super::*;
    use crate::intake::Budget;

    type Read = Vec<(u64, Result<Vec<u8>, u16>)>;

    /// The end of a body.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Ending {
        Whole,
        CutOff,
        Silent,
    }

    /// Number and text of each line of a body that comes in `parts`, or the status of the refusal.
    async fn read(parts: Vec<Vec<u8>>, end: Ending) -> Read {
        let last = match end {
            Ending::Whole => stream::empty().boxed(),
            Ending::CutOff => stream::iter([Err(io::Error::other("reset"))]).boxed(),
            Ending::Silent => stream::pending().boxed(),
        };
        let parts = stream::iter(parts).map(|part| Ok(Bytes::from(part))).chain(last);
        let budget = Budget::default();
        let mut reader =
            Lines::new(Intake::new(Body::from_stream(parts), &budget).with_patience(Duration::from_millis(1)));
        let mut lines = Vec::new();
        while let Some(line) = reader.next().await {
            let text = line.text.map(|text| text.to_vec()).map_err(|refusal| refusal.status().as_u16());
            lines.push((line.number, text));
        }
        lines
    }

    async fn lines(parts: Vec<Vec<u8>>) -> Read {
        read(parts, Ending::Whole).await
    }

    /// What `read` has to tell: lines are complete when their newline has come, or the whole body.
    fn expected(body: &[u8], end: Ending) -> Read {
        let mut pieces: Vec<&[u8]> = body.split(|&byte| byte == b'\n').collect();
        let unfinished = pieces.pop().filter(|_| end != Ending::Whole);
        let whole = body.rsplit(|&byte| byte == b'\n').next().filter(|_| end == Ending::Whole);
        let lines = pieces.into_iter().chain(whole).enumerate();
        let judge = |line: &[u8]| match line.trim_ascii() {
            long if long.len() > MAX_UPLOAD_BYTES => Err(413),
            text => Ok(text.to_vec()),
        };
        let mut read: Read = lines.map(|(i, line)| (i as u64 + 1, judge(line))).collect();
        let number = read.len() as u64 + 1;
        read.retain(|(_, text)| text.as_ref().map_or(true, |text| !text.is_empty()));
        match unfinished {
            None => {}
            // That it is too long was noticed before the end.
            Some(long) if long.len() > MAX_UPLOAD_BYTES => read.extend([(number, Err(413)), (number + 1, Err(408))]),
            Some(_) => read.push((number, Err(408))),
        }
        read
    }

    fn part() -> impl Strategy<Value = Vec<u8>> {
        prop_oneof![
            4 => vec(prop_oneof![Just(b'\n'), Just(b' '), Just(b'{'), any::<u8>()], 0..12),
            1 => (1..400_000_usize).prop_map(|length| vec![b'x'; length]),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn no_order_of_parts_and_ends_loses_or_invents_a_line(
            parts in vec(part(), 0..8),
            end in prop_oneof![Just(Ending::Whole), Just(Ending::CutOff), Just(Ending::Silent)],
        ) {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
            let told = runtime.block_on(read(parts.clone(), end));
            prop_assert_eq!(told, expected(&parts.concat(), end));
        }
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
