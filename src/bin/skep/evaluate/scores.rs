//! Numbers that several evaluations share.

use serde::Serialize;

/// How much is right at a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rates {
    /// The relative error or distance below which something is right.
    pub threshold: f64,
    /// The right ones in all of the truth.
    pub recall: f64,
    /// The right ones in all that was estimated.
    pub precision: f64,
    /// The harmonic mean of both.
    pub f: f64,
}

impl Rates {
    pub fn new(threshold: f64, recall: f64, precision: f64) -> Rates {
        let sum = recall + precision;
        let f = if sum > 0.0 { 2.0 * recall * precision / sum } else { 0.0 };
        Rates { threshold, recall, precision, f }
    }

    /// The header of the table that [`Rates::row`] makes rows for.
    pub fn header(threshold: &str) -> String {
        format!("{threshold:>12}  recall  precision       F")
    }

    pub fn row(&self) -> String {
        let Rates { threshold, recall, precision, f } = *self;
        format!("{threshold:>12}  {recall:.4}     {precision:.4}  {f:.4}")
    }
}

/// The share `part / whole`; 0 of nothing.
pub fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// The median, of an even number of values the mean of the middle two; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let is_even = values.len().is_multiple_of(2);
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = if is_even { below.iter().copied().max_by(f64::total_cmp) } else { None };
    Some(lower.map_or(*upper, |lower| (lower + *upper) / 2.0))
}

/// Counts of positive numbers in bins of equal width in their logarithm.
#[derive(Debug, Clone)]
pub struct Histogram {
    /// Power of ten of the lower end.
    start: f64,
    per_decade: f64,
    /// The first also has what lies below, the last what lies above.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Bins from `10^start` over so many decades.
    pub fn new(start: i32, decades: usize, per_decade: usize) -> Histogram {
        let counts = vec![0; decades * per_decade];
        Histogram { start: start.into(), per_decade: per_decade as f64, counts }
    }

    pub fn add(&mut self, value: f64) {
        let place = (value.max(f64::MIN_POSITIVE).log10() - self.start) * self.per_decade;
        // Negative numbers become 0.
        let bin = (place.floor() as usize).min(self.counts.len() - 1);
        self.counts[bin] += 1;
    }

    pub fn merge(&mut self, other: &Histogram) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(own, other)| *own += other);
    }

    /// The upper end of a bin.
    pub fn end(&self, bin: usize) -> f64 {
        10f64.powf(self.start + (bin + 1) as f64 / self.per_decade)
    }

    /// The lower end of the first bin.
    pub fn first(&self) -> f64 {
        10f64.powf(self.start)
    }

    /// The ends of the bins with the number of values below each, without the last bin, which has no end.
    pub fn cumulative(&self) -> Vec<(f64, u64)> {
        let mut sum = 0;
        let counts = self.counts[..self.counts.len() - 1].iter().enumerate();
        counts.map(|(bin, count)| (self.end(bin), (sum += count, sum).1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_even_and_odd_numbers() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }

    #[test]
    fn rates_of_nothing_are_zero() {
        assert_eq!(Rates::new(0.1, 0.0, 0.0).f, 0.0);
        assert_eq!(Rates::new(0.1, 1.0, 0.5).f, 2.0 / 3.0);
        assert_eq!(share(1, 0), 0.0);
    }

    #[test]
    fn a_histogram_counts_what_lies_below_and_above_in_its_end_bins() {
        let mut histogram = Histogram::new(-2, 2, 1);
        [0.0, 0.001, 0.05, 0.5, 7.0].into_iter().for_each(|value| histogram.add(value));
        assert_eq!(histogram.counts, [3, 2]);
        assert_eq!(histogram.cumulative(), [(0.1, 3)]);
    }
}
