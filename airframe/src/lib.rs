//! Physics of the wing: loads from strain (lifting line, beam, fibre Bragg gratings).
