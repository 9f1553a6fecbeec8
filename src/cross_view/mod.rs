//! What the views tell each other: the consistency check, propagation of planes, and averaging (section 5.6 of the
//! paper and beyond).

pub mod averaging;
pub mod consistency;
pub mod propagation;
