//! A simulated fleet: hidden truth per actuator, physics-based uploads over REST.
