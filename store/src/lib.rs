//! Persistence: the only SQL of the project.
//!
//! [`Store`] speaks in nouns of `domain`; behind it stands one struct per database, each with its
//! own SQL. What it acknowledges is durable: an upload is answered after the transaction that
//! holds it has reached the disk.
//!
//! Every table carries the operator, and the component where it is about one: operators never join,
//! and a database can be cut along either. Results are keyed by natural keys only. Uploads, events,
//! results, models and priors carry a checksum; a damaged row is an error that names it, never a wrong
//! answer. Checkpoints are a cache: a damaged one is as good as none.

mod audit;
mod check;
mod checkpoint;
mod component;
mod digest;
mod error;
mod finished;
mod frame_key;
mod generation;
mod history;
mod installed;
mod lesson;
mod life;
mod maintenance;
mod model;
mod options;
mod outages;
mod periods;
mod plan;
mod postgres;
mod prior;
mod schema;
mod sensor_configuration;
mod settings;
mod sqlite;
mod store;
mod token;
mod unit;
mod upload;
mod verification;
mod version;
mod work;

pub use audit::{AuditChain, AuditDamage};
pub use check::TailChecks;
pub use checkpoint::Checkpoint;
pub use component::ComponentRecord;
pub use digest::Digest;
pub use error::StoreError;
pub use finished::{FinishedLife, IssuedLife, RemovedLife};
pub use frame_key::FrameKeyRecord;
pub use generation::{GenerationRecord, ModelUse};
pub use history::{HistoryOf, LifeCursor};
pub use installed::{Contradiction, Installation, Installed, InstalledTail, SetAsideUploads};
pub use lesson::Lesson;
pub use life::{LifeBeginning, LifeRecord};
pub use maintenance::{EventReceipt, EventRecord};
pub use model::{BundleRecord, PublishedMask};
pub use options::{Clock, Options};
pub use plan::{Planned, TailPlan};
pub use prior::PriorRecord;
pub use sensor_configuration::{Addition, TailConfiguration};
pub use settings::OperatorSettings;
pub use store::Store;
pub use token::{Revocation, TokenRecord, TokenRefusal, TokenStatus};
pub use unit::{Brief, ListedUnit, Outlook, TailInShort, Unit, UnitsAsked};
pub use upload::{Receipt, Released, Retrial, UploadRecord, UploadState, Voiding};
pub use verification::{DamagedRow, Verification};
pub use version::{Scope, Version};
pub use work::{Completion, Generation, Lease, LifeInputs, LifeResults, Unestimated, WorkFigures};
