//! Pictures, their packed layout and the pyramid.

use proptest::prelude::*;
use skep::image::{PackedImage, Picture};

prop_compose! {
    fn picture()(width in 1..12u32, height in 1..12u32)(
        gray in prop::collection::vec(any::<u8>(), (width * height) as usize),
        width in Just(width),
        height in Just(height),
    ) -> Picture {
        Picture::from_gray(width, height, gray).unwrap()
    }
}

/// The gray value of a pixel; the last column and row are repeated.
fn gray(picture: &Picture, x: u32, y: u32) -> u8 {
    let (x, y) = (x.min(picture.width() - 1), y.min(picture.height() - 1));
    picture.gray()[(y * picture.width() + x) as usize]
}

proptest! {
    #[test]
    fn neighboring_pairs_hold_the_four_taps_of_a_bilinear_sample(picture in picture()) {
        let packed = PackedImage::new(&picture);
        prop_assert_eq!((packed.width, packed.height), (picture.width() as usize, picture.height() as usize));
        for y in 0..picture.height() {
            for x in 0..picture.width() {
                let index = y as usize * packed.taps.stride() + x as usize;
                let pairs = [packed.taps.pairs()[index], packed.taps.pairs()[index + 1]].concat();
                let pairs: Vec<u8> = pairs.into_iter().map(|tap| (i16::from(tap) + 128) as u8).collect();
                let taps = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dx, dy)| gray(&picture, x + dx, y + dy));
                prop_assert_eq!(pairs, taps);
                prop_assert_eq!(packed.gray(x as usize, y as usize), taps[0]);
            }
        }
    }

    #[test]
    fn halved_pictures_hold_rounded_means_of_four_pixels(picture in picture()) {
        let halved = picture.halved();
        prop_assert_eq!(halved.width(), picture.width().div_ceil(2));
        prop_assert_eq!(halved.height(), picture.height().div_ceil(2));
        for y in 0..halved.height() {
            for x in 0..halved.width() {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let fine = four.iter().map(|(dx, dy)| gray(&picture, 2 * x + dx, 2 * y + dy));
                let sum: f64 = fine.map(f64::from).sum();
                prop_assert_eq!(f64::from(gray(&halved, x, y)), (sum / 4.0).round());
            }
        }
    }
}

#[test]
fn gray_values_are_luma_and_colors_are_kept() {
    let colors = vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [0; 3], [10, 20, 30]];
    let picture = Picture::from_rgb(3, 2, colors.clone()).unwrap();
    assert_eq!(picture.gray(), [76, 150, 29, 255, 0, 18]);
    assert!((0..6).map(|pixel| picture.rgb(pixel)).eq(colors));
    assert_eq!(Picture::from_gray(1, 1, vec![7]).unwrap().rgb(0), [7; 3]);
}

#[test]
fn pictures_with_a_wrong_number_of_values_are_errors() {
    for (width, height, values) in [(2, 2, 3), (2, 2, 5), (0, 3, 0), (3, 0, 0), (u32::MAX, u32::MAX, 1)] {
        let error = Picture::from_gray(width, height, vec![0; values]).unwrap_err().to_string();
        assert!(error.contains(&format!("{values} values for {width} x {height} pixels")), "{error}");
        assert!(Picture::from_rgb(width, height, vec![[0; 3]; values]).is_err());
    }
}
