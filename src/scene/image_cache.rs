//! The packed images of all views and scales, made when they are needed and kept up to a limit of memory.

use crate::error::Result;
use crate::image::{PackedImage, Photograph, Picture};
use crate::memory::Cache;
use rayon::prelude::*;
use std::sync::Arc;

/// Packed images by scale and view. Shared by threads.
#[derive(Debug)]
pub(crate) struct ImageCache {
    photographs: Vec<Photograph>,
    /// The power of two by which each scale is reduced.
    downscales: Vec<u32>,
    /// By scale index and view.
    kept: Cache<(usize, usize), PackedImage>,
}

impl ImageCache {
    /// An empty cache that keeps images of up to `limit` bytes.
    pub(crate) fn new(photographs: Vec<Photograph>, downscales: Vec<u32>, limit: usize) -> ImageCache {
        ImageCache { photographs, downscales, kept: Cache::new(limit) }
    }

    /// An empty cache of the same images with another limit.
    #[cfg(feature = "io")]
    pub(crate) fn limited_to(self, limit: usize) -> ImageCache {
        ImageCache { kept: Cache::new(limit), ..self }
    }

    /// The packed image of a view on a scale.
    ///
    /// # Errors
    /// A photograph that cannot be decoded.
    pub(crate) fn get(&self, scale: usize, view: usize) -> Result<Arc<PackedImage>> {
        if let Some(image) = self.kept.get((scale, view)) {
            return Ok(image);
        }
        // Outside of the lock: other threads decode at the same time, now and then the same image.
        let picture = self.photographs[view].load()?;
        let image = Arc::new(reduced(picture, self.downscales[scale]));
        self.kept.insert((scale, view), image.clone(), image.bytes());
        Ok(image)
    }

    /// Fills the cache in parallel with the images of all views and scales; calls `before` before each.
    ///
    /// # Errors
    /// A photograph that cannot be decoded; what `before` returns.
    pub(crate) fn fill(&self, before: impl Fn() -> Result<()> + Sync) -> Result<()> {
        let all: Vec<_> = (0..self.downscales.len())
            .flat_map(|scale| (0..self.photographs.len()).map(move |view| (scale, view)))
            .collect();
        all.into_par_iter().with_max_len(1).try_for_each(|(scale, view)| {
            before()?;
            self.get(scale, view).map(drop)
        })
    }
}

/// A picture reduced by a power of two, packed.
fn reduced(picture: Picture, downscale: u32) -> PackedImage {
    let mut picture = picture;
    for _ in 0..downscale.trailing_zeros() {
        picture = picture.halved();
    }
    PackedImage::new(&picture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::PictureSource;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A picture of one gray value that counts how often it is decoded.
    #[derive(Debug, Default)]
    struct Counted(AtomicUsize);

    impl PictureSource for Counted {
        fn size(&self) -> (u32, u32) {
            (8, 6)
        }

        fn load(&self) -> Result<Picture> {
            self.0.fetch_add(1, Ordering::Relaxed);
            Picture::from_gray(8, 6, vec![7; 48])
        }
    }

    fn cache(sources: &[Arc<Counted>], limit: usize) -> ImageCache {
        let photograph = |source: &Arc<Counted>| Photograph::Deferred(source.clone());
        ImageCache::new(sources.iter().map(photograph).collect(), vec![2, 1], limit)
    }

    #[test]
    fn images_are_decoded_once_within_the_limit_and_again_beyond_it() {
        let sources = [(); 3].map(|()| Arc::new(Counted::default()));
        let decoded = || sources.each_ref().map(|source| source.0.load(Ordering::Relaxed));
        let unlimited = cache(&sources, usize::MAX);
        unlimited.fill(|| Ok(())).unwrap();
        assert_eq!(unlimited.get(0, 1).unwrap().width, 4);
        assert_eq!(unlimited.get(1, 1).unwrap().width, 8);
        assert_eq!(decoded(), [2, 2, 2]);

        let bytes = unlimited.get(1, 0).unwrap().bytes();
        let limited = cache(&sources, 2 * bytes);
        for view in [0, 1, 0, 2, 0, 1] {
            assert_eq!(limited.get(1, view).unwrap().gray(0, 0), 7);
            assert!(limited.kept.bytes() <= 2 * bytes);
        }
        assert_eq!(decoded(), [3, 4, 3], "view 1 made room for view 2");
    }

    #[test]
    fn an_image_larger_than_the_limit_is_given_but_not_kept() {
        let sources = [Arc::new(Counted::default())];
        let cache = cache(&sources, 0);
        assert_eq!(cache.get(1, 0).unwrap().width, 8);
        assert_eq!(cache.kept.bytes(), 0);
    }
}
