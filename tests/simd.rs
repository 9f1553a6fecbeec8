//! The operations of every back-end against the scalar ones: the results must have the same bits.

use proptest::prelude::*;
use skep::simd::{LANES, SAMPLE_SCALE, Scalar, Simd, SimdLevel, Taps, Task, dispatch};

type Lanes = [f32; LANES];

/// The levels that this CPU supports.
fn levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|level| level.is_available())
}

/// An operation, generic over the back-end.
trait Operation: Copy {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes>;
}

struct Vectorized<O>(O);

impl<O: Operation> Task for Vectorized<O> {
    type Output = (SimdLevel, Vec<Lanes>);

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        (S::LEVEL, simd.vectorize(|| self.0.run(simd)))
    }
}

/// The bits of all lanes; every NaN has the same, since its payload is unspecified.
fn bits(lanes: &[Lanes]) -> Vec<u32> {
    let bits = |lane: &f32| if lane.is_nan() { f32::NAN.to_bits() } else { lane.to_bits() };
    lanes.iter().flatten().map(bits).collect()
}

fn check(operation: impl Operation) -> Result<(), TestCaseError> {
    let expected = operation.run(Scalar);
    for level in levels() {
        let (ran, lanes) = dispatch(level, Vectorized(operation));
        prop_assert_eq!(ran, level);
        prop_assert_eq!(
            bits(&lanes),
            bits(&expected),
            "{} gives {:?} and scalar {:?}",
            level.name(),
            lanes,
            expected
        );
    }
    Ok(())
}

#[derive(Clone, Copy)]
struct Arithmetic(Lanes, Lanes, Lanes);

impl Operation for Arithmetic {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        let (a, b, c) = (simd.load(&self.0), simd.load(&self.1), simd.load(&self.2));
        let results = [
            a,
            simd.splat(self.0[3]),
            simd.add(a, b),
            simd.sub(a, b),
            simd.mul(a, b),
            simd.div(a, b),
            simd.max(a, b),
            simd.min(a, b),
            simd.mul_add(a, b, c),
            simd.splat(simd.reduce_sum(a)),
            simd.sqrt(a),
            simd.splat(f32::from(simd.simd_ge(a, b))),
            simd.reduce_sum_8x8(&[a, b, c, a, b, c, a, b]),
            simd.select(0b1010_0110, a, b),
        ];
        results.map(|lanes| simd.store(lanes)).to_vec()
    }
}

#[derive(Clone, Copy)]
struct Trunc(Lanes);

impl Operation for Trunc {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.store(simd.trunc(simd.load(&self.0)))]
    }
}

#[derive(Clone, Copy)]
struct ReduceMax(Lanes);

impl Operation for ReduceMax {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![[simd.reduce_max(simd.load(&self.0)); LANES]]
    }
}

#[derive(Clone, Copy)]
struct LinearIndices<'a>(&'a [i32; LANES], Lanes, Lanes);

impl Operation for LinearIndices<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        let indices = simd.linear_indices(self.0, simd.load(&self.1), simd.load(&self.2));
        // As bits: not every u32 is exact in f32.
        vec![indices.map(f32::from_bits)]
    }
}

#[derive(Clone, Copy)]
struct Bilinear<'a>(&'a Taps, Lanes, Lanes);

impl Operation for Bilinear<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.store(simd.sample_bilinear(simd.sample_positions(
            self.0,
            simd.load(&self.1),
            simd.load(&self.2),
        )))]
    }
}

#[derive(Clone, Copy)]
struct Gather<'a>(&'a Taps, &'a [u32; LANES]);

impl Operation for Gather<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.gather(self.0, self.1).map(f32::from_bits)]
    }
}

/// Any f32; special values are frequent.
fn any_lane() -> impl Strategy<Value = f32> {
    let special = [0.0, -0.0, 1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE, f32::MAX];
    prop_oneof![any::<f32>(), -300.0..300.0f32, prop::sample::select(special.to_vec())]
}

fn any_lanes() -> impl Strategy<Value = Lanes> {
    prop::array::uniform8(any_lane())
}

fn integral_lanes(below: u32) -> impl Strategy<Value = Lanes> {
    prop::array::uniform8((0..below).prop_map(|lane| lane as f32))
}

prop_compose! {
    fn image()(width in 1..20usize, height in 1..20usize)(
        gray in prop::collection::vec(any::<u8>(), width * height),
        width in Just(width),
        height in Just(height),
    ) -> (Vec<u8>, usize, usize) {
        (gray, width, height)
    }
}

#[test]
fn reduce_sum_8x8_keeps_the_order_of_the_vectors() {
    #[derive(Clone, Copy)]
    struct Sums;
    impl Operation for Sums {
        fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
            let vectors = std::array::from_fn(|vector| simd.splat(vector as f32));
            vec![simd.store(simd.reduce_sum_8x8(&vectors))]
        }
    }
    check(Sums).unwrap();
    assert_eq!(Sums.run(Scalar), [[0.0, 8.0, 16.0, 24.0, 32.0, 40.0, 48.0, 56.0]]);
}

