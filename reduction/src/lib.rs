//! From maps to coefficients: importance sampling, POD, masks, Gappy POD.
