//! Warnings in plain words, with what to do about them.

use super::geometry::Geometry;
use super::run_files::RunFiles;
use crate::few_points;
use serde::Serialize;
use serde_json::Value;
use skep::PixelStatus;

/// Fraction of a view's pixels below which few are validated.
const FEW_VALIDATED: f64 = 0.2;
/// Fraction of all pixels above which the reason why they are not validated is named.
const LARGE_SHARE: f64 = 0.3;
/// The same for pixels at an end of the depth range: they are a sign of a range that is too narrow.
const LARGE_OUT_OF_RANGE: f64 = 0.03;
/// Angles in degrees below and above which depths are uncertain and surfaces look different.
const SMALL_ANGLE: f64 = 2.0;
const LARGE_ANGLE: f64 = 35.0;
/// Source views below which surfaces are confirmed by few.
const FEW_SOURCES: usize = 3;
/// Median residual in pixels above which poses or lens are suspect.
const LARGE_RESIDUAL: f64 = 1.0;
/// Names of views in a warning, at most; the page has all of them in its table.
const MOST_NAMES: usize = 12;

/// A warning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// What is the matter.
    pub what: String,
    /// What to do.
    pub remedy: String,
    /// The views it is about; none if it is about all.
    pub views: Vec<u32>,
    /// Number of views, where not all are listed.
    pub count: usize,
}

/// The warnings of a run: its own, and what its figures and the geometry of the capture tell.
pub fn advice(files: &RunFiles, geometry: &Geometry) -> Vec<Advice> {
    let mut found: Vec<Advice> = texts(&files.report["warnings"]).map(of_warning).collect();
    found.extend(of_statuses(&files.report["totals"]));
    found.extend(of_views(files));
    found.extend(of_geometry(files, geometry));
    found
}

fn texts(list: &Value) -> impl Iterator<Item = &str> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// A warning of the run, which says itself what is the matter.
fn of_warning(text: &str) -> Advice {
    let remedies = [
        ("made again", "Nothing: the files are whole again. If it happens often, check the disk."),
        ("begins anew", "Nothing, if you changed the scene or the options on purpose."),
        ("the cloud is", "The section on figures per view shows where pixels are lost."),
        (
            "overlaps with no other view",
            "Take photographs between this view and the others, or leave it out.",
        ),
        ("sources", "Take photographs from viewpoints 5 to 20 degrees apart, so that neighbors overlap."),
        ("angle", "Take photographs from viewpoints 5 to 20 degrees apart, so that neighbors overlap."),
        ("depth range", "Set --depth-range MIN MAX if surfaces are missing beyond some distance."),
        ("sparse point", "Set --depth-range MIN MAX, or triangulate points for these poses."),
        ("mask", "Check the folder of the masks: NAME.png for the photograph NAME."),
        ("pose", "Check which way round the poses are meant, and the program that made them."),
    ];
    let remedy = remedies.into_iter().find(|(sign, _)| text.contains(sign)).map_or("", |(_, remedy)| remedy);
    Advice { what: text.to_owned(), remedy: remedy.to_owned(), views: Vec::new(), count: 0 }
}

/// Reasons of many pixels without a validated depth.
fn of_statuses(totals: &Value) -> Vec<Advice> {
    let count = |status: PixelStatus| totals["status_counts"][status.name()].as_f64().unwrap_or_default();
    let pixels: f64 = PixelStatus::ALL.into_iter().map(count).sum::<f64>() - count(PixelStatus::Masked);
    let is_reason = |status: &PixelStatus| {
        let least = if *status == PixelStatus::OutOfRange { LARGE_OUT_OF_RANGE } else { LARGE_SHARE };
        !matches!(status, PixelStatus::Validated | PixelStatus::Masked) && count(*status) > least * pixels
    };
    let advice = |status: PixelStatus| {
        let share = count(status) * 100.0 / pixels;
        let help = few_points::help(status);
        let (meaning, remedy) = help.split_once(": ").unwrap_or((help, ""));
        Advice {
            what: format!("{share:.0} % of the pixels have no validated depth: {meaning}"),
            remedy: capitalized(remedy),
            views: Vec::new(),
            count: 0,
        }
    };
    PixelStatus::ALL.into_iter().filter(is_reason).map(advice).collect()
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string());
    first.map_or_else(String::new, |first| format!("{first}{}.", letters.as_str()))
}

