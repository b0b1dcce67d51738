//! The handle that everyone else holds.

use std::{ops::RangeInclusive, path::Path, sync::Arc, time::Duration};

use domain::{
    Act, Actor, AuditRecord, BundleSummary, Component, ContentHash, Estimate, EventId, MaintenanceEvent, OperatorId,
    PartNumber, Position, SensorConfiguration, SetAsideReason, State, TailNumber, Timestamp, TokenId, Upload, UploadId,
    Warning,
};

use crate::{
    Addition, AuditChain, BundleRecord, Checkpoint, Completion, ComponentRecord, Digest, EventReceipt, EventRecord,
    FinishedLife, HistoryOf, Installation, Installed, InstalledTail, IssuedLife, Lease, Lesson, LifeCursor, LifeInputs,
    LifeResults, ModelUse, Options, PriorRecord, PublishedMask, Receipt, Released, Retrial, Revocation, StoreError,
    TailConfiguration, TokenRecord, UploadRecord, UploadStateKind, Verification, Voiding, WorkFigures, postgres,
    sqlite,
};

/// A database of the service. Clones share it.
#[derive(Clone)]
pub struct Store(Backend);

/// The databases that can stand behind a store.
#[derive(Clone)]
enum Backend {
    Sqlite(Arc<sqlite::Engine>),
    Postgres(Arc<postgres::Engine>),
}

/// Calls a method of the same name on the database.
macro_rules! backend {
    ($store:expr, $method:ident ( $($argument:expr),* )) => {
        match &$store.0 {
            Backend::Sqlite(sqlite) => sqlite.$method($($argument),*).await,
            Backend::Postgres(postgres) => postgres.$method($($argument),*).await,
        }
    };
}

/// Tells whether a URL names a Postgres database.
fn is_postgres(url: &str) -> bool {
    url.starts_with("postgres:") || url.starts_with("postgresql:")
}

