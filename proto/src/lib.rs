//! The wire: protobuf and JSON messages, and their fallible conversion to domain nouns.
