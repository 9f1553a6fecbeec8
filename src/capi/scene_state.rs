//! What a scene object in C holds: the views and points while they change, then the checked scene with what
//! queries derive from it.

use crate::error::Result;
use crate::fusion;
use crate::options::{Options, ViewSelectionOptions};
use crate::scene::{Scene, SparsePoint, View};
use crate::view_selection::{self, SharedAngles};
use glam::DVec3;
use std::ops::Deref;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The inside of a scene object. Views and points are in one place only: a check moves them, and so does a
/// change after it, unless a run or a copy still uses them.
#[derive(Clone)]
pub(super) enum SceneState {
    /// Changed since the last check.
    Changed(Vec<View>, Vec<SparsePoint>),
    /// Checked, and not changed since.
    Checked(Arc<CheckedScene>),
}

impl Default for SceneState {
    fn default() -> Self {
        SceneState::Changed(Vec::new(), Vec::new())
    }
}

impl SceneState {
    pub(super) fn new(scene: Scene) -> SceneState {
        SceneState::Checked(Arc::new(CheckedScene::new(scene)))
    }

    pub(super) fn views(&self) -> &[View] {
        match self {
            SceneState::Changed(views, _) => views,
            SceneState::Checked(scene) => scene.views(),
        }
    }

    /// The checked scene, where it is known.
    pub(super) fn checked(&self) -> Option<Arc<CheckedScene>> {
        match self {
            SceneState::Changed(..) => None,
            SceneState::Checked(scene) => Some(scene.clone()),
        }
    }

    /// Checks the scene unless it is checked.
    pub(super) fn check(&mut self) -> Result<Arc<CheckedScene>> {
        match self {
            SceneState::Checked(scene) => Ok(scene.clone()),
            SceneState::Changed(views, points) => {
                let scene = Arc::new(CheckedScene::new(Scene::take(views, points)?));
                *self = SceneState::Checked(scene.clone());
                Ok(scene)
            }
        }
    }

    /// The views and points, to change them: what was derived from them is dropped.
    pub(super) fn parts(&mut self) -> (&mut Vec<View>, &mut Vec<SparsePoint>) {
        if let SceneState::Checked(_) = self
            && let SceneState::Checked(scene) = std::mem::take(self)
        {
            let (views, points) = match Arc::try_unwrap(scene) {
                Ok(own) => own.scene.into_parts(),
                Err(shared) => (shared.views().to_vec(), shared.points().to_vec()),
            };
            *self = SceneState::Changed(views, points);
        }
        match self {
            SceneState::Changed(views, points) => (views, points),
            SceneState::Checked(_) => unreachable!("replaced above"),
        }
    }
}

/// A list of views for each view.
type Lists = Vec<Vec<u32>>;

/// A checked scene, and what queries derived from it: each on its first use, for all views at once.
pub(super) struct CheckedScene {
    scene: Scene,
    overlaps: OnceLock<Lists>,
    angles: OnceLock<SharedAngles>,
    /// The source lists for the last options asked for.
    sources: Mutex<Option<(ViewSelectionOptions, Arc<Lists>)>>,
}

impl Deref for CheckedScene {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.scene
    }
}

impl CheckedScene {
    fn new(scene: Scene) -> CheckedScene {
        CheckedScene { scene, overlaps: OnceLock::new(), angles: OnceLock::new(), sources: Mutex::new(None) }
    }

    /// For each view those that fusion compares with it.
    pub(super) fn overlaps(&self) -> &[Vec<u32>] {
        self.overlaps.get_or_init(|| {
            let centers: Vec<DVec3> = self.views().iter().map(|view| view.camera.center()).collect();
            fusion::overlaps(&centers, self.points())
        })
    }

    fn angles(&self) -> &SharedAngles {
        self.angles.get_or_init(|| SharedAngles::new(&self.scene))
    }

    /// The triangulation angle of two views in degrees; `None` where they share no surface.
    pub(super) fn triangulation_angle(&self, reference: usize, source: usize) -> Option<f64> {
        view_selection::triangulation_angle(&self.scene, self.angles(), reference, source)
    }

