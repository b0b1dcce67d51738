//! Bundles, masks and priors, and by which of them lives are judged.

use domain::{Act, BundleSummary, ContentHash, OperatorId};

use super::{Backend, Store, backend};
use crate::{BundleRecord, ModelUse, PriorRecord, PublishedMask, StoreError};

impl Store {
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

    /// The bundle by which new lives are judged, if there is one.
    pub async fn active_bundle(&self) -> Result<Option<BundleSummary>, StoreError> {
        backend!(self, active_bundle())
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
}
