//! From correspondences to what every camera saw of every view, and back.

use super::{
    settings::BundleSettings,
    solved::ViewPose,
    state::{Choice, Shot, State},
};
use crate::{
    Error, Result,
    camera::posed_lens::PosedLens,
    dataset::Dataset,
    geometry::{Point3, Pose, Vector3, principal_axes},
    method::Lens,
};
use nalgebra::Matrix3;

/// The data as an adjustment wants them.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    pub(super) bundle_settings: BundleSettings,
    pub(super) cameras: usize,
    pub(super) names: Vec<String>,
    /// By view, then camera.
    pub(super) shots: Vec<Shot>,
    /// Whether a view's points are in the world's frame, and stay.
    pub(super) fixed: Vec<bool>,
    /// World from the frame of a view's own plane, for views whose places are known.
    known: Vec<Option<Pose>>,
    /// Whether lenses are known, and stay.
    pub(super) lenses_are_known: bool,
}

/// Three views tell a camera's focal length and principal point.
const VIEWS_NEEDED: usize = 3;

impl Gathered {
    pub(super) fn new(data: &Dataset, bundle_settings: BundleSettings) -> Result<Self> {
        Self::of(data, bundle_settings, false)
    }

    /// For cameras whose lenses are known: one view tells where they stand.
    pub(super) fn of(
        data: &Dataset,
        bundle_settings: BundleSettings,
        lenses_are_known: bool,
    ) -> Result<Self> {
        let count = data.views.len().max(1);
        let mut gathered = Self {
            bundle_settings,
            cameras: data.cameras,
            names: (0..count)
                .map(|view| data.views.get(view).cloned().unwrap_or_default())
                .collect(),
            shots: vec![vec![Vec::new(); data.cameras]; count],
            fixed: vec![false; count],
            known: known_planes(data, count),
            lenses_are_known,
        };
        for row in &data.correspondences {
            let place = match (row.world, row.board) {
                (Some(world), _) => {
                    gathered.known[row.view].map(|plane| plane.inverse().transform(world))
                }
                (None, Some([x, y])) => Some(Point3::new(x, y, 0.0)),
                (None, None) => None,
            };
            let Some(place) = place else { continue };
            for (seen, pixel) in gathered.shots[row.view].iter_mut().zip(&row.pixels) {
                seen.extend(pixel.map(|pixel| (place, pixel)));
            }
        }
        let used = gathered.shots.iter().filter(|shot| shot.iter().any(|seen| !seen.is_empty()));
        let got = used.count();
        let need = if lenses_are_known { 1 } else { VIEWS_NEEDED };
        if got < need && data.views.is_empty() {
            return Err(Error::Degenerate {
                problem: "no column `view` tells which picture each point of the board is from"
                    .into(),
                hint: format!("add it: at least {need} views, each tilted differently").into(),
            });
        }
        if got < need {
            return Err(Error::TooFew {
                method: "a hand-held chart".into(),
                what: "views, each tilted differently".into(),
                need,
                got,
            });
        }
        Ok(gathered)
    }

    pub(super) fn is_known(&self, view: usize) -> bool {
        self.known[view].is_some()
    }

    /// Normals of the charts whose places are known, in the world.
    pub(super) fn known_normals(&self) -> impl Iterator<Item = Vector3> {
        self.known.iter().flatten().map(|plane| plane.rotation.column(2).into_owned())
    }

    pub(super) fn has_known(&self) -> bool {
        self.known.iter().any(Option::is_some)
    }

    /// The same with known places where they are known to be, and a state brought to that frame;
    /// `None` where no place is known.
    pub(super) fn known_frame<L: Lens>(
        &self,
        data: &Dataset,
        state: &State<L>,
    ) -> Option<(Self, State<L>)> {
        let rows = data.correspondences.iter();
        let pairs: Vec<(Point3, Point3)> = rows
            .filter_map(|row| {
                let (world, plane) = (row.world?, self.known[row.view]?);
                Some((state.charts[row.view].transform(plane.inverse().transform(world)), world))
            })
            .collect();
        let to_world = Pose::aligning(&pairs)?;
        let mut fixed = self.clone();
        let mut moved = state.clone();
        for (view, plane) in self.known.iter().enumerate() {
            let Some(plane) = plane else { continue };
            fixed.fixed[view] = true;
            for (place, _) in fixed.shots[view].iter_mut().flatten() {
                *place = plane.transform(*place);
            }
        }
        let back = to_world.inverse();
        moved.cameras = state
            .cameras
            .iter()
            .map(|camera| PosedLens {
                lens: camera.lens.clone(),
                camera_from_world: camera.camera_from_world.after(&back),
            })
            .collect();
        for (view, chart) in moved.charts.iter_mut().enumerate() {
            *chart = if fixed.fixed[view] { Pose::default() } else { to_world.after(chart) };
        }
        Some((fixed, moved))
    }

    /// The data with the places of all points that are known now.
    pub(super) fn in_world(&self, data: &Dataset, placed: &[bool], poses: &[Pose]) -> Dataset {
        let mut solved = data.clone();
        for row in &mut solved.correspondences {
            if let (None, Some([x, y]), true) = (row.world, row.board, placed[row.view]) {
                row.world = Some(poses[row.view].transform(Point3::new(x, y, 0.0)));
            }
        }
        solved.subset(|_, row| row.world.is_some())
    }

    /// Where the charts stand.
    pub(super) fn placed<L>(
        &self,
        choice: &Choice<L>,
        to_world: &Pose,
        poses: &[Pose],
    ) -> Vec<ViewPose> {
        let views = (0..self.shots.len()).filter(|view| choice.loose[*view]);
        views
            .map(|view| {
                let pose = &poses[view];
                let covariance = choice.charts.as_ref().map(|all| all[view]);
                let sigma = |first: usize| -> [f64; 3] {
                    let Some(covariance) = covariance else { return [f64::NAN; 3] };
                    let own: Matrix3<f64> =
                        covariance.fixed_view::<3, 3>(first, first).into_owned();
                    let turned = to_world.rotation * own * to_world.rotation.transpose();
                    [0, 1, 2].map(|axis| turned[(axis, axis)].max(0.0).sqrt())
                };
                ViewPose {
                    view: self.names[view].clone(),
                    translation: pose.translation.into(),
                    rotation: pose.rotation_vector().into(),
                    translation_sigma: sigma(3),
                    rotation_sigma: sigma(0),
                    points: choice.clean[view].iter().map(Vec::len).max().unwrap_or(0),
                }
            })
            .collect()
    }
}

/// For views whose points' places are known: world from the frame of the plane on which they lie.
fn known_planes(data: &Dataset, count: usize) -> Vec<Option<Pose>> {
    let mut places: Vec<Vec<Point3>> = vec![Vec::new(); count];
    for row in &data.correspondences {
        places[row.view].extend(row.world);
    }
    places.iter().map(|places| plane(places)).collect()
}

fn plane(places: &[Point3]) -> Option<Pose> {
    if places.len() < 4 {
        return None;
    }
    let (middle, axes, _) = principal_axes(places);
    // The third axis completes a right-handed frame.
    let rotation = Matrix3::from_columns(&[axes[0], axes[1], axes[0].cross(&axes[1])]);
    Some(Pose { rotation, translation: middle.coords })
}
