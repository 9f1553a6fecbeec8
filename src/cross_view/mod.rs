//! What the estimates of several views say about each other: the consistency check, propagation of planes to other views
//! (section 5.6 of the paper), and averaging across views.

mod averaging;
mod consistency;
mod propagation;

pub use averaging::average;
pub use consistency::{ConsistencyCheck, ConsistencyRules};
pub use propagation::{Donor, Target, candidates};
