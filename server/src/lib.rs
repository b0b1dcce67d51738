//! REST, gRPC and pages on one port.
