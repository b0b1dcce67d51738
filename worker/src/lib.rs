//! The bridge between store and pipeline: lease a component, compute off the runtime, commit.
