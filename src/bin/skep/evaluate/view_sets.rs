//! The source views of pixels against true visibility.

use super::scores::share;
use super::surface::TrueView;
use super::work::Work;
use serde::Serialize;
use skep::Result;
use skep::io::{MapKind, ModelImage, Workspace, read_consistency_graph};

/// How well the source views of the pixels are those that see the true surface there.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ViewSets {
    /// Source views that see the surface, in all that were chosen.
    pub precision: f64,
    /// Source views that were chosen, in all that see the surface, of those that the view ever chose.
    pub recall: f64,
}

/// Compares the consistency graphs; `None` if the workspace has none.
///
/// # Errors
/// A damaged graph; the user asked to stop.
pub fn score(
    work: &Work,
    workspace: &Workspace,
    kind: MapKind,
    images: &[ModelImage],
    views: &[TrueView],
) -> Result<Option<ViewSets>> {
    let indices: Vec<usize> = (0..images.len()).collect();
    let counts = work.map("source views compared", &indices, |&index| {
        let path = workspace.consistency_graph(&images[index].name, kind);
        if !path.is_file() || views[index].depth.is_empty() {
            return Ok([0; 3]);
        }
        let graph = read_consistency_graph(&path)?;
        let mut is_source = vec![false; views.len()];
        for entry in 0..graph.pixels.len() {
            let of_scene = graph.views.get(entry).iter().filter(|view| (**view as usize) < views.len());
            of_scene.for_each(|view| is_source[*view as usize] = true);
        }
        is_source[index] = false;
        let [mut right, mut wrong, mut missed] = [0u64; 3];
        for (entry, &[column, row]) in graph.pixels.iter().enumerate() {
            let Some(point) = views[index].point(column, row) else { continue };
            let chosen = graph.views.get(entry);
            for (source, view) in views.iter().enumerate().filter(|(source, _)| is_source[*source]) {
                match (chosen.contains(&(source as u32)), view.sees(point)) {
                    (true, true) => right += 1,
                    (true, false) => wrong += 1,
                    (false, true) => missed += 1,
                    (false, false) => (),
                }
            }
        }
        Ok([right, wrong, missed])
    })?;
    let [right, wrong, missed] = counts.iter().fold([0; 3], |sum, counts| {
        let mut sum = sum;
        sum.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
        sum
    });
    let sets = ViewSets { precision: share(right, right + wrong), recall: share(right, right + missed) };
    Ok((right + wrong > 0).then_some(sets))
}
