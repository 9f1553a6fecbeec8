//! Clouds with few points or none: why, and the options that would help.

use crate::report::Totals;
use skep::job::Job;
use skep::{DepthRange, FusionOptions, Options, PixelStatus};

/// Points for each unmasked pixel below which a cloud is thin. A point takes the pixel of every view that
/// agrees: 0.03 to 0.2 are usual, and 0.01 is left of a complete cloud that 100 views see everywhere.
const THIN_CLOUD: f64 = 0.01;
/// Percentage of the pixels above which a status is named as a reason of an empty cloud; the two largest at
/// most. One of the six statuses always has more.
const LARGE_SHARE: f64 = 10.0;

/// `empty` or `thin` for a cloud of few points, of maps with so many pixels. A cloud that was thinned on
/// demand is not thin.
pub fn few_points(points: u64, pixels: u64, options: &FusionOptions) -> Option<&'static str> {
    let is_thinned = options.voxel_size > 0.0 || options.max_points > 0;
    match points {
        0 => Some("empty"),
        points if !is_thinned && (points as f64) < THIN_CLOUD * pixels as f64 => Some("thin"),
        _ => None,
    }
}

/// What a status says about the scene, and the remedy.
pub fn help(status: PixelStatus) -> &'static str {
    match status {
        PixelStatus::Validated => {
            "validated, but confirmed by fewer views than fusion needs: more views of each surface"
        }
        PixelStatus::Masked => "excluded by a mask",
        PixelStatus::NoTexture => "too uniform to be matched: more texture or more light",
        PixelStatus::NoSources => "seen by too few other views: more overlap between photographs",
        PixelStatus::Inconsistent => "other views disagree: check the calibration and that nothing moved",
        PixelStatus::OutOfRange => "at an end of the depth range: widen it with --depth-range MIN MAX",
    }
}

/// A complete run.
pub struct Outcome<'a> {
    pub totals: &'a Totals,
    pub options: &'a Options,
    /// Depths that were searched in the views with maps.
    pub ranges: Vec<DepthRange>,
    /// Views of the scene, also those without maps.
    pub views: usize,
}

