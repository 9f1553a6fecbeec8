//! Operations across views: the consistency check and the propagation of planes (section 5.6 of the paper),
//! and averaging.

mod averaging;
mod consistency;
mod propagation;

pub(crate) use averaging::average;
pub(crate) use consistency::{ConsistencyCheck, ConsistencyRules};
pub(crate) use propagation::{Donor, Target, candidates};
