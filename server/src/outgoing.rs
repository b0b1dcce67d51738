//! Answers on their way out: in small pieces, so that no more is handed over than a client takes.

use std::{
    pin::Pin,
    task::{Context, Poll, ready},
};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::{Frame, SizeHint};

use crate::connections::Ticket;

/// The largest piece that is handed over at once.
const PIECE_BYTES: usize = 16 << 10;

/// The body of an answer. It comes to its end only when the client has taken it all.
pub struct Outgoing {
    body: Body,
    rest: Bytes,
    begun: bool,
    ticket: Ticket,
}

impl Outgoing {
    /// The body of the answer to a request.
    pub fn new(body: Body, ticket: Ticket) -> Self {
        Self { body, rest: Bytes::new(), begun: false, ticket }
    }
}

impl HttpBody for Outgoing {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let this = self.get_mut();
        // More is asked for: what was handed over before is on its way.
        this.ticket.taken();
        this.begun = true;
        while this.rest.is_empty() {
            match ready!(Pin::new(&mut this.body).poll_frame(cx)).transpose()?.map(Frame::into_data) {
                None => return Poll::Ready(None),
                Some(Err(trailers)) => return Poll::Ready(Some(Ok(trailers))),
                Some(Ok(data)) => this.rest = data,
            }
        }
        this.ticket.handed_over();
        let piece = this.rest.split_to(this.rest.len().min(PIECE_BYTES));
        Poll::Ready(Some(Ok(Frame::data(piece))))
    }

    /// Only a body without anything ends with the head of its answer: gRPC tells refusals so.
    fn is_end_stream(&self) -> bool {
        !self.begun && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (mut hint, rest) = (self.body.size_hint(), self.rest.len() as u64);
        match hint.exact() {
            Some(exact) => hint.set_exact(exact + rest),
            None => hint.set_lower(hint.lower() + rest),
        }
        hint
    }
}