impl Store {
    /// Opens the database at `sqlite:PATH` (or `sqlite://PATH`) or `postgres://ROLE@HOST/DATABASE`, and starts
    /// what writes to it. An SQLite file is created and migrated when needed, and locked for this process. A
    /// Postgres database must have been migrated ([`Store::migrate`]), and its role must be one that row-level
    /// security binds: [`StoreError::NotMigrated`], [`StoreError::UnsuitableRole`].
    pub async fn open(url: &str, options: Options) -> Result<Self, StoreError> {
        if is_postgres(url) {
            let postgres = postgres::Engine::open(url, options).await?;
            return Ok(Self(Backend::Postgres(Arc::new(postgres))));
        }
        let sqlite = sqlite::Engine::open(url, options).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Opens an existing database for reading, beside the process that owns it or without one; nothing is
    /// migrated or written, and writes are refused with [`StoreError::ReadOnly`].
    pub async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        if is_postgres(url) {
            let postgres = postgres::Engine::open_read_only(url).await?;
            return Ok(Self(Backend::Postgres(Arc::new(postgres))));
        }
        let sqlite = sqlite::Engine::open_read_only(url).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Tells whether a Postgres database holds a schema, whichever role asks and whatever its version.
    pub async fn has_schema(url: &str) -> Result<bool, StoreError> {
        postgres::has_schema(url).await
    }

    /// Creates the schema of a database or brings it up to date. Of a Postgres database, whoever the URL logs
    /// in as owns the tables; `service_role`, which must be another one that is not above row-level security, is
    /// made a member of `actuary_service`, the role that may serve. SQLite knows no roles.
    pub async fn migrate(url: &str, service_role: Option<&str>) -> Result<(), StoreError> {
        if is_postgres(url) {
            return postgres::migrate(url, service_role).await;
        }
        sqlite::Engine::open(url, Options::default()).await?.close().await;
        Ok(())
    }

    /// Opens an existing database for administrative acts, also while a service has it open.
    ///
    /// A Postgres database is open to all anyway. That is safe on SQLite, too, where one process owns a file: it takes
    /// the writers of all processes one after the other, each waits for the other's transaction, and what is committed
    /// is as durable as the owner's. The lock on the file is there for what an owner knows beyond the database: leases
    /// end when it opens the file, and its workers are woken inside of it. Administrative acts rest on neither. They
    /// are short, so that nobody waits for long; uploads and results do not come this way. The schema must be that of
    /// this build: nothing is migrated.
    pub async fn open_beside(url: &str) -> Result<Self, StoreError> {
        if is_postgres(url) {
            return Self::open(url, Options::default()).await;
        }
        let sqlite = sqlite::Engine::open_beside(url).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Writes what still waits, then closes the database; an SQLite file is unlocked. Later calls fail with
    /// [`StoreError::Closed`].
    pub async fn close(&self) {
        backend!(self, close())
    }

    /// Checks that the database answers and its writer runs.
    pub async fn ping(&self) -> Result<(), StoreError> {
        backend!(self, ping())
    }

    /// Keeps a new token, whose secret nobody but its owner knows.
    pub async fn create_token(&self, token: &TokenRecord, actor: Actor) -> Result<(), StoreError> {
        backend!(self, create_token(token, actor))
    }

    /// The tokens of an operator, revoked and expired ones too, the oldest first.
    pub async fn tokens(&self, operator: &OperatorId) -> Result<Vec<TokenRecord>, StoreError> {
        backend!(self, tokens(operator))
    }

    /// The token of this id, whoever's it is: only for finding out who calls.
    pub async fn token(&self, id: &TokenId) -> Result<Option<TokenRecord>, StoreError> {
        backend!(self, token(id))
    }

    /// Tells whether any token was ever created: from then on, callers must show one.
    pub async fn has_tokens(&self) -> Result<bool, StoreError> {
        backend!(self, has_tokens())
    }

    /// Revokes a token of this operator for ever; `None` for an unknown one. Idempotent.
    pub async fn revoke_token(
        &self,
        operator: &OperatorId,
        id: &TokenId,
        act: Act,
    ) -> Result<Option<Revocation>, StoreError> {
        backend!(self, revoke_token(operator, id, act))
    }

    /// The records of an operator's audit log, or of the installation's, from the first one after place
    /// `after` (0 for all), in their order.
    pub async fn audit(
        &self,
        operator: Option<&OperatorId>,
        after: u64,
        limit: u32,
    ) -> Result<Vec<AuditRecord>, StoreError> {
        backend!(self, audit(operator, after, limit))
    }

    /// Follows every chain of the audit log to its end, or to where it is broken.
    pub async fn verify_audit(&self) -> Result<Vec<AuditChain>, StoreError> {
        backend!(self, verify_audit())
    }

    /// Keeps a bundle and publishes its masks for ever. Idempotent.
    pub async fn register_bundle(&self, summary: &BundleSummary, body: &[u8], act: Act) -> Result<(), StoreError> {
        backend!(self, register_bundle(summary, body, act))
    }

    /// Lets the lives that begin from now on be judged by this bundle.
    pub async fn activate_bundle(&self, hash: &ContentHash, act: Act) -> Result<(), StoreError> {
        backend!(self, activate_bundle(hash, act))
    }

    /// Lets a bundle with its newest prior judge all lives, of all operators: announces a generation of each
    /// life that is judged otherwise, and returns of how many. Workers make them; what answers now answers
    /// until then. It may be called again after an interruption.
    pub async fn judge_all_lives_by(&self, model: &ContentHash) -> Result<u64, StoreError> {
        backend!(self, judge_all_lives_by(model))
    }

    /// Counts the lives that each bundle judges, over all operators; bundles that judge none are left out.
    pub async fn model_use(&self) -> Result<Vec<ModelUse>, StoreError> {
        backend!(self, model_use())
    }

    /// All bundles, the oldest first.
    pub async fn bundles(&self) -> Result<Vec<BundleRecord>, StoreError> {
        backend!(self, bundles())
    }

    /// The bytes of a bundle.
    pub async fn bundle_body(&self, hash: &ContentHash) -> Result<Option<Vec<u8>>, StoreError> {
        backend!(self, bundle_body(hash))
    }

    /// A published mask.
    pub async fn mask(&self, id: &ContentHash) -> Result<Option<PublishedMask>, StoreError> {
        backend!(self, mask(id))
    }

    /// Keeps a learned prior. The lives of its operator and part number that begin from now on under its
    /// bundle are judged by it, until a newer one is learned. Idempotent; when more lives have taught the
    /// same again, its record says so.
    pub async fn add_prior(&self, operator: &OperatorId, prior: &PriorRecord, body: &[u8]) -> Result<(), StoreError> {
        backend!(self, add_prior(operator, prior, body))
    }

    /// All learned priors of an operator, by part number and then by time.
    pub async fn priors(&self, operator: &OperatorId) -> Result<Vec<PriorRecord>, StoreError> {
        backend!(self, priors(operator))
    }

    /// The bytes of a learned prior of this operator; a bundle's own prior is in the bundle.
    pub async fn prior_body(&self, operator: &OperatorId, hash: &ContentHash) -> Result<Option<Vec<u8>>, StoreError> {
        backend!(self, prior_body(operator, hash))
    }

    /// Lessons that can be learned now, by operator and part number: each part number of an operator of which at
    /// least [`Lesson::MIN_LIVES`] lives judged by the active bundle have ended, and at least
    /// [`Lesson::GROWTH`] times as many as its newest prior was learned from. A lesson stays until such a
    /// prior is added; while it is claimed, it is not listed.
    pub async fn lessons(&self) -> Result<Vec<Lesson>, StoreError> {
        backend!(self, lessons())
    }

    /// Claims a lesson, so that no other worker takes it meanwhile; tells whether it could still be claimed. A
    /// claim ends with the prior, or after `duration`, which grows like that of a lease with the attempts that
    /// taught nothing ([`Lease::duration`]): a lesson that fails is tried again less and less often.
    pub async fn claim_lesson(&self, lesson: &Lesson, duration: Duration) -> Result<bool, StoreError> {
        backend!(self, claim_lesson(lesson, duration))
    }

    /// Hands back a lesson that was claimed and not taken to its end, as if nobody had tried it.
    pub async fn release_lesson(&self, lesson: &Lesson) -> Result<(), StoreError> {
        backend!(self, release_lesson(lesson))
    }

    /// The finished lives of a part number that are judged by a bundle, with their histories, by serial
    /// number and life.
    pub async fn finished_lives(
        &self,
        operator: &OperatorId,
        part_number: &PartNumber,
        model: &ContentHash,
    ) -> Result<Vec<FinishedLife>, StoreError> {
        backend!(self, finished_lives(operator, part_number, model))
    }

    /// The finished lives of an operator that failed last, the newest failure first; of each the first
    /// prognosis with a forecast that was issued in every stretch of `every_fh` hours before the failure, by
    /// whatever generation answered then. Stretches begin at multiples of `every_fh`, which is positive.
    pub async fn issued_on_finished_lives(
        &self,
        operator: &OperatorId,
        every_fh: f64,
        limit: u32,
    ) -> Result<Vec<IssuedLife>, StoreError> {
        backend!(self, issued_on_finished_lives(operator, every_fh, limit))
    }

    /// Stores a maintenance event; returns once it is durable. An event of an unknown component enrols it.
    ///
    /// Installs and removals say where a component is, whatever uploads say. An overhaul begins a life: an
    /// upload or event belongs to the life whose number is that of the overhauls strictly before it, in the
    /// order of (flight_hours, time). The first finding `failed` of a life, in the order of (flight_hours,
    /// occurred_at, event_id), ends it. What an event changes of the lives is found anew by a worker.
    pub async fn record_event(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
        now: Timestamp,
    ) -> Result<EventReceipt, StoreError> {
        backend!(self, record_event(operator, event, now))
    }

    /// Takes an event back for ever: it and its name stay, but it counts no longer. `None` for an unknown
    /// one. Idempotent.
    pub async fn void_event(
        &self,
        operator: &OperatorId,
        id: &EventId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        backend!(self, void_event(operator, id, act))
    }

    /// Components of an operator that lost their places to others, and that nobody removed: each where it was last.
    pub async fn displaced(&self, operator: &OperatorId) -> Result<Vec<Installed>, StoreError> {
        backend!(self, displaced(operator))
    }

    /// Warns of what a stored event contradicts of what is known now, and what follows.
    pub async fn event_warnings(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
    ) -> Result<Vec<Warning>, StoreError> {
        backend!(self, event_warnings(operator, event))
    }

    /// Known names that differ in case only from those of a component and its position.
    pub async fn names_alike(
        &self,
        component: &Component,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Vec<Warning>, StoreError> {
        backend!(self, names_alike(component, tail, position))
    }

    /// An event, voided or not.
    pub async fn event(&self, operator: &OperatorId, id: &EventId) -> Result<Option<EventRecord>, StoreError> {
        backend!(self, event(operator, id))
    }

    /// The events of a component, voided ones too, in the order of (flight_hours, occurred_at, event_id).
    pub async fn events(&self, component: &Component) -> Result<Vec<EventRecord>, StoreError> {
        backend!(self, events(component))
    }

    /// Stores an upload; returns once it is durable. [`StoreError::Overloaded`] when too many wait.
    ///
    /// The first upload of a component enrols it and pins its life to the active bundle and to the newest
    /// prior that its operator has learned for it, or else to the bundle's own.
    pub async fn accept(
        &self,
        operator: &OperatorId,
        upload: Upload,
        received_at: Timestamp,
    ) -> Result<Receipt, StoreError> {
        backend!(self, accept(operator, upload, received_at))
    }

    /// An upload and what became of it.
    pub async fn upload(&self, operator: &OperatorId, id: &UploadId) -> Result<Option<UploadRecord>, StoreError> {
        backend!(self, upload(operator, id))
    }

    /// Uploads of an operator in one state, by component and then by (recorded_at, upload_id), from the
    /// first one after `after` (the last one of the page before; an unknown name gives an empty page).
    pub async fn uploads(
        &self,
        operator: &OperatorId,
        state: UploadStateKind,
        after: Option<&UploadId>,
        limit: u32,
    ) -> Result<Vec<UploadRecord>, StoreError> {
        backend!(self, uploads(operator, state, after, limit))
    }

    /// Takes an upload back for ever: it and its name stay, nothing rests on it any longer. `None` for
    /// an unknown one. Idempotent.
    pub async fn void_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        backend!(self, void_upload(operator, id, act))
    }

    /// Lets a worker try again an upload that is set aside. `None` for an unknown one.
    pub async fn retry_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Retrial>, StoreError> {
        backend!(self, retry_upload(operator, id, act))
    }

    /// Puts a sensor configuration in force on a tail from a time on, which may be past, until the time
    /// of the tail's next one. Uploads of that period wait to be estimated again.
    pub async fn add_sensor_configuration(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        effective_from: Timestamp,
        configuration: &SensorConfiguration,
        act: Act,
    ) -> Result<Addition, StoreError> {
        backend!(self, add_sensor_configuration(operator, tail, effective_from, configuration, act))
    }

    /// The sensor configurations of a tail, by the time from which they are in force.
    pub async fn sensor_configurations(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Vec<TailConfiguration>, StoreError> {
        backend!(self, sensor_configurations(operator, tail))
    }

    /// Leases the component that has waited longest, if one waits and is not leased or backing off: for `duration`,
    /// and for longer after attempts that ended without a result ([`Lease::duration`]).
    pub async fn lease(&self, duration: Duration) -> Result<Option<Lease>, StoreError> {
        backend!(self, lease(duration))
    }

    /// Returns when there is something to lease. It looks into the queue after it has begun to
    /// listen, so that work accepted between an empty [`Store::lease`] and this call is not missed.
    pub async fn work_available(&self) {
        backend!(self, work_available())
    }

    /// Inputs from which the results of each life of the leased component that has something to process are computed
    /// from, the oldest life first.
    pub async fn life_inputs(&self, lease: &Lease) -> Result<Vec<LifeInputs>, StoreError> {
        backend!(self, life_inputs(lease))
    }

    /// Tells whether a life of the leased component has inputs that were stored since the lease.
    pub async fn newer_input_waits(&self, lease: &Lease, overhaul_index: u32) -> Result<bool, StoreError> {
        backend!(self, newer_input_waits(lease, overhaul_index))
    }

    /// The checkpoint of the latest block among `wanted` that is stored with the digest wanted, of one
    /// generation of a life. A damaged one is as if it were not there.
    pub async fn checkpoint(
        &self,
        component: &Component,
        overhaul_index: u32,
        generation: u32,
        wanted: &[(u64, ContentHash)],
    ) -> Result<Option<Checkpoint>, StoreError> {
        backend!(self, checkpoint(component, overhaul_index, generation, wanted))
    }

    /// Writes results and ends the lease. Inputs stored since the lease leave the component waiting.
    pub async fn complete(&self, lease: &Lease, results: Vec<LifeResults>) -> Result<Completion, StoreError> {
        backend!(self, complete(lease, results))
    }

    /// Sends uploads of a tail that are set aside, and were recorded at a time, back to be estimated again; a bounded
    /// number of them.
    pub async fn retry_uploads(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        recorded_at: RangeInclusive<Timestamp>,
        reason: Option<SetAsideReason>,
        act: Act,
    ) -> Result<Released, StoreError> {
        backend!(self, retry_uploads(operator, tail, recorded_at, reason, act))
    }

    /// Ends the lease without a result; the component waits for `retry_after`. Without effect when
    /// the lease is no longer held.
    pub async fn abandon(&self, lease: &Lease, retry_after: Duration) -> Result<(), StoreError> {
        backend!(self, abandon(lease, retry_after))
    }

    /// Number of uploads that wait to be processed, over all operators.
    pub async fn pending(&self) -> Result<u64, StoreError> {
        backend!(self, pending())
    }

    /// Figures of the work that waits.
    pub async fn work_figures(&self) -> Result<WorkFigures, StoreError> {
        backend!(self, work_figures())
    }

    /// The digest of all estimates and states.
    pub async fn digest(&self) -> Result<Digest, StoreError> {
        backend!(self, digest())
    }

    /// Tells whether anything waits for a worker: an upload, or a generation that has still to be made.
    pub async fn work_waits(&self) -> Result<bool, StoreError> {
        backend!(self, work_waits())
    }

    /// Throws away what follows from uploads and events, for workers to find it anew: of each operator where
    /// its components were installed (which is found anew at once), and of the next components behind
    /// `after` all results of the generations that answer and will answer. Returns the last of these
    /// components, to go on behind it, or `None` when there is none. Prognoses that were issued stay, and so do
    /// generations that answered before.
    pub async fn forget_derived(
        &self,
        after: Option<&Component>,
        now: Timestamp,
    ) -> Result<Option<Component>, StoreError> {
        backend!(self, forget_derived(after, now))
    }

    /// Takes an SQLite file, a copy, for all there is: also one that was not closed by whoever wrote it, which
    /// [`Store::open`] refuses without its log. Whether it is such a one.
    pub async fn adopt(url: &str) -> Result<bool, StoreError> {
        sqlite::adopt(url).await
    }

    /// Writes a copy of an SQLite database as of one moment to a new file; whoever writes to the database is
    /// not held up.
    pub async fn copy_to(&self, path: &Path) -> Result<(), StoreError> {
        backend!(self, copy_to(path))
    }

    /// The faults in the structure of an SQLite file, in its own words; nothing if it is sound.
    pub async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        backend!(self, check_structure())
    }

    /// Compares every row that carries a checksum with it, over all operators. Damaged rows are part of the
    /// answer; an error is what keeps the rows from being read at all.
    pub async fn verify(&self) -> Result<Verification, StoreError> {
        backend!(self, verify())
    }

    /// Compares only those tables from which all others can be made anew: bundles, masks, priors, uploads,
    /// events and sensor configurations.
    pub async fn verify_sources(&self) -> Result<Verification, StoreError> {
        backend!(self, verify_sources())
    }

    /// Tails of an operator in alphabetical order, from the first one after `after`.
    pub async fn tails(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<TailNumber>, StoreError> {
        backend!(self, tails(operator, after, limit))
    }

    /// Tells whether anything was ever received of a tail, though everything on it may have moved on.
    pub async fn knows_tail(&self, operator: &OperatorId, tail: &TailNumber) -> Result<bool, StoreError> {
        backend!(self, knows_tail(operator, tail))
    }

    /// The components installed on a tail, by position; empty for an unknown tail.
    pub async fn installed(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Vec<Installed>, StoreError> {
        backend!(self, installed(operator, tail))
    }

    /// The component installed at one position of a tail.
    pub async fn installed_at(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Option<Installed>, StoreError> {
        backend!(self, installed_at(operator, tail, position))
    }

    /// Tails of an operator in alphabetical order, from the first one after `after`, each with what is
    /// installed on it (nothing, where everything has moved on).
    pub async fn installed_fleet(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<InstalledTail>, StoreError> {
        backend!(self, installed_fleet(operator, after, limit))
    }

    /// Tells whether any upload or event of a component was ever stored.
    pub async fn knows_component(&self, component: &Component) -> Result<bool, StoreError> {
        backend!(self, knows_component(component))
    }

    /// Tells whether any upload, install or removal at a position was ever stored.
    pub async fn knows_place(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<bool, StoreError> {
        backend!(self, knows_place(operator, tail, position))
    }

    /// A component with its lives and installations; `None` for an unknown one.
    pub async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        backend!(self, component(component))
    }

    /// Installations of a component, in the order of time.
    pub async fn installations(&self, component: &Component) -> Result<Vec<Installation>, StoreError> {
        backend!(self, installations(component))
    }

    /// Estimates that count in a life of a component (the newest one unless it is named) with `from_fh <= flight_hours
    /// < to_fh`, in the order of the life, from the first one after `after`.
    pub async fn estimates(
        &self,
        component: &Component,
        of: impl Into<HistoryOf>,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<&LifeCursor>,
        limit: u32,
    ) -> Result<Vec<Estimate>, StoreError> {
        backend!(self, estimates(component, of.into(), from_fh, to_fh, after, limit))
    }

    /// States of a life of a component (the newest one unless it is named) with `from_fh <= as_of.flight_hours <
    /// to_fh`, by block, from the first one after block `after`.
    pub async fn states(
        &self,
        component: &Component,
        of: impl Into<HistoryOf>,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<u64>,
        limit: u32,
    ) -> Result<Vec<State>, StoreError> {
        backend!(self, states(component, of.into(), from_fh, to_fh, after, limit))
    }
}
