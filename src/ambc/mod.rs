//! The Artificial Multi-Bee Colony search (section 5 of the paper): one colony a pixel, whose food sources
//! are planes.
//!
//! A search visits the pixels of one checkerboard color after the other. In each iteration employed bees
//! perturb the food sources of a colony, onlooker bees bring planes of neighboring colonies, and scout bees
//! replace food sources that do not improve. The cost of a plane is matched over the pixel's view set
//! ([`matching`](crate::matching)).

mod aggregation;
mod colony;
mod confidence;
mod cost;
mod counts;
mod employed;
mod food_source;
mod initial_colony;
mod input;
mod local_plane;
mod onlooker;
mod random;
mod rules;
mod scout;
mod search;
mod smoothness_term;
#[cfg(test)]
mod tests;

pub(crate) use colony::Candidate;
pub(crate) use confidence::{Confidence, ConfidenceTask};
pub use counts::Counts;
pub(crate) use input::Search;
pub(crate) use random::{Random, stream};
pub(crate) use rules::{CostRules, SearchRules};
pub(crate) use search::SearchResult;
