//! Pictures, the layout the kernels sample, and the pyramid.

use glam::{DMat3, DVec3};
use proptest::prelude::*;
use skep::camera::Camera;
use skep::image::{PackedImage, Picture, ScaledView};
use skep::{DepthRange, Scene, View};

prop_compose! {
    fn picture()(width in 1..12u32, height in 1..12u32)(
        grey in prop::collection::vec(any::<u8>(), (width * height) as usize),
        width in Just(width),
        height in Just(height),
    ) -> Picture {
        Picture::from_grey(width, height, grey).unwrap()
    }
}

/// The grey value of a pixel; beyond the last column and row they repeat themselves.
fn grey(picture: &Picture, x: u32, y: u32) -> u8 {
    let (x, y) = (x.min(picture.width() - 1), y.min(picture.height() - 1));
    picture.grey()[(y * picture.width() + x) as usize]
}

proptest! {
    #[test]
    fn two_neighbouring_pairs_are_the_four_taps_of_a_bilinear_sample(picture in picture()) {
        let packed = PackedImage::new(&picture);
        prop_assert_eq!((packed.width, packed.height), (picture.width() as usize, picture.height() as usize));
        for y in 0..picture.height() {
            for x in 0..picture.width() {
                let at = y as usize * packed.taps.stride() + x as usize;
                let pairs = [packed.taps.pairs()[at], packed.taps.pairs()[at + 1]].concat();
                let pairs: Vec<u8> = pairs.into_iter().map(|tap| (i16::from(tap) + 128) as u8).collect();
                let taps = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dx, dy)| grey(&picture, x + dx, y + dy));
                prop_assert_eq!(pairs, taps);
                prop_assert_eq!(packed.grey(x as usize, y as usize), taps[0]);
            }
        }
    }

    #[test]
    fn a_halved_picture_holds_the_rounded_means_of_four_pixels(picture in picture()) {
        let halved = picture.halved();
        prop_assert_eq!(halved.width(), picture.width().div_ceil(2));
        prop_assert_eq!(halved.height(), picture.height().div_ceil(2));
        for y in 0..halved.height() {
            for x in 0..halved.width() {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let sum: f64 = four.iter().map(|(dx, dy)| f64::from(grey(&picture, 2 * x + dx, 2 * y + dy))).sum();
                prop_assert_eq!(f64::from(grey(&halved, x, y)), (sum / 4.0).round());
            }
        }
    }
}

#[test]
fn grey_is_the_luma_of_the_colours_which_are_kept() {
    let colours = vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [0; 3], [10, 20, 30]];
    let picture = Picture::from_rgb(3, 2, colours.clone()).unwrap();
    assert_eq!(picture.grey(), [76, 150, 29, 255, 0, 18]);
    assert!((0..6).map(|pixel| picture.rgb(pixel)).eq(colours));
    assert_eq!(Picture::from_grey(1, 1, vec![7]).unwrap().rgb(0), [7; 3]);
}

#[test]
fn a_picture_of_another_size_than_its_values_is_refused() {
    for (width, height, values) in [(2, 2, 3), (2, 2, 5), (0, 3, 0), (3, 0, 0), (u32::MAX, u32::MAX, 1)] {
        let error = Picture::from_grey(width, height, vec![0; values]).unwrap_err().to_string();
        assert!(error.contains(&format!("{values} values for {width} x {height} pixels")), "{error}");
        assert!(Picture::from_rgb(width, height, vec![[0; 3]; values]).is_err());
    }
}

/// Two views of 5 x 3 pixels of which only one pixel is wanted.
fn scene(wanted: usize) -> Scene {
    let camera = Camera {
        width: 5,
        height: 3,
        fx: 8.0,
        fy: 8.0,
        cx: 2.0,
        cy: 1.0,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    };
    let view = |name: &str| View {
        name: name.to_owned(),
        picture: Picture::from_grey(5, 3, (0..15).map(|pixel| pixel * 10).collect()).unwrap(),
        camera,
        mask: Some((0..15).map(|pixel| pixel == wanted).collect()),
        depth_range: Some(DepthRange { near: 1.0, far: 2.0 }),
        sources: None,
    };
    Scene::new(vec![view("a"), view("b")], Vec::new()).unwrap()
}

#[test]
fn a_coarse_pixel_is_wanted_where_any_of_its_fine_ones_is() {
    for wanted in 0..15 {
        let (x, y) = (wanted % 5, wanted / 5);
        for halvings in 0..4u32 {
            let view = ScaledView::of(&scene(wanted), 0, halvings);
            let width = view.camera.width as usize;
            let mask = view.mask.as_ref().unwrap();
            assert_eq!(mask.len(), view.camera.pixels());
            let expected = (y >> halvings) * width + (x >> halvings);
            assert!((0..mask.len()).all(|pixel| mask[pixel] == (pixel == expected)));
        }
    }
}

#[test]
fn image_camera_and_mask_are_halved_together() {
    let scene = scene(0);
    for (halvings, size) in [(0, (5, 3)), (1, (3, 2)), (2, (2, 1)), (3, (1, 1)), (4, (1, 1))] {
        let views = [0, 1].map(|view| ScaledView::of(&scene, view, halvings));
        for view in views {
            assert_eq!((view.camera.width, view.camera.height), size);
            assert_eq!((view.image.width as u32, view.image.height as u32), size);
            assert_eq!(view.range, DepthRange { near: 1.0, far: 2.0 });
        }
    }
    let halved = ScaledView::of(&scene, 1, 1).image;
    assert_eq!(halved.grey(0, 0), 30, "the mean of 0, 10, 50 and 60");
    assert_eq!(halved.grey(2, 1), 140, "the last pixel alone");
}
