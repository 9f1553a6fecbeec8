//! Images as the solver sees them: grey bytes, their pyramid and the packed layout the kernels sample.

mod noise;
mod packed;
mod picture;
mod pyramid;

pub use noise::Noise;
pub use packed::PackedImage;
pub use picture::Picture;
pub use pyramid::ScaledView;
