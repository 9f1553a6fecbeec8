//! The Artificial Multi-Bee Colony search (section 5 of the paper): one colony a pixel, whose food sources are planes.

mod aggregation;
mod colony;
mod cost;
mod counts;
mod employed;
mod food_source;
mod local_plane;
mod onlooker;
mod random;
mod scout;
mod search;
mod smoothness_term;
#[cfg(test)]
mod tests;

pub use colony::Candidate;
pub use cost::CostRules;
pub use counts::Counts;
pub use food_source::FoodSource;
pub use onlooker::OnlookerRules;
pub use random::{Random, stream};
pub use search::{Assessment, Search, assess, band_rows};
