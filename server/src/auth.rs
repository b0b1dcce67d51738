//! Authentication and authorisation: found out before anything else of a request is looked at.
//!
//! Every route is registered with the permission that it asks for ([`Guarded`]), every gRPC method has its
//! permission in [`guard::GRPC`]. The guard before each of them finds out who calls ([`Gate`]) and refuses those
//! who may not, and an aircraft that names another tail. A handler has its [`Caller`] from the guard alone, and
//! reaches data through its caller's operator alone: what belongs to another one is looked for in vain, like
//! what does not exist.

mod caller;
mod certificate;
mod credential;
mod freshness;
mod gate;
mod guard;
mod guarded;
mod host;
mod origin;

pub use caller::{Caller, admitted};
pub use certificate::{ClientCertificate, Peer};
pub use credential::Credential;
pub use gate::Gate;
pub use guard::{Callable, GRPC, door, grpc, is_probe};
pub use guarded::{Endpoint, Guarded};
pub use host::{HostName, NoHostName};
pub use origin::{NoOrigin, Origin};