    /// The source views of each view.
    pub(super) fn source_lists(&self, options: &Options) -> Arc<Lists> {
        // Locked while the lists are made: other callers wait for them instead of making them too. A panic
        // leaves the lists of other options, or none.
        let mut last = self.sources.lock().unwrap_or_else(PoisonError::into_inner);
        // The lists, not their warnings, depend on this group of the options alone.
        let rules = options.view_selection;
        if let Some((_, lists)) = last.as_ref().filter(|(of, _)| *of == rules) {
            return lists.clone();
        }
        let lists = view_selection::source_lists_by_angle(&self.scene, self.angles(), options).lists;
        let lists = Arc::new(lists);
        *last = Some((rules, lists.clone()));
        lists
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DepthRange;
    use crate::image::Picture;
    use crate::testing::{changed, looking_at};

    /// Three views that look at the same point from a row, all with a depth range.
    fn views() -> Vec<View> {
        let view = |index: u32| View {
            name: format!("view{index}"),
            picture: Picture::from_gray(8, 6, vec![0; 48]).unwrap().into(),
            camera: looking_at(DVec3::new(f64::from(index), 0.0, -8.0), DVec3::ZERO, (8, 6), 10.0),
            mask: None,
            depth_range: Some(DepthRange { near: 4.0, far: 16.0 }),
            sources: None,
        };
        (0..3).map(view).collect()
    }

    fn seen_by(views: &[u32]) -> SparsePoint {
        SparsePoint { position: DVec3::ZERO, views: views.to_vec() }
    }

    #[test]
    fn queries_derive_once_until_the_scene_is_changed() {
        let mut state = SceneState::Changed(views(), vec![seen_by(&[0, 1, 2])]);
        assert!(state.checked().is_none());
        let first = state.check().unwrap();
        assert!(Arc::ptr_eq(&first, &state.check().unwrap()));
        assert!(Arc::ptr_eq(&first, &state.checked().unwrap()));
        assert_eq!(first.overlaps(), [vec![1, 2], vec![0, 2], vec![0, 1]]);
        assert!(std::ptr::eq(first.overlaps(), first.overlaps()));

        let options = Options::default();
        let lists = first.source_lists(&options);
        assert!(Arc::ptr_eq(&lists, &first.source_lists(&options)));
        let narrow = changed(options.clone(), |o| {
            o.view_selection.min_sources = 0;
            o.view_selection.max_sources = 1;
        });
        assert_eq!(first.source_lists(&narrow)[0].len(), 1);
        assert_eq!(*first.source_lists(&options), *lists);

        state.parts().1[0] = seen_by(&[0, 1]);
        assert!(state.checked().is_none());
        let second = state.check().unwrap();
        assert_eq!(second.overlaps(), [vec![1, 2], vec![0, 2], vec![0, 1]], "view 2 has no points now");
        state.parts().1.push(seen_by(&[1, 2]));
        assert_eq!(state.check().unwrap().overlaps(), [vec![1], vec![0, 2], vec![1]]);
        // Whoever uses the scene as it was keeps it.
        assert_eq!((first.points()[0].views.len(), first.points().len()), (3, 1));
    }

    #[test]
    fn a_change_moves_the_views_and_points_unless_a_run_uses_them() {
        let mut state = SceneState::Changed(views(), vec![seen_by(&[0, 1])]);
        let address = |state: &SceneState| state.views().as_ptr();
        let start = address(&state);
        state.check().unwrap();
        assert_eq!(address(&state), start);
        let kept = state.check().unwrap();
        state.parts();
        assert_ne!(address(&state), start);
        drop(kept);
        let copy = address(&state);
        state.check().unwrap();
        state.parts();
        assert_eq!(address(&state), copy);
    }

    #[test]
    fn a_scene_that_fails_the_check_stays_as_it_is() {
        let mut state = SceneState::Changed(views(), vec![seen_by(&[0, 9])]);
        assert!(state.check().is_err());
        assert_eq!(state.views().len(), 3);
        state.parts().1[0] = seen_by(&[0, 1]);
        assert!(state.check().is_ok());
    }
}
