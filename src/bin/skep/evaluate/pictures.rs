//! Which plots are made of which scores.

use super::Scores;
use super::plots::{Series, bars, curves, histogram};
use super::scores::{Histogram, share};
use skep::Result;
use std::path::Path;

/// Draws all plots of the scores into a folder.
pub fn draw(scores: &Scores, folder: &Path) -> Result<()> {
    if let Some(depth) = &scores.depth {
        let tally = &depth.tally;
        let file = |name: &str| folder.join(name);
        let label = "relative error of the depth";
        let lines = [
            Series { name: "recall", values: below(&tally.errors, tally.truth) },
            Series { name: "precision", values: below(&tally.errors, tally.estimated) },
        ];
        curves(&file("depth-thresholds.svg"), "Depths within an error", label, &lines)?;
        histogram(&file("depth-errors.svg"), "Errors of the depth", label, &tally.errors)?;
        let names: Vec<&str> = depth.views.iter().map(|view| view.name.as_str()).collect();
        let middle = depth.thresholds.len() / 2;
        let fill = depth.views.iter().map(|view| view.fill).collect();
        let f = depth.views.iter().map(|view| view.thresholds.get(middle).map_or(0.0, |rates| rates.f));
        let within = depth.thresholds.get(middle).map_or(0.0, |rates| rates.threshold);
        let f_name = format!("F within {within}");
        let series = [Series { name: "fill", values: fill }, Series { name: &f_name, values: f.collect() }];
        bars(&file("depth-views.svg"), "Views", &names, &series)?;
    }
    if let Some(cloud) = &scores.cloud {
        let [to_truth, to_cloud] = &cloud.distances;
        let label = "distance";
        let lines = [
            Series { name: "recall", values: below(to_cloud, cloud.truth_points as u64) },
            Series { name: "precision", values: below(to_truth, cloud.judged_points as u64) },
        ];
        curves(&folder.join("cloud-thresholds.svg"), "Points within a distance", label, &lines)?;
        let title = "Distances from the cloud to the truth";
        histogram(&folder.join("cloud-accuracy.svg"), title, label, to_truth)?;
        let title = "Distances from the truth to the cloud";
        histogram(&folder.join("cloud-completeness.svg"), title, label, to_cloud)?;
    }
    if let Some(held_out) = &scores.held_out {
        let names: Vec<&str> = held_out.views.iter().map(|view| view.name.as_str()).collect();
        let shares = |value: fn(&super::held_out::Shares) -> f64| {
            held_out.views.iter().map(|view| value(&view.shares)).collect()
        };
        let series = [
            Series { name: "covered", values: shares(|shares| shares.covered) },
            Series { name: "right", values: shares(|shares| shares.right) },
            Series { name: "precision", values: shares(|shares| shares.precision) },
        ];
        bars(&folder.join("held-out-views.svg"), "Photographs left out", &names, &series)?;
    }
    Ok(())
}

/// The share of a whole below the end of each bin.
fn below(histogram: &Histogram, whole: u64) -> Vec<(f64, f64)> {
    histogram.cumulative().into_iter().map(|(end, count)| (end, share(count, whole))).collect()
}
