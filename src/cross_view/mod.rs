//! Operations across views: the consistency check and the propagation of planes (section 5.6 of the paper),
//! and averaging.

mod averaging;
mod confidence;
mod consistency;
mod propagation;
mod residual;
mod tolerance;

pub(crate) use averaging::average;
pub(crate) use confidence::confidence;
pub(crate) use consistency::ConsistencyCheck;
pub(crate) use propagation::{CandidateCollector, Donor, Target};
pub(crate) use tolerance::{DepthTolerance, widening};