proptest! {
    #[test]
    fn arithmetic_gives_the_same_bits(a in any_lanes(), b in any_lanes(), c in any_lanes()) {
        check(Arithmetic(a, b, c))?;
    }

    #[test]
    fn trunc_gives_the_same_bits(lanes in prop::array::uniform8(0.0..16_777_215.0f32)) {
        check(Trunc(lanes))?;
        prop_assert_eq!(Trunc(lanes).run(Scalar), vec![lanes.map(f32::trunc)]);
    }

    #[test]
    fn reduce_max_finds_the_largest_lane_anywhere(lanes in prop::array::uniform8(-1e9..1e9f32)) {
        check(ReduceMax(lanes))?;
        let largest = lanes.into_iter().fold(f32::MIN, f32::max);
        prop_assert_eq!(ReduceMax(lanes).run(Scalar), vec![[largest; LANES]]);
    }

    #[test]
    fn linear_indices_are_computed_with_the_stride_of_each_lane(
        strides in prop::array::uniform8(0..50_000i32),
        x in integral_lanes(50_000),
        y in integral_lanes(40_000),
    ) {
        check(LinearIndices(&strides, x, y))?;
        let expected: [u32; LANES] =
            std::array::from_fn(|lane| y[lane] as u32 * strides[lane] as u32 + x[lane] as u32);
        prop_assert_eq!(Scalar.linear_indices(&strides, x, y), expected);
    }

    #[test]
    fn bilinear_samples_are_weighted_means_of_four_pixels(
        (gray, width, height) in image(),
        x in prop::array::uniform8(prop_oneof![-600.0..5_000.0f32, any_lane()]),
        y in prop::array::uniform8(prop_oneof![-600.0..5_000.0f32, any_lane()]),
    ) {
        let taps = Taps::new(&gray, width, height);
        check(Bilinear(&taps, x, y))?;
        let samples = Bilinear(&taps, x, y).run(Scalar)[0];
        for lane in 0..LANES {
            // The pixel and the weight of the next one.
            let split = |position: f32, size: usize| {
                let steps = f64::from(position).max(0.0).min((size - 1) as f64 * 256.0).floor();
                ((steps / 256.0) as usize, steps % 256.0 / 255.0)
            };
            let ((column, fx), (row, fy)) = (split(x[lane], width), split(y[lane], height));
            let at = |column: usize, row: usize| {
                f64::from(gray[row.min(height - 1) * width + column.min(width - 1)])
            };
            let top = at(column, row) * (1.0 - fx) + at(column + 1, row) * fx;
            let bottom = at(column, row + 1) * (1.0 - fx) + at(column + 1, row + 1) * fx;
            let expected = top * (1.0 - fy) + bottom * fy;
            let sample = f64::from(samples[lane] / SAMPLE_SCALE) + 128.0;
            prop_assert!((sample - expected).abs() < 1e-4, "{} instead of {}", sample, expected);
        }
    }

    #[test]
    fn gather_loads_two_pairs_and_clamps_indices(
        (gray, width, height) in image(),
        indices in prop::array::uniform8(prop_oneof![0..400u32, any::<u32>()]),
    ) {
        let taps = Taps::new(&gray, width, height);
        check(Gather(&taps, &indices))?;
        for (gathered, index) in Scalar.gather(&taps, &indices).into_iter().zip(indices) {
            let index = (index as usize).min(taps.pairs().len() - 2);
            let [first, second] = [taps.pairs()[index], taps.pairs()[index + 1]];
            let expected = [first, second].concat();
            prop_assert_eq!(gathered.to_le_bytes().map(|byte| byte as i8).to_vec(), expected);
        }
    }
}

#[test]
fn max_and_min_return_the_second_operand_for_nan_and_equal_zeros() {
    let (nan, one) = ([f32::NAN; LANES], [1.0; LANES]);
    for (a, b) in [(nan, one), (one, nan)] {
        let results = Arithmetic(a, b, one).run(Scalar);
        assert_eq!(bits(&results[6..8]), bits(&[b, b]));
    }
    // 0 and -0 are equal.
    let results = Arithmetic([0.0; LANES], [-0.0; LANES], one).run(Scalar);
    assert_eq!(bits(&results[6..8]), bits(&[[-0.0; LANES]; 2]));
}

#[test]
fn select_takes_lane_0_from_the_lowest_bit() {
    let (a, b) = ([1.0; LANES], [2.0; LANES]);
    assert_eq!(Scalar.select(0b0000_0101, a, b), [1.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0]);
}

#[test]
fn reduce_sum_adds_in_the_documented_tree() {
    let l = [1e8, 3.0, -1e8, 0.1, 7.0, -2.5, 1.0, 1e-3];
    let tree = ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));
    let in_order = l.iter().fold(0.0f32, |sum, lane| sum + lane);
    assert_ne!(tree, in_order, "the lanes must distinguish the orders");
    assert_eq!(Scalar.reduce_sum(l), tree);
}

#[test]
fn the_best_available_level_is_detected() {
    assert!(levels().take(2).eq([SimdLevel::Scalar, SimdLevel::Baseline]));
    assert!(SimdLevel::detect().is_available());
    // Fails, rather than skips, where AVX2 is there but not used.
    #[cfg(target_arch = "x86_64")]
    {
        let has_v3 = std::is_x86_feature_detected!("avx2")
            && std::is_x86_feature_detected!("bmi1")
            && std::is_x86_feature_detected!("bmi2")
            && std::is_x86_feature_detected!("popcnt");
        assert_eq!(SimdLevel::X86V3.is_available(), has_v3);
        if std::env::var_os("SKEP_SIMD").is_none() {
            let best = if has_v3 { SimdLevel::X86V3 } else { SimdLevel::Baseline };
            assert_eq!(SimdLevel::detect(), best);
        }
    }
}

#[test]
fn unavailable_levels_are_lowered() {
    let (ran, _) = dispatch(SimdLevel::X86V3, Vectorized(Trunc([0.0; LANES])));
    assert_eq!(ran, levels().last().unwrap());
}
