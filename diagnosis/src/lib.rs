//! From coefficients to the fault vector: MLP, Levenberg-Marquardt, uncertainty, plausibility.
