//! The Artificial Multi-Bee Colony search (section 5 of the paper): one colony a pixel, whose food sources are planes.

mod aggregation;
mod colony;
mod cost;
mod employed;
mod fitted;
mod food;
mod onlooker;
mod random;
mod schedule;
mod scout;
mod smoothness;
#[cfg(test)]
mod tests;

pub use colony::Offer;
pub use cost::CostRules;
pub use food::{FoodSource, MIN_FACING};
pub use onlooker::OnlookerRules;
pub use random::{Random, stream};
pub use schedule::{Assessment, Search, assess, band_rows};
