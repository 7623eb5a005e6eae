//! The camera on which most views agree, whatever the others say.
//!
//! Source: the consensus of small samples, Fischler & Bolles 1981 (doi:10.1145/358669.358692); the
//! samples are whole views here, because faults are of whole views.

use super::{
    pairs::{Pair, extent},
    robust_camera::RobustCamera,
};
use wheatstone_numeric::{random::Random, statistics::median};

/// The camera on which most views agree, and which they are.
pub(super) struct Consensus {
    pub(super) camera: RobustCamera,
    pub(super) agrees: Vec<bool>,
}

/// Looks for the camera on which most of `views` agree. Needs two views or more.
pub(super) fn consensus(views: &[Vec<Pair>], random: &mut Random) -> Option<Consensus> {
    let usable: Vec<usize> = (0..views.len()).filter(|view| views[*view].len() >= 4).collect();
    let all: Vec<Pair> = usable.iter().flat_map(|view| views[*view].iter().copied()).collect();
    let tolerance = (0.004 * extent(&all)).max(1.0);
    let mut best: Option<(f64, Consensus)> = None;
    for sample in samples(&usable, random) {
        let pairs: Vec<Pair> =
            sample.iter().flat_map(|view| views[*view].iter().copied()).collect();
        let Some(camera) = RobustCamera::fit(&pairs, if sample.len() > 4 { 12 } else { 8 }) else {
            continue;
        };
        let Some((score, found)) = resolve(camera, views, &usable, tolerance) else { continue };
        let share =
            found.agrees.iter().filter(|agrees| **agrees).count() as f64 / usable.len() as f64;
        if best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, found));
        }
        // All but a few agree, and nothing that is tried can be much better.
        if share > 0.99 && score < 0.3 * usable.len() as f64 {
            break;
        }
    }
    best.map(|(_, consensus)| consensus)
}

/// All views, then neighbours, then threes at random.
fn samples(usable: &[usize], random: &mut Random) -> Vec<Vec<usize>> {
    // Threes of which one in eight is sound are found among 24 with 96 %.
    const THREES: usize = 24;
    // Of more views, neighbours here and there.
    const NEIGHBOURS: usize = 100;
    let mut all = vec![usable.to_vec()];
    if usable.len() > 3 {
        let step = usable.len().div_ceil(NEIGHBOURS);
        all.extend(usable.windows(3).step_by(step).map(<[usize]>::to_vec));
        for _ in 0..THREES {
            let mut order = usable.to_vec();
            random.shuffle(&mut order);
            order.truncate(3);
            order.sort_unstable();
            // What was tried tells nothing more.
            if !all.contains(&order) {
                all.push(order);
            }
        }
    } else if usable.len() == 3 {
        all.extend([
            vec![usable[0], usable[1]],
            vec![usable[0], usable[2]],
            vec![usable[1], usable[2]],
        ]);
    }
    all
}

/// Takes in the views that agree, and fits again, until they stay the same. The score is small where
/// many agree well.
fn resolve(
    mut camera: RobustCamera,
    views: &[Vec<Pair>],
    usable: &[usize],
    tolerance: f64,
) -> Option<(f64, Consensus)> {
    let mut agrees = vec![false; views.len()];
    for round in 0..4 {
        let errors: Vec<(usize, f64)> =
            usable.iter().map(|view| (*view, camera.median_error(&views[*view]))).collect();
        let mut sorted: Vec<f64> = errors.iter().map(|(_, error)| *error).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        // Half of the views, at least two, are taken for sound; the rest by their measure.
        let half = sorted[..sorted.len().div_ceil(2).max(2).min(sorted.len())].to_vec();
        let most = if round == 0 { tolerance * 2.0 } else { tolerance }.max(4.0 * median(&half));
        let mut next = vec![false; views.len()];
        errors.iter().for_each(|(view, error)| next[*view] = *error <= most);
        if next == agrees && round > 0 {
            break;
        }
        agrees = next;
        let pairs: Vec<Pair> = usable
            .iter()
            .filter(|view| agrees[**view])
            .flat_map(|view| views[*view].iter().copied())
            .collect();
        if pairs.len() < 8 {
            return None;
        }
        camera = camera.refined(&pairs, 8);
    }
    let score =
        usable.iter().map(|view| (camera.median_error(&views[*view]) / tolerance).min(1.0)).sum();
    Some((score, Consensus { camera, agrees }))
}
