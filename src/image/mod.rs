//! Images: photographs, their pyramid, the packed layout that the kernels sample, noise and blur.

mod blur;
mod mask;
mod noise;
mod packed_image;
mod photograph;
mod picture;
mod pyramid;

pub(crate) use blur::blurred;
pub use mask::Mask;
pub(crate) use noise::{Noise, deviation};
pub use packed_image::PackedImage;
pub use photograph::{Photograph, PictureSource};
pub use picture::Picture;
pub(crate) use pyramid::halve_mask;
