//! Operations across views: the consistency check and the propagation of planes (section 5.6 of the paper),
//! and averaging.

mod averaging;
mod consistency;
mod propagation;

pub use averaging::average;
pub use consistency::{ConsistencyCheck, ConsistencyRules};
pub use propagation::{Donor, Target, candidates};
