//! Images as the solver sees them: gray bytes, their pyramid and the packed layout the kernels sample.

mod blur;
mod noise;
mod packed_image;
mod picture;
mod pyramid;

pub(crate) use blur::{blurred, deviation};
pub use noise::Noise;
pub use packed_image::PackedImage;
pub use picture::Picture;
pub(crate) use pyramid::halve_mask;
