//! Kinds of problems: the stable names by which programs tell refusals apart.
//!
//! A name never changes and is never given to another kind. Each has a page at its URI, which says what it means and
//! what to do.

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident, $name:literal, $meaning:literal, $remedy:literal;)+) => {
        /// A kind of problem.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $($(#[$doc])* $kind,)+
        }

        impl Kind {
            /// All kinds.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// The URI reference of the kind: the `type` of a problem.
            pub const fn uri(self) -> &'static str {
                match self {
                    $(Self::$kind => concat!("/problems/", $name),)+
                }
            }

            /// The meaning of the kind.
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$kind => $meaning,)+
                }
            }

            /// The remedy.
            pub const fn remedy(self) -> &'static str {
                match self {
                    $(Self::$kind => $remedy,)+
                }
            }
        }
    };
}

kinds! {
    /// The body is not JSON.
    Malformed, "malformed",
        "The body is not JSON. NaN, Infinity and numbers beyond the double range are not, nor is what is nested too deeply.",
        "Mend what writes the body: errors names the place where reading stopped. Sent again as it is, it will be refused again.";
    /// The body is JSON, but not acceptable.
    Invalid, "invalid",
        "The body is JSON, but a field is missing, unknown, of another type or outside its range.",
        "Mend the fields that errors names by their JSON pointers; each is told with the value that was sent and with what is accepted.";
    /// Parameters are not acceptable.
    Parameters, "parameters",
        "A parameter of the path or of the query is unknown, given twice, or has a value that is not accepted.",
        "Mend the parameters that errors names; /openapi.json tells what each accepts.";
    /// It is not known who calls.
    Unauthenticated, "unauthenticated",
        "It is not known who calls: no token or certificate was shown, or one that cannot be read, is unknown, was revoked or has expired.",
        "Send the header Authorization with a token that is in force, or connect with a certificate that is. The administrator of your operator makes tokens.";
    /// The caller may not.
    Forbidden, "forbidden",
        "It is known who calls, and that this caller may not: by its scope, or because an aircraft names another tail, or because a page of another site made a browser call.",
        "Call with a token whose scope permits it; /openapi.json names the scopes of each operation.";
    /// The service is not called so.
    Misdirected, "misdirected",
        "The request was meant for another host: the service does not answer to the name by which it was called.",
        "Call it by a name that it was given (--host); without tokens it answers to the names of its own machine only.";
    /// There is no such thing.
    NotFound, "not-found",
        "There is no such path, or what the path names is not known to your operator.",
        "Compare the spelling with what was uploaded or listed; what belongs to another operator is not told apart from what does not exist.";
    /// The method is not offered.
    MethodNotAllowed, "method-not-allowed",
        "The path exists, but not with this method.",
        "Use one of the methods that the header Allow names.";
    /// The upload_id is taken by other content.
    Conflict, "conflict",
        "An upload of this upload_id was stored before with other content. Nothing was changed.",
        "Give other content another upload_id. If the first was wrong, void it; its name stays taken.";
    /// It contradicts what is stored.
    Contradiction, "contradiction",
        "The request contradicts what is stored or the state that it is in. Nothing was changed.",
        "Read what is stored: the detail names it. Send what agrees with it, or correct it first.";
    /// The bytes are no frame.
    FrameMalformed, "frame-malformed",
        "The bytes are no frame: cut, longer than their layout, or no base32.",
        "Send the frame as the aircraft sent it: its bytes, or one line of base32 in capitals without padding. What was lost on the way has to come down again.";
    /// The frame is of another layout.
    FrameLayout, "frame-layout",
        "The first byte of the frame names a layout that is not read here.",
        "Bring the service up to date: layouts are added and never taken away. Keep the frame until then.";
    /// No key in force wrote the frame.
    FrameNotAuthentic, "frame-not-authentic",
        "No key of your operator wrote the frame: its key is not known here, or it was changed on its way.",
        "Have the frame sent down again. If all frames of an aircraft are refused, it writes by a key that was never made here: actuary frame key list.";
    /// The key of the frame was revoked.
    FrameKeyRevoked, "frame-key-revoked",
        "The key that wrote the frame was revoked. No frame by it is taken, whenever it was measured.",
        "Give the aircraft a new key. What it measured meanwhile can be sent as JSON by who vouches for it.";
    /// The body is too large.
    TooLarge, "too-large",
        "The body, or a line of it, has more bytes than are read.",
        "Send less at once: one JSON document or line has at most 256 KiB, a body of many lines at most 16 MiB.";
    /// The body is of another type.
    UnsupportedMediaType, "unsupported-media-type",
        "The body is of a type, or of a content encoding, that is not read here.",
        "Send one of the types that the detail names, without content encoding.";
    /// The body did not arrive.
    Interrupted, "interrupted",
        "The body ended early or took too long to arrive. Nothing of it was stored, but lines that were answered before.",
        "Send it again. Uploads and events that were stored already are told apart by their names.";
    /// Not now.
    Unavailable, "unavailable",
        "The service cannot do it now: a queue is full, the database is away, no model is active, or the service is stopping.",
        "Come back after the seconds that the header Retry-After names, later each time.";
    /// No room is left.
    StorageFull, "storage-full",
        "There is no room left to store anything: a full disk, of the file or of the Postgres server. What is known can be read.",
        "Senders come back as Retry-After says. Whoever runs the service makes room; files that end in -wal must stay.";
    /// The database takes no writes.
    ReadOnly, "read-only",
        "The database takes no writes: a Postgres server that became a standby, or a file that must not be written. What is known can be read.",
        "Senders come back as Retry-After says. Whoever runs the service leads it to the primary, or gives it back the right to write.";
    /// Someone else holds the database.
    Locked, "locked",
        "Another process has held the database for too long.",
        "Senders come back as Retry-After says. Whoever runs the service ends what holds it: a shell with an open transaction.";
    /// The storage fails.
    IoError, "io-error",
        "The storage of the database fails: a device, a quota, or a limit on the size of files. What is known can be read.",
        "Senders come back as Retry-After says. Whoever runs the service looks into the log of the kernel, and runs actuary verify afterwards.";
    /// The file was moved, deleted or replaced.
    Displaced, "database-displaced",
        "The file of the database, or its log, was moved, deleted or replaced under the service.",
        "Senders come back as Retry-After says. Whoever runs the service puts both back, or stops it and starts it on the file that is to be served.";
    /// A fault of the server.
    Internal, "internal",
        "A fault of the server. It was logged; nothing that was acknowledged is lost.",
        "Try again once. If it stays, tell whoever runs the service when it was: the log knows more.";
}

impl Kind {
    /// The kind of a name: the last part of its URI.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.uri().trim_start_matches("/problems/")
    }
}

#[cfg(test)]
mod tests {
    use super::Kind;

    #[test]
    fn no_two_kinds_have_one_name() {
        for (i, kind) in Kind::ALL.iter().enumerate() {
            assert_eq!(Kind::ALL.iter().position(|other| other.name() == kind.name()), Some(i), "{kind:?}");
            assert_eq!(Kind::named(kind.name()), Some(*kind));
        }
        assert_eq!(Kind::named("/problems/conflict"), None);
    }
}