impl<'a> Outcome<'a> {
    /// That of a job.
    pub fn of_run(job: &'a Job, totals: &'a Totals) -> Outcome<'a> {
        let ranges = job.references().iter().map(|&view| job.scene().depth_range(view)).collect();
        Outcome { totals, options: job.options(), ranges, views: job.scene().views().len() }
    }

    /// Percentage of the pixels with this status.
    pub fn share(&self, status: PixelStatus) -> f64 {
        self.count(status) as f64 * 100.0 / self.totals.pixels.max(1) as f64
    }

    /// Lines on why the cloud is empty or thin: the number of pixels of each status with the remedy, and the
    /// depth range. Nothing for other clouds.
    pub fn reasons(&self) -> Vec<String> {
        let Some(cloud) = self.few_points() else { return Vec::new() };
        let mut lines = vec![format!("the cloud is {cloud}; the status of the pixels:")];
        for status in PixelStatus::ALL.into_iter().filter(|&status| self.count(status) > 0) {
            let (count, share) = (self.count(status), self.share(status));
            lines.push(format!("  {count} ({share:.1} %) {}: {}", status.name(), help(status)));
        }
        lines.push(format!("{}; --depth-range MIN MAX sets another range", self.searched()));
        lines
    }

    /// One sentence on an empty or thin cloud, with the most frequent statuses of the pixels and the
    /// remedies; nothing for other clouds.
    pub fn warning(&self) -> Option<String> {
        let cloud = self.few_points()?;
        let mut statuses = PixelStatus::ALL;
        statuses.sort_by_key(|&status| std::cmp::Reverse(self.count(status)));
        let large = statuses.into_iter().filter(|&status| self.share(status) > LARGE_SHARE);
        let reasons = large.take(2).map(|status| {
            let (name, share) = (status.name(), self.share(status));
            format!("{share:.1} % of the pixels are {name} ({})", help(status))
        });
        let reasons: Vec<String> = reasons.collect();
        let mut parts = vec![format!("the cloud is {cloud}: {}", reasons.join(", ")), self.searched()];
        parts.extend(self.too_few_views());
        parts.extend(self.too_few_references());
        let confidence = self.options.fusion.min_confidence;
        if confidence > 0.0 {
            parts.push(format!("pixels below fusion.min_confidence={confidence} are left out"));
        }
        Some(parts.join("; "))
    }

    /// What a depth needs to be validated, if the scene has too few views.
    fn too_few_views(&self) -> Option<String> {
        let (others, wanted) = (self.views - 1, self.options.check.min_consistent_views as usize);
        (others < wanted).then(|| {
            format!(
                "{} views cannot confirm a depth in {wanted} other ones: --set \
                 check.min_consistent_views={others}",
                self.views
            )
        })
    }

    /// What a point needs, if the views with maps are too few or many of their pixels are validated.
    fn too_few_references(&self) -> Option<String> {
        let agreeing = self.options.fusion.min_agreeing_views as usize;
        let (references, others) = (self.ranges.len(), self.ranges.len() - 1);
        if others < agreeing && references < self.views {
            return Some(format!(
                "a point needs {agreeing} other views with maps that agree, and {references} of {} views \
                 have maps: name more with --reference, or --set fusion.min_agreeing_views={others}",
                self.views
            ));
        }
        let is_needed = others < agreeing || self.share(PixelStatus::Validated) > LARGE_SHARE;
        (agreeing > 1 && is_needed).then(|| {
            let fewer = others.min(agreeing - 1);
            format!(
                "a point needs {agreeing} views that agree with its pixel: --set \
                 fusion.min_agreeing_views={fewer}"
            )
        })
    }

    /// Whether the cloud is empty or thin, measured by the pixels that are not masked.
    fn few_points(&self) -> Option<&'static str> {
        let pixels = self.totals.pixels - self.count(PixelStatus::Masked);
        few_points(self.totals.points as u64, pixels, &self.options.fusion)
    }

    fn count(&self, status: PixelStatus) -> u64 {
        self.totals.status_counts[status.name()]
    }

    /// The depths that were searched, over all views, with the four significant digits that a message needs.
    fn searched(&self) -> String {
        let rounded = |depth: f64| format!("{depth:.3e}").parse().unwrap_or(depth);
        let near = self.ranges.iter().map(|range| range.near).fold(f64::INFINITY, f64::min);
        let far = self.ranges.iter().map(|range| range.far).fold(0.0, f64::max);
        format!("depths of {} to {} were searched", rounded(near), rounded(far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: DepthRange = DepthRange { near: 1.25, far: 4.0 };
    const FAR: DepthRange = DepthRange { near: 1.5, far: 4.133_94 };

    /// Totals of 1000 pixels with these statuses, in the order of [`PixelStatus::ALL`].
    fn totals(points: usize, counts: [u64; 6]) -> Totals {
        let status_counts = PixelStatus::ALL.iter().map(|status| status.name()).zip(counts).collect();
        Totals { pixels: 1000, points, status_counts, ..Totals::default() }
    }

    /// A run in which so many of the views have maps.
    fn outcome<'a>(totals: &'a Totals, options: &'a Options, references: usize, views: usize) -> Outcome<'a> {
        let ranges = [NEAR, FAR].into_iter().cycle().take(references).collect();
        Outcome { totals, options, ranges, views }
    }

    #[test]
    fn an_empty_cloud_is_explained_by_the_reasons_that_occurred() {
        let options = Options::default();
        let lines = outcome(&totals(0, [0, 0, 300, 0, 700, 0]), &options, 2, 2).reasons();
        assert_eq!(lines.len(), 4, "{lines:?}");
        assert_eq!(lines[0], "the cloud is empty; the status of the pixels:");
        assert!(lines[1].starts_with("  300 (30.0 %) no_texture: "), "{}", lines[1]);
        assert!(lines[2].starts_with("  700 (70.0 %) inconsistent: "), "{}", lines[2]);
        let searched = "depths of 1.25 to 4.134 were searched; --depth-range ";
        assert!(lines[3].starts_with(searched), "{}", lines[3]);
    }

    #[test]
    fn a_thin_cloud_is_explained_as_well_and_measured_by_the_unmasked_pixels() {
        let options = Options::default();
        let reasons = |points, counts| outcome(&totals(points, counts), &options, 2, 2).reasons();
        let thin = reasons(9, [400, 0, 0, 600, 0, 0]);
        assert_eq!(thin[0], "the cloud is thin; the status of the pixels:");
        assert!(thin[2].starts_with("  600 (60.0 %) no_sources: seen by too few other views"), "{}", thin[2]);
        assert_eq!(reasons(10, [400, 0, 0, 600, 0, 0]), Vec::<String>::new());
        assert_eq!(reasons(9, [100, 900, 0, 0, 0, 0]), Vec::<String>::new());
    }

    #[test]
    fn a_cloud_that_was_thinned_on_demand_is_not_thin() {
        let mut options = Options::default();
        options.fusion.max_points = 3;
        assert_eq!(few_points(3, 1000, &options.fusion), None);
        assert_eq!(few_points(0, 1000, &options.fusion), Some("empty"));
        options.fusion.max_points = 0;
        assert_eq!(few_points(3, 1000, &options.fusion), Some("thin"));
        options.fusion.voxel_size = 0.1;
        assert_eq!(few_points(3, 1000, &options.fusion), None);
    }

    #[test]
    fn the_warning_of_an_empty_cloud_names_the_largest_reasons_and_the_remedy() {
        let options = Options::default();
        let counts = totals(0, [0, 0, 250, 90, 660, 0]);
        let warning = outcome(&counts, &options, 4, 4).warning().unwrap();
        let start = "the cloud is empty: 66.0 % of the pixels are inconsistent (other views disagree: ";
        assert!(warning.starts_with(start), "{warning}");
        assert!(warning.contains(", 25.0 % of the pixels are no_texture (too uniform "), "{warning}");
        assert!(!warning.contains("no_sources"), "{warning}");
        assert!(warning.ends_with("; depths of 1.25 to 4.134 were searched"), "{warning}");

        let counts = totals(0, [0, 0, 0, 1000, 0, 0]);
        let two_views = outcome(&counts, &options, 2, 2).warning().unwrap();
        assert!(two_views.contains("100.0 % of the pixels are no_sources"), "{two_views}");
        assert!(two_views.contains("--set check.min_consistent_views=1"), "{two_views}");
        assert!(two_views.ends_with("--set fusion.min_agreeing_views=1"), "{two_views}");
    }

    #[test]
    fn a_thin_cloud_of_validated_pixels_is_a_warning_with_the_option_of_the_fusion() {
        let mut options = Options::default();
        options.fusion.min_confidence = 0.9;
        let counts = totals(5, [900, 0, 100, 0, 0, 0]);
        let warning = outcome(&counts, &options, 5, 5).warning().unwrap();
        assert!(warning.starts_with("the cloud is thin: 90.0 % of the pixels are validated"), "{warning}");
        assert!(warning.contains("--set fusion.min_agreeing_views=2"), "{warning}");
        assert!(warning.ends_with("pixels below fusion.min_confidence=0.9 are left out"), "{warning}");
        let complete = totals(10, [900, 0, 100, 0, 0, 0]);
        assert_eq!(outcome(&complete, &options, 2, 2).warning(), None);
    }

    #[test]
    fn the_warning_of_few_references_names_the_option_that_chooses_them() {
        let options = Options::default();
        let counts = totals(0, [900, 0, 100, 0, 0, 0]);
        let warning = outcome(&counts, &options, 2, 7).warning().unwrap();
        let end = "a point needs 3 other views with maps that agree, and 2 of 7 views have maps: name more \
                   with --reference, or --set fusion.min_agreeing_views=1";
        assert!(warning.ends_with(end), "{warning}");
    }
}
