//! The members that past lives teach, as often as some of them are left out.

use std::borrow::Cow;

use domain::FaultModel;

use crate::{
    boundary::Boundary,
    ended::EndedLife,
    estimator::{Climatology, Estimator, Growth, LevelLives, Similarity},
    growth_laws::LawsWithout,
    held_out::Members,
};

/// Growth by each of some laws, then similarity and climatology.
pub(crate) struct Taught<'a> {
    pub model: &'a FaultModel,
    pub boundary: &'a dyn Boundary,
    pub growth: &'a [LawsWithout<'a>],
}

impl Members for Taught<'_> {
    fn teach(&self, lives: &[&EndedLife]) -> Option<Vec<Box<dyn Estimator + '_>>> {
        let Self { model, boundary, .. } = *self;
        let growth = |laws: &LawsWithout| -> Box<dyn Estimator + '_> {
            Box::new(Growth { model, laws: Cow::Owned(laws.of(lives)), boundary })
        };
        let similar = LevelLives::learn(lives, boundary, &model.nominal).ok()?;
        let climatology = Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending))).ok()?;
        let mut members: Vec<Box<dyn Estimator + '_>> = self.growth.iter().map(growth).collect();
        members.push(Box::new(Similarity { lives: Cow::Owned(similar), model, boundary }));
        members.push(Box::new(climatology));
        Some(members)
    }
}