/// Views of which few pixels are validated, or whose poses do not fit.
fn of_views(files: &RunFiles) -> Vec<Advice> {
    let views = (0..files.model.images.len()).filter(|&view| files.is_reference(view));
    let share = |view: usize| {
        let report = files.view_report(view)?;
        let counts = &report["status_counts"];
        let masked = counts["masked"].as_f64()?;
        Some(counts["validated"].as_f64()? / (report["pixels"].as_f64()? - masked).max(1.0))
    };
    let residual = |view: usize| {
        let cycles = files.view_report(view)?["cycles"].as_array()?;
        let last = cycles.last().filter(|last| last["downscale"] == 1)?;
        last["median_residual"].as_f64()
    };
    let empty = views.clone().filter(|&view| share(view).is_some_and(|share| share < FEW_VALIDATED));
    let loose = views.filter(|&view| residual(view).is_some_and(|residual| residual > LARGE_RESIDUAL));
    let percent = FEW_VALIDATED * 100.0;
    [
        listed(
            empty.collect(),
            format!("less than {percent:.0} % of the pixels are validated"),
            "Look at their status below: it names the reason pixel by pixel.",
        ),
        listed(
            loose.collect(),
            format!("depths of neighbors differ by more than {LARGE_RESIDUAL} px in the median"),
            "Check calibration and poses of these views, and that nothing moved between the photographs.",
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Views in bad places.
fn of_geometry(files: &RunFiles, geometry: &Geometry) -> Vec<Advice> {
    let views = (0..files.model.images.len()).filter(|&view| files.is_reference(view));
    let median = |view: usize| {
        let angles = geometry.sorted_angles(view);
        angles.get(angles.len() / 2).copied()
    };
    let few = |view: &usize| geometry.sources[*view].len() < FEW_SOURCES.min(files.model.images.len() - 1);
    let narrow = views.clone().filter(|&view| median(view).is_some_and(|angle| angle < SMALL_ANGLE));
    let wide = views.clone().filter(|&view| median(view).is_some_and(|angle| angle > LARGE_ANGLE));
    let mut found: Vec<Advice> = [
        listed(
            views.clone().filter(few).collect(),
            format!("fewer than {FEW_SOURCES} other views to match with"),
            "More overlap between photographs: two thirds of each with its neighbors.",
        ),
        listed(
            narrow.collect(),
            format!("less than {SMALL_ANGLE} degrees between the rays of neighbors: depths are uncertain"),
            "Move sideways between photographs, 5 to 20 degrees around the surface; turning does not help.",
        ),
        listed(
            wide.collect(),
            format!("more than {LARGE_ANGLE} degrees between the rays of neighbors: surfaces look different"),
            "Take photographs between these viewpoints.",
        ),
    ]
    .into_iter()
    .flatten()
    .collect();
    let parts = geometry.parts.iter().max().map_or(0, |last| last + 1);
    if geometry.has_tracks && parts > 1 {
        found.push(Advice {
            what: format!("the views fall into {parts} parts that share no sparse point"),
            remedy: "Take photographs that connect them, or reconstruct each part by itself.".to_owned(),
            views: Vec::new(),
            count: 0,
        });
    }
    found
}

fn listed(views: Vec<usize>, what: String, remedy: &str) -> Option<Advice> {
    let count = views.len();
    let views: Vec<u32> = views.into_iter().take(MOST_NAMES).map(|view| view as u32).collect();
    let subject = if count == 1 { "1 view".to_owned() } else { format!("{count} views") };
    (count > 0).then(|| Advice {
        what: format!("{subject}: {what}"),
        remedy: remedy.to_owned(),
        views,
        count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn reasons_of_many_pixels_come_with_a_remedy() {
        let totals = json!({"status_counts": {
            "validated": 500, "masked": 1000, "no_texture": 310, "no_sources": 0, "inconsistent": 140,
            "out_of_range": 50,
        }});
        let found = of_statuses(&totals);
        assert_eq!(found.len(), 2, "{found:?}");
        assert_eq!(found[0].what, "31 % of the pixels have no validated depth: too uniform to be matched");
        assert_eq!(found[0].remedy, "More texture or more light.");
        assert!(found[1].what.ends_with("at an end of the depth range"), "{found:?}");
        assert!(of_statuses(&Value::Null).is_empty());
    }

    #[test]
    fn views_are_counted_and_the_first_are_named() {
        let found = listed((0..20).collect(), "what".to_owned(), "remedy").unwrap();
        assert_eq!((found.what.as_str(), found.views.len(), found.count), ("20 views: what", MOST_NAMES, 20));
        assert_eq!(listed(Vec::new(), String::new(), ""), None);
    }
}
