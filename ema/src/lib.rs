//! Physics of the electromechanical actuator: models, faults, back-EMF map, assessment, wear.
